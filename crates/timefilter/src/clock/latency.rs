//! The fixed latency of a device: what no one-way stamp can show.

/// The shortest time that a sample takes from being measured to its arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latency {
    /// The time itself [s].
    pub secs: f64,
    /// Half the width of the interval that holds it with a probability of 95 % [s].
    pub uncertainty_secs: f64,
}
