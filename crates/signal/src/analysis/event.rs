/// An event detected in a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Its kind: `beat`, `pulse`, `breath`, `response`, `burst` or `blink`.
    pub kind: &'static str,
    /// Its position [samples from the first one], fractional.
    pub sample: f64,
    /// Its time [ns].
    pub at_ns: i64,
    /// Further details, each with the unit in its name, as in `amplitude_us`; NaN for what is unknown.
    pub details: Vec<(&'static str, f64)>,
}
