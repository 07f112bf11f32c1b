//! A skin conductance response.

/// A skin conductance response (SCR): a rise caused by sweat glands that are activated at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Where it begins to rise [samples from the first one].
    pub onset: f64,
    /// Where it is highest [samples from the first one].
    pub peak: f64,
    /// From its onset to its peak [µS].
    pub amplitude_us: f64,
    /// From its onset to its peak [s].
    pub rise_secs: f64,
    /// From its peak until half of the amplitude is gone [s]; `None` when the next response, or the
    /// end, comes before.
    pub half_recovery_secs: Option<f64>,
}

/// What a rise must reach to be a response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    /// An amplitude [µS]: 0.05 stands out of most amplifiers' noise, 0.01 is for quiet ones.
    /// Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x.
    Absolute(f64),
    /// A share of the greatest prominence of the recording [0..1], as NeuroKit2 (0.1): where
    /// nothing happens, noise is counted. Only of whole recordings.
    Relative(f64),
}

impl Default for Threshold {
    fn default() -> Threshold {
        Threshold::Absolute(0.05)
    }
}
