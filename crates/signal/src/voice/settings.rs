use crate::error::{SignalError, checked};

/// The supported sampling rates [Hz].
pub const RATES_HZ: (f64, f64) = (8_000.0, 96_000.0);

/// Settings of the voice features.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The lowest pitch [Hz], 40 to 200; the window lasts three periods of it.
    pub lowest_hz: f64,
    /// The highest pitch [Hz], up to 1500.
    pub highest_hz: f64,
    /// The minimum periodicity of a voiced frame [0..1].
    pub voiced: f64,
    /// The minimum distance of speech above the noise floor [dB].
    pub above_floor_db: f64,
}

impl Default for Settings {
    /// 65 to 500 Hz: adults who speak, without falsetto.
    fn default() -> Settings {
        Settings { lowest_hz: 65.0, highest_hz: 500.0, voiced: 0.5, above_floor_db: 5.0 }
    }
}

impl Settings {
    /// Returns the settings if they and the rate [Hz] are in range.
    pub(super) fn checked(&self, rate_hz: f64) -> Result<(), SignalError> {
        checked("the sampling rate [Hz]", rate_hz, RATES_HZ)?;
        checked("the lowest pitch [Hz]", self.lowest_hz, (40.0, 200.0))?;
        checked("the highest pitch [Hz]", self.highest_hz, (self.lowest_hz * 2.0, 1500.0))?;
        checked("the least periodicity of a voiced frame", self.voiced, (0.1, 0.95))?;
        checked(
            "the distance of speech above the noise floor [dB]",
            self.above_floor_db,
            (1.0, 30.0),
        )?;
        Ok(())
    }
}
