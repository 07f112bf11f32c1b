//! The simulated people who wear the devices.

use std::collections::BTreeMap;

use teampulse_core::clock::Stopwatch;
use teampulse_emulators::body::{Body, Traits};
use teampulse_emulators::devices::BodyWearer;
use teampulse_emulators::task::Operator;
use thiserror::Error;

use super::EmulatedWearable;
use crate::simulated::SimulatedTeam;

/// The people of a simulation who wear a device, and the time base that all their devices share.
#[derive(Clone, Debug)]
pub struct Wardrobe {
    people: BTreeMap<String, BodyWearer>,
    clock: Stopwatch,
}

/// A person, and the clock that started when the devices were switched on.
#[derive(Clone, Debug)]
pub(super) struct Dressed {
    pub(super) wearer: BodyWearer,
    pub(super) clock: Stopwatch,
}

/// A person who is not part of the simulation.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("`{0}` is not a simulated person; they are p001 to p999")]
pub struct PersonError(pub String);

impl Wardrobe {
    /// Returns the people who wear these devices, with the same bodies and tasks that `simulate` gives them.
    pub fn of<'a>(
        team: &SimulatedTeam,
        wearables: impl IntoIterator<Item = &'a EmulatedWearable>,
    ) -> Result<Wardrobe, PersonError> {
        let dress = |wearable: &EmulatedWearable| {
            let id = wearable.person();
            let number = number_of(id).ok_or_else(|| PersonError(id.to_owned()))?;
            Ok((id.to_owned(), BodyWearer::new(operator(team, number))))
        };
        let people = wearables.into_iter().map(dress).collect::<Result<_, PersonError>>()?;
        Ok(Wardrobe { people, clock: Stopwatch::start() })
    }

    /// The clock that started when the devices were switched on; the bodies run on it.
    pub fn clock(&self) -> Stopwatch {
        self.clock
    }

    pub(super) fn worn_by(&self, person: &str) -> Result<Dressed, PersonError> {
        let wearer = self.people.get(person).ok_or_else(|| PersonError(person.to_owned()))?;
        Ok(Dressed { wearer: wearer.clone(), clock: self.clock })
    }
}

fn number_of(id: &str) -> Option<u32> {
    let digits = id.strip_prefix('p').filter(|digits| digits.len() == 3)?;
    let digits = Some(digits).filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))?;
    digits.parse().ok().filter(|number| *number > 0)
}

fn operator(team: &SimulatedTeam, number: u32) -> Operator {
    let model = team.model();
    let seed = model.seed_of_person(number);
    let body = Body::wearing(&Traits::of_seed(seed), seed, &team.body);
    let body = body.expect("the settings have been checked");
    Operator::new(body, model.task_of_person(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_whom_no_simulation_has_is_named() {
        let worn = |person: &str| -> EmulatedWearable {
            let worn = format!("type = \"shimmer3\"\nperson = \"{person}\"");
            toml::from_str(&worn).expect("settings")
        };
        let dressed = |person| Wardrobe::of(&SimulatedTeam::default(), &[worn(person)]).map(drop);
        assert_eq!(dressed("p001"), Ok(()));
        let error = dressed("ann").expect_err("nobody is called so");
        assert_eq!(error.to_string(), "`ann` is not a simulated person; they are p001 to p999");
    }

    #[test]
    fn people_have_the_names_of_the_simulation() {
        assert_eq!(number_of("p001"), Some(1));
        for none in ["", "p", "p000", "p1", "p0001", "q001", "pabc", "p+01"] {
            assert_eq!(number_of(none), None, "{none}");
        }
    }
}
