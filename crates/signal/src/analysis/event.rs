/// Something that happened in a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// What: `beat`, `pulse`, `breath`, `response`, `burst` or `blink`.
    pub kind: &'static str,
    /// Where [samples from the first one], between samples.
    pub sample: f64,
    /// When [ns].
    pub at_ns: i64,
    /// Further details, each with the unit in its name, as in `amplitude_us`; NaN for what is unknown.
    pub details: Vec<(&'static str, f64)>,
}
