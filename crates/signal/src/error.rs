//! Errors of this crate.

use thiserror::Error;

/// Why a value, a filter or a spectrum could not be computed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum SignalError {
    /// The sampling rate is invalid.
    #[error("the sampling rate is {rate_hz} Hz; it must be between 1e-9 and 1e12 Hz")]
    Rate {
        /// The rate given [Hz].
        rate_hz: f64,
    },
    /// A frequency is outside the range up to Nyquist.
    #[error("{frequency_hz} Hz is not between 0 and {nyquist_hz} Hz, half the sampling rate")]
    Frequency {
        /// The frequency given [Hz].
        frequency_hz: f64,
        /// Half the sampling rate [Hz].
        nyquist_hz: f64,
    },
    /// The lower edge of a band is not below its upper edge.
    #[error("the band from {low_hz} Hz to {high_hz} Hz is empty")]
    Band {
        /// Lower edge [Hz].
        low_hz: f64,
        /// Upper edge [Hz].
        high_hz: f64,
    },
    /// A setting is out of range.
    #[error("{name} is {value}; it must be between {least} and {most}")]
    Setting {
        /// The name of the setting.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The smallest allowed value.
        least: f64,
        /// The largest allowed value.
        most: f64,
    },
    /// The filter would ring forever, or its coefficients are not finite.
    #[error("the filter is not stable; its frequencies are too extreme for the sampling rate")]
    Unstable,
    /// The signal is too short.
    #[error("the signal has {count} samples; at least {least} are needed")]
    TooShort {
        /// The number of samples given.
        count: usize,
        /// The number of samples needed.
        least: usize,
    },
    /// None of the channels has a required quantity.
    #[error("none of the channels is {lacking}")]
    Channels {
        /// The missing quantity, in words for the user.
        lacking: &'static str,
    },
    /// Two series that must match differ in length.
    #[error("{left} values cannot be matched with {right}")]
    Lengths {
        /// The length of the first.
        left: usize,
        /// The length of the second.
        right: usize,
    },
    /// Times do not ascend.
    #[error("time {index} is not after the one before it, or not finite")]
    Order {
        /// The index of the first time out of order (from 0).
        index: usize,
    },
    /// The signal is constant, so that a share is undefined.
    #[error("all values are the same")]
    Constant,
    /// A computation overflowed.
    #[error("the magnitudes of the values are too different to compute with")]
    Overflow,
    /// No value is a usable number.
    #[error("no value is finite")]
    NothingFinite,
}

/// Returns the sampling rate if it is valid.
pub(crate) fn checked_rate_hz(rate_hz: f64) -> Result<f64, SignalError> {
    if (1e-9..=1e12).contains(&rate_hz) { Ok(rate_hz) } else { Err(SignalError::Rate { rate_hz }) }
}

/// Returns a setting if it is in range.
pub(crate) fn checked(
    name: &'static str,
    value: f64,
    (least, most): (f64, f64),
) -> Result<f64, SignalError> {
    let fits = (least..=most).contains(&value);
    if fits { Ok(value) } else { Err(SignalError::Setting { name, value, least, most }) }
}
