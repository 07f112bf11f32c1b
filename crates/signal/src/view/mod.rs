//! What a camera sees of a person, from numbers of its frames: whether somebody is there, how much moves, and the pulse in
//! the colour of the skin (remote photoplethysmography).
//!
//! ```text
//! frames (irregular) ──► colours at 30 Hz ──► pulse wave (POS) ──► spectra of 15 s, each 2.5 s ──► the values of a span
//! ```
//!
//! The blood of each beat darkens skin by some thousandths, green most. Movement and light change all colours alike:
//! the projection of Wang et al. (2017, doi:10.1109/TBME.2016.2609282) is orthogonal to skin tone and takes out most of that.
//! What is left may still be light that flickers: a rhythm that the whole view has is no pulse.

pub mod analysis;
mod pulse_wave;
mod spectra;
mod store;
mod values;

/// The numbers of a frame that are read, by the names of their channels.
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
    /// Whether somebody is there [0 or 1].
    presence: f64,
    /// The share of the view that is skin [0..1].
    skin: f64,
    /// The mean colour of skin [0..1]; NaN without any.
    colour: [f64; 3],
}
