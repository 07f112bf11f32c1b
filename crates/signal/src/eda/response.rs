//! A skin conductance response.

/// A skin conductance response (SCR): a rise caused by sweat glands that are activated at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// The onset of the response [samples from the first one].
    pub onset: f64,
    /// The peak of the response [samples from the first one].
    pub peak: f64,
    /// The amplitude, from the onset to the peak [µS].
    pub amplitude_us: f64,
    /// The rise time, from the onset to the peak [s].
    pub rise_secs: f64,
    /// The half recovery time: from the peak until half of the amplitude has decayed [s]; `None` when the next response
    /// or the end comes first.
    pub half_recovery_secs: Option<f64>,
}

/// The threshold of a response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    /// An amplitude [µS]: 0.05 exceeds most amplifiers' noise, 0.01 suits quiet ones. Boucsein et al. (2012),
    /// doi:10.1111/j.1469-8986.2012.01384.x.
    Absolute(f64),
    /// A share of the greatest prominence in the recording [0..1], as in NeuroKit2 (0.1). Counts noise as responses
    /// where nothing happens. Whole recordings only.
    Relative(f64),
}

impl Default for Threshold {
    fn default() -> Threshold {
        Threshold::Absolute(0.05)
    }
}
