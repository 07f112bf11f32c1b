/// An event detected in a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The kind of event: `beat`, `pulse`, `breath`, `response`, `burst` or `blink`.
    pub kind: &'static str,
    /// The position of the event [samples from the first one], fractional.
    pub sample: f64,
    /// The time of the event [ns].
    pub at_ns: i64,
    /// Further details, each with the unit in its name, as in `amplitude_us`; NaN where unknown.
    pub details: Vec<(&'static str, f64)>,
}
