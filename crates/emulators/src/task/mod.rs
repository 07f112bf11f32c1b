//! The task of a person: n-back after a baseline, with occasional commands to a robot.
//!
//! A [`Task`] generates the events: phases, stimuli, presses, commands, reports, and the demands of these on the
//! person. An [`Operator`] is a body that performs a task.
//!
//! ```
//! use teampulse_emulators::task::{Plan, Skill, Task, What};
//!
//! let mut task = Task::new(Plan::default(), Skill::of_seed(3), 3);
//! let first = task.next_until(0.0).expect("the baseline begins at once");
//! assert_eq!(first.what, What::Begins { phase: "baseline", lasts_secs: 60.0 });
//! ```

mod plan;
mod skill;
mod happening;
mod course;
mod trial;
mod attention;
mod operator;

pub use course::Task;
pub use happening::{Happening, What};
pub use operator::{Operator, OperatorOutput};
pub use plan::{Phase, Plan};
pub use skill::Skill;
