//! Commands of the people in a team to its robots.

use crate::noise::Noise;
use crate::task::{Happening, Task, What};

use super::arena::{Arena, Point};
use super::goals::Goals;
use super::settings::Settings;

/// A command with which a person sends a robot to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The time after the start [s].
    pub at_secs: f64,
    /// The index of the robot, from 0.
    pub robot: usize,
    /// The goal.
    pub goal: Point,
}

/// All commands of the people in a team.
///
/// The actions of a person are determined by a seed, so the robots know them without messages: the simulation of the
/// person runs the same task ([`Settings::task_of_person`]).
#[derive(Debug)]
pub struct Commands {
    people: Vec<Person>,
    goals: Goals,
}

/// A person's task, and the next command.
#[derive(Debug)]
struct Person {
    task: Task,
    next: Option<Happening>,
}

impl Commands {
    /// Creates the commands of a team.
    pub fn of(team: &Settings, noise: &mut Noise) -> Commands {
        let person = |number| Person { task: team.task_of_person(number), next: None };
        Commands { people: (1..=team.people).map(person).collect(), goals: Goals::new(noise) }
    }

    /// Returns the next command in order of time, if it is given by a time after the start [s]. Its goal is a place
    /// that is free for a robot of this radius [m].
    pub fn next_until(&mut self, secs: f64, arena: &Arena, radius_m: f64) -> Option<Command> {
        let due = self.people.iter_mut().filter_map(|person| {
            let at_secs = person.look_ahead(secs)?.at_secs;
            Some((at_secs, person))
        });
        let (at_secs, person) = due.min_by(|one, other| one.0.total_cmp(&other.0))?;
        let What::Command { robot } = person.next.take()?.what else { return None };
        let goal = self.goals.next_free(arena, radius_m);
        Some(Command { at_secs, robot: robot as usize, goal })
    }
}

impl Person {
    fn look_ahead(&mut self, secs: f64) -> Option<Happening> {
        while self.next.is_none() {
            let happening = self.task.next_until(secs)?;
            if matches!(happening.what, What::Command { .. }) {
                self.next = Some(happening);
            }
        }
        self.next
    }
}
