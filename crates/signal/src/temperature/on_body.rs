//! Whether a thermometer is on the body.

use crate::error::{SignalError, checked};
use crate::gaps::is_usable;

/// The settling time of the sensor after a jump [s].
const SETTLING_SECS: f64 = 5.0;
/// A fall by this much [°C] within [`FALL_SECS`] means that the sensor was taken off: skin in cold air loses a degree
/// or two in a minute.
const FALL_C: f64 = 0.5;
/// The time within which a fall by [`FALL_C`] counts [s].
const FALL_SECS: f64 = 10.0;
/// The number of earlier readings used for comparison, spread evenly over that time.
const EARLIER: usize = 10;
/// The share of the fall that must be made up before the sensor counts as worn again.
const BACK: f64 = 0.5;
/// A sensor that stops falling at least this warm is still worn [°C]: hardly any room is as warm.
const WARM_C: f64 = 30.0;
/// A sensor has stopped falling if it falls by no more than this within [`FALL_SECS`] [°C].
const STILL_C: f64 = 0.1;

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

/// Judges readings one by one: a reading is on the body if it is within the [`Limits`], not within 5 s after a jump,
/// and not after a fall by 0.5 °C within 10 s, until half of the fall is made up or it ends above 30 °C.
///
/// A band that lies on a table in a warm room may be mistaken for worn.
#[derive(Clone, Debug)]
pub struct OnBody {
    limits: Limits,
    last: Option<(i64, f64)>,
    settled_ns: i64,
    /// Readings about a second apart, the newest last.
    earlier: [(i64, f64); EARLIER],
    cooling: Option<Cooling>,
}

/// A fall from the body: the reading before it and the lowest since [°C].
#[derive(Clone, Copy, Debug)]
struct Cooling {
    from_c: f64,
    lowest_c: f64,
}

impl OnBody {
    /// Returns an error when the limits are not finite, or in the wrong order.
    pub fn new(limits: Limits) -> Result<OnBody, SignalError> {
        let least_c = checked("coldest skin [°C]", limits.least_c, (-273.15, 1000.0))?;
        checked("warmest skin [°C]", limits.most_c, (least_c, 1000.0))?;
        checked("change of skin [°C/s]", limits.most_change_c_per_sec, (0.0, f64::MAX))?;
        Ok(OnBody {
            limits,
            last: None,
            settled_ns: i64::MIN,
            earlier: [(i64::MIN, f64::NAN); EARLIER],
            cooling: None,
        })
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
        self.cool(at_ns, reading_c);
        let is_skin = (self.limits.least_c..=self.limits.most_c).contains(&reading_c);
        is_skin && at_ns >= self.settled_ns && self.cooling.is_none()
    }

    /// Follows falls that are too fast for skin.
    fn cool(&mut self, at_ns: i64, reading_c: f64) {
        let is_recent =
            |&&(then_ns, _): &&(i64, f64)| at_ns.saturating_sub(then_ns) as f64 <= FALL_SECS * 1e9;
        let recent = self.earlier.iter().filter(is_recent);
        let warmest_c = recent.map(|(_, then_c)| *then_c).fold(f64::NEG_INFINITY, f64::max);
        if let Some(cooling) = &mut self.cooling {
            cooling.lowest_c = cooling.lowest_c.min(reading_c);
            let back_c = cooling.lowest_c + BACK * (cooling.from_c - cooling.lowest_c);
            let is_still = reading_c >= WARM_C && warmest_c - reading_c <= STILL_C;
            if reading_c >= back_c || is_still {
                self.cooling = None;
                self.earlier = [(i64::MIN, f64::NAN); EARLIER];
            }
        } else if warmest_c - reading_c >= FALL_C {
            self.cooling = Some(Cooling { from_c: warmest_c, lowest_c: reading_c });
        }
        let apart_ns = (FALL_SECS / EARLIER as f64 * 1e9) as i64;
        let is_due = at_ns.saturating_sub(self.earlier[EARLIER - 1].0) >= apart_ns;
        // A fall does not begin at the top of a jump.
        if is_due && at_ns >= self.settled_ns {
            self.earlier.rotate_left(1);
            self.earlier[EARLIER - 1] = (at_ns, reading_c);
        }
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
    fn what_cools_faster_than_skin_is_off_until_it_is_half_warm_again() {
        let cooling = |k: i32| 24.0 + 9.0 * (-f64::from(k) / 60.0).exp();
        let warming = |k: i32| 33.0 - 9.0 * (-f64::from(k) / 60.0).exp();
        let readings_c: Vec<f64> = (0..600).map(cooling).chain((0..120).map(warming)).collect();
        let worn = judged(&readings_c);
        assert!(worn[..3].iter().all(|&worn| worn) && !worn[10..600].contains(&true));
        assert!(!worn[610] && worn[680..].iter().all(|&worn| worn));
        let cold_air: Vec<f64> = (0..300).map(|k| 33.0 - 0.03 * f64::from(k)).collect();
        assert!(judged(&cold_air).iter().all(|&worn| worn));
        let mut touched = vec![33.0; 60];
        touched[20] = 36.0;
        touched[40..].fill(32.4);
        let worn = judged(&touched);
        assert!(!worn[21] && worn[26..40].iter().all(|&worn| worn));
        assert!(!worn[45] && worn[55..].iter().all(|&worn| worn));
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
