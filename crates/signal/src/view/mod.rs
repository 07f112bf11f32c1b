//! Camera-based measures of a person, from per-frame numbers: presence, movement, and the pulse in the
//! colour of the skin (remote photoplethysmography).
//!
//! ```text
//! frames (irregular) ──► colours at 30 Hz ──► pulse wave (POS) ──► spectra of 15 s, every 2.5 s ──► the values of a span
//! ```
//!
//! The blood of each beat darkens the skin by a few thousandths, green most. Movement and light change all
//! colours equally: the projection of Wang et al. (2017, doi:10.1109/TBME.2016.2609282) is orthogonal to
//! skin tone and removes most of that. The rest may still be flickering light: a rhythm of the whole view
//! is not a pulse.

pub mod analysis;
mod pulse_wave;
mod spectra;
mod store;
mod values;

/// The numbers of a frame that are used, by channel name.
pub const CHANNELS: [&str; 7] =
    ["brightness", "moving", "presence", "skin", "red", "green", "blue"];

/// The numbers of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    at_ns: i64,
    /// The mean luma of the view [0..1].
    brightness: f64,
    /// The share of the view that moves [0..1]; NaN where unknown.
    moving: f64,
    /// Whether a person is present [0 or 1].
    presence: f64,
    /// The share of the view that is skin [0..1].
    skin: f64,
    /// The mean colour of the skin [0..1]; NaN without skin.
    colour: [f64; 3],
}
