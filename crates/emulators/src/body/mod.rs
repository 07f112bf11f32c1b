//! One simulated human body: heart, vessels, skin, breath, muscles, brain, eyes, warmth and movement, driven by
//! workload, arousal and valence.
//!
//! It shows what pipelines make of known signals; it proves nothing about people. The directions of effects follow the
//! literature (heart rate and skin conductance rise with the level of an n-back task: Mehler et al. 2012,
//! doi:10.1177/0018720812442086; breathing becomes faster, not deeper: Grassmann et al. 2016,
//! doi:10.1155/2016/8146809). Magnitudes are within the usual range, and are stated where they are used.
//!
//! ```
//! use teampulse_emulators::body::{Body, Sensor, Traits};
//!
//! let mut body = Body::new(&Traits::of_seed(7), 7);
//! body.state(0.65, 0.5, 0.5);
//! let record = body.until(10.0);
//! assert_eq!(record.wave(Sensor::Ecg).count(), 1300);
//! assert_eq!(record.truth.moments.len(), 10);
//! assert!(record.truth.beats.len() > 8);
//! ```

mod living;
mod traits;
mod state;
mod sensor;
mod rates;
mod record;
mod script;
mod organs;
mod heart;
mod electrocardiogram;
mod vessels;
mod skin;
mod breath;
mod muscle;
mod brain;
mod eyes;
mod warmth;
mod movement;
mod probe;
mod electronics;
mod chance;
mod step;

pub use breath::Breath;
pub use eyes::Blink;
pub use heart::{Beat, Origin};
pub use living::{Body, Settings};
pub use movement::Swing;
pub use muscle::Contraction;
pub use rates::{RateError, Rates};
pub use record::{Moment, Record, Truth, Wave};
pub use script::{Fault, Scene};
pub use sensor::Sensor;
pub use skin::Response;
pub use state::State;
pub use step::STEP_SECS;
pub use traits::Traits;
pub use vessels::Pulse;
