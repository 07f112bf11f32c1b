#![doc = include_str!("../README.md")]
#![cfg_attr(
    test,
    expect(clippy::float_cmp, reason = "tests compare exactly where the arithmetic is exact")
)]

pub mod error;
pub mod estimate;
pub mod robust;
mod moments;
pub mod slope;
pub mod trend;
pub mod window;
pub mod coverage;
pub mod gaps;
pub mod filter;
pub mod spectrum;
pub mod cubic;
pub mod peaks;
pub mod sliding;
mod history;
mod recent;
pub mod statistics;
pub mod intervals;
pub mod hrv;
pub mod agreement;
pub mod analysis;
pub mod ecg;
pub mod ppg;
pub mod arrival;
pub mod respiration;
pub mod emg;
pub mod eeg;
pub mod temperature;
pub mod acceleration;
pub mod descriptive;
pub mod eda;
pub mod voice;
pub mod view;
pub mod activity;
pub mod face;
pub mod body;
pub mod expression;
mod points;
