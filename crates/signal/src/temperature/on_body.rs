//! Whether a thermometer is on the body.

use crate::error::{SignalError, checked};
use crate::gaps::is_usable;

/// The settling time of the sensor after a jump [s].
const SETTLING_SECS: f64 = 5.0;

/// The plausible range of skin temperature and of its change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The coldest skin [°C].
    pub least_c: f64,
    /// The warmest skin [°C].
    pub most_c: f64,
    /// The fastest change [°C/s]; samples less than a second apart may differ by as much as in a second.
    pub most_change_c_per_sec: f64,
}

impl Default for Limits {
    /// 20 to 42 °C: from a hand in a cool room to fever; 0.5 °C/s, which a sensor on skin does not reach.
    /// All three are conventions.
    fn default() -> Limits {
        Limits { least_c: 20.0, most_c: 42.0, most_change_c_per_sec: 0.5 }
    }
}

/// Judges readings one by one: on the body are those within the [`Limits`] and not within 5 s after a jump.
///
/// A band that lies on a table in a warm room may be mistaken for worn.
#[derive(Clone, Debug)]
pub struct OnBody {
    limits: Limits,
    last: Option<(i64, f64)>,
    settled_ns: i64,
}

impl OnBody {
    /// Returns an error when the limits are not finite, or in the wrong order.
    pub fn new(limits: Limits) -> Result<OnBody, SignalError> {
        let least_c = checked("coldest skin [°C]", limits.least_c, (-273.15, 1000.0))?;
        checked("warmest skin [°C]", limits.most_c, (least_c, 1000.0))?;
        checked("change of skin [°C/s]", limits.most_change_c_per_sec, (0.0, f64::MAX))?;
        Ok(OnBody { limits, last: None, settled_ns: i64::MIN })
    }

    /// Takes in the next reading [°C] with its time [ns]; returns whether it is on the body.
    pub fn push(&mut self, at_ns: i64, reading_c: f64) -> bool {
        if !is_usable(reading_c) {
            return false;
        }
        if let Some((last_ns, last_c)) = self.last.replace((at_ns, reading_c)) {
            let secs = at_ns.saturating_sub(last_ns) as f64 / 1e9;
            let most_c = self.limits.most_change_c_per_sec * secs.max(1.0);
            if (reading_c - last_c).abs() > most_c {
                self.settled_ns = at_ns.saturating_add((SETTLING_SECS * 1e9) as i64);
            }
        }
        let is_skin = (self.limits.least_c..=self.limits.most_c).contains(&reading_c);
        is_skin && at_ns >= self.settled_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(readings_c: &[f64]) -> Vec<bool> {
        let mut on_body = OnBody::new(Limits::default()).unwrap();
        let seconds = (0i64..).map(|k| k * 1_000_000_000);
        seconds.zip(readings_c).map(|(at_ns, &reading_c)| on_body.push(at_ns, reading_c)).collect()
    }

    #[test]
    fn a_jump_is_let_settle() {
        let mut readings_c = [33.0; 12];
        readings_c[4..].fill(34.0);
        let worn = judged(&readings_c);
        assert!(worn[..4].iter().all(|&worn| worn) && !worn[4] && !worn[8] && worn[9]);
    }

    #[test]
    fn a_slow_change_is_none() {
        let readings_c: Vec<f64> = (0..30).map(|k| 30.0 + 0.1 * f64::from(k)).collect();
        assert!(judged(&readings_c).iter().all(|&worn| worn));
    }

    #[test]
    fn what_is_no_skin_is_not_worn() {
        assert_eq!(judged(&[19.0, 43.0, f64::NAN, f64::INFINITY]), [false; 4]);
    }

    #[test]
    fn limits_in_the_wrong_order_are_refused() {
        for (least_c, most_c) in [(42.0, 20.0), (f64::NAN, 42.0), (20.0, f64::NAN)] {
            assert!(OnBody::new(Limits { least_c, most_c, ..Limits::default() }).is_err());
        }
    }
}
