//! Butterworth filters, with a maximally flat passband.
//!
//! The coefficients of `scipy.signal.butter(order, …, output="sos")`, in SciPy's order of sections.
//! Butterworth (1930), Experimental Wireless 7; pre-warped bilinear transform. The gain at each cut-off is √½
//! (−3 dB), and ½ with zero phase. `order` is between 1 and [`MOST_ORDER`]; band filters have twice as many
//! poles. Frequencies are between 0 and Nyquist, both excluded.

use std::f64::consts::PI;

use super::Design;
use super::roots::Roots;
use crate::error::{SignalError, checked, checked_rate_hz};

/// The highest supported order.
pub const MOST_ORDER: u32 = 24;

/// Designs a low-pass at `cutoff_hz`.
pub fn low_pass(order: u32, cutoff_hz: f64, rate_hz: f64) -> Result<Design, SignalError> {
    let corner = warped(cutoff_hz, rate_hz)?;
    digital(prototype(order)?.low_pass(corner), rate_hz)
}

/// Designs a high-pass at `cutoff_hz`.
pub fn high_pass(order: u32, cutoff_hz: f64, rate_hz: f64) -> Result<Design, SignalError> {
    let corner = warped(cutoff_hz, rate_hz)?;
    digital(prototype(order)?.high_pass(corner), rate_hz)
}

/// Designs a band-pass between `low_hz` and `high_hz`.
pub fn band_pass(
    order: u32,
    low_hz: f64,
    high_hz: f64,
    rate_hz: f64,
) -> Result<Design, SignalError> {
    let (centre, width) = warped_band(low_hz, high_hz, rate_hz)?;
    digital(prototype(order)?.band_pass(centre, width), rate_hz)
}

/// Designs a band-stop between `low_hz` and `high_hz`.
pub fn band_stop(
    order: u32,
    low_hz: f64,
    high_hz: f64,
    rate_hz: f64,
) -> Result<Design, SignalError> {
    let (centre, width) = warped_band(low_hz, high_hz, rate_hz)?;
    digital(prototype(order)?.band_stop(centre, width), rate_hz)
}

/// Returns the frequency if it is between 0 and Nyquist.
pub(super) fn checked_frequency(frequency_hz: f64, rate_hz: f64) -> Result<f64, SignalError> {
    let nyquist_hz = rate_hz / 2.0;
    let fits = frequency_hz > 0.0 && frequency_hz < nyquist_hz;
    if fits { Ok(frequency_hz) } else { Err(SignalError::Frequency { frequency_hz, nyquist_hz }) }
}

fn digital(analog: Roots, rate_hz: f64) -> Result<Design, SignalError> {
    Design::new(analog.bilinear().sections(), rate_hz)
}

fn prototype(order: u32) -> Result<Roots, SignalError> {
    checked("order", f64::from(order), (1.0, f64::from(MOST_ORDER)))?;
    Ok(Roots::butterworth(order))
}

fn warped_band(low_hz: f64, high_hz: f64, rate_hz: f64) -> Result<(f64, f64), SignalError> {
    let (low, high) = (warped(low_hz, rate_hz)?, warped(high_hz, rate_hz)?);
    let band = ((low * high).sqrt(), high - low);
    if low < high { Ok(band) } else { Err(SignalError::Band { low_hz, high_hz }) }
}

/// The analog frequency that the bilinear transform at 2 samples a second maps to `frequency_hz`.
fn warped(frequency_hz: f64, rate_hz: f64) -> Result<f64, SignalError> {
    let rate_hz = checked_rate_hz(rate_hz)?;
    let fraction = 2.0 * checked_frequency(frequency_hz, rate_hz)? / rate_hz;
    Ok(4.0 * (PI * fraction / 2.0).tan())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::filter::Section;

    #[test]
    fn half_of_the_power_passes_at_the_corner() {
        let band = band_pass(4, 5.0, 15.0, 250.0).unwrap();
        for corner_hz in [5.0, 15.0] {
            assert!((band.gain(corner_hz) - 0.5f64.sqrt()).abs() < 1e-12);
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert!(matches!(low_pass(0, 1.0, 10.0), Err(SignalError::Setting { .. })));
        assert!(matches!(low_pass(2, 5.0, 10.0), Err(SignalError::Frequency { .. })));
        assert!(matches!(low_pass(2, 5.0, 0.0), Err(SignalError::Rate { .. })));
        assert!(matches!(band_pass(2, 3.0, 2.0, 10.0), Err(SignalError::Band { .. })));
        assert_eq!(high_pass(2, 1e-9, 1e9), Err(SignalError::Unstable));
    }

    proptest! {
        #[test]
        fn a_design_is_stable_or_an_error(
            order in 0..40u32,
            low_hz in prop::num::f64::ANY,
            high_hz in prop::num::f64::ANY,
            rate_hz in prop::num::f64::ANY,
        ) {
            for design in [
                low_pass(order, low_hz, rate_hz),
                high_pass(order, low_hz, rate_hz),
                band_pass(order, low_hz, high_hz, rate_hz),
                band_stop(order, low_hz, high_hz, rate_hz),
            ] {
                prop_assert!(design.is_err() || design.unwrap().sections().iter().all(Section::is_stable));
            }
        }

        #[test]
        fn usual_designs_exist(order in 1..=6u32, low in 0.01..0.4f64, width in 0.01..0.09f64) {
            let high = low + width;
            prop_assert!(low_pass(order, low, 1.0).is_ok());
            prop_assert!(high_pass(order, low, 1.0).is_ok());
            let band = band_pass(order, low, high, 1.0).unwrap();
            prop_assert!((band.gain(low) - 0.5f64.sqrt()).abs() < 1e-6);
            let stop = band_stop(order, low, high, 1.0).unwrap();
            prop_assert!((stop.gain(high) - 0.5f64.sqrt()).abs() < 1e-6);
        }
    }
}
