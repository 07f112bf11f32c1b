//! A team of robots that drive through an arena, discharge, and have better or worse reception of a router, with faults
//! on request and people who command them.
//!
//! The input is time, the output is [`Telegram`]s: the robots' reports, before they become messages of any kind.
//!
//! ```
//! use teampulse_emulators::robots::{Settings, SimTime, Team, Topic};
//!
//! let mut team = Team::new(&Settings::default());
//! let mut telegrams = Vec::new();
//! team.advance(SimTime::from_nanos(10_000_000_000), &mut telegrams);
//! let is_odometry = |index: usize| team.published()[index].topic == Topic::Odom;
//! let odometry = telegrams.iter().filter(|telegram| is_odometry(telegram.stream)).count();
//! // Five robots for ten seconds at 20 Hz; each begins at some moment of its first period.
//! assert!((995..=1000).contains(&odometry));
//! ```

mod team;
mod settings;
mod script;
mod published;
mod topic;
mod telegram;
mod time;
mod robot;
mod wanderer;
mod goals;
mod commands;
mod drive;
mod surroundings;
mod arena;
mod odometer;
mod radio;
mod battery;
mod computer;
mod camera;
mod report;
#[cfg(test)]
mod tests;

pub use arena::{Arena, Point, Rect};
pub use battery::{CELLS, Pack, Reading};
pub use camera::{HEIGHT_PX, WIDTH_PX};
pub use drive::{Pose, Twist};
pub use published::Published;
pub use radio::{FREQUENCY_HZ, NOISE_DBM, Reception, SENT_DBM};
pub use robot::{RADIUS_M, Robot};
pub use script::{Change, Scene};
pub use settings::Settings;
pub use surroundings::Disc;
pub use team::Team;
pub use telegram::{Body, Gauge, Health, Telegram};
pub use time::SimTime;
pub use topic::Topic;
