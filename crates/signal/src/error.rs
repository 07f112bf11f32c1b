//! What can be wrong with a request.

use thiserror::Error;

/// Why a number, a filter or a spectrum could not be computed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum SignalError {
    /// The sampling rate is no rate.
    #[error("the sampling rate is {rate_hz} Hz; it must lie between 1e-9 and 1e12 Hz")]
    Rate {
        /// What was given [Hz].
        rate_hz: f64,
    },
    /// A frequency lies outside of what the sampling rate can show.
    #[error("{frequency_hz} Hz does not lie between 0 and {nyquist_hz} Hz, half the sampling rate")]
    Frequency {
        /// What was given [Hz].
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
    /// A setting lies outside of its range.
    #[error("{name} is {value}; it must lie between {least} and {most}")]
    Setting {
        /// What the setting is called.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The smallest that is allowed.
        least: f64,
        /// The largest that is allowed.
        most: f64,
    },
    /// The filter would ring forever, or its coefficients are not finite.
    #[error("the filter is not stable; its frequencies are too extreme for the sampling rate")]
    Unstable,
    /// There is too little of the signal.
    #[error("the signal has {count} samples; at least {least} are needed")]
    TooShort {
        /// How many there are.
        count: usize,
        /// How many are needed.
        least: usize,
    },
    /// Two series that belong together differ in length.
    #[error("{left} values cannot be matched with {right}")]
    Lengths {
        /// Length of the first.
        left: usize,
        /// Length of the second.
        right: usize,
    },
    /// Times do not ascend.
    #[error("time {index} is not after the one before it, or not finite")]
    Order {
        /// Which one (from 0).
        index: usize,
    },
    /// Nothing varies, so that there is nothing to take a share of.
    #[error("all values are the same")]
    Constant,
    /// Numbers left the range of what can be computed with.
    #[error("the numbers are too far apart to compute with")]
    Overflow,
    /// No value is a usable number.
    #[error("no value is finite")]
    NothingFinite,
}

/// The sampling rate, if it is one.
pub(crate) fn checked_rate_hz(rate_hz: f64) -> Result<f64, SignalError> {
    if (1e-9..=1e12).contains(&rate_hz) { Ok(rate_hz) } else { Err(SignalError::Rate { rate_hz }) }
}

/// A setting, if it lies in its range.
pub(crate) fn checked(
    name: &'static str,
    value: f64,
    (least, most): (f64, f64),
) -> Result<f64, SignalError> {
    let fits = (least..=most).contains(&value);
    if fits { Ok(value) } else { Err(SignalError::Setting { name, value, least, most }) }
}
