//! A phasic signal in which responses that ride on the fall of others stand out.

/// Falls of responses are undone down to this time constant [s]: few fall faster, and a fall that is
/// faster than what is undone would come back as a rise.
const FALL_SECS: f64 = 1.5;
/// What remains of a fall has this time constant [s].
const REMAINING_SECS: f64 = 0.5;
/// By how much of the threshold a rise must stand out in it, as amplitudes are judged unsharpened.
pub(super) const SHARPER: f64 = 1.2;
/// A response is highest no later than this after it is highest sharpened [s]; what still creeps upwards
/// then is a level.
pub(super) const LATER_SECS: f64 = 1.5;
const GAIN: f64 = FALL_SECS / REMAINING_SECS;

/// A lead filter, (1 + 1.5 s·p) / (1 + 0.5 s·p), of gain 1 for what is slow and 3 for what is fast.
///
/// A response of one second's rise is about as high in it as in the signal, half a second earlier, and
/// gone within a second and a half.
#[derive(Clone, Debug)]
pub(super) struct Sharpener {
    kept: f64,
    slow: Option<f64>,
}

impl Sharpener {
    pub(super) fn new(rate_hz: f64) -> Sharpener {
        Sharpener { kept: (-1.0 / (REMAINING_SECS * rate_hz)).exp(), slow: None }
    }

    /// Takes in the next value; the first one counts as the level before.
    pub(super) fn push(&mut self, value: f64) -> f64 {
        let slow = self.slow.unwrap_or(value);
        let slow = value + self.kept * (slow - value);
        self.slow = Some(slow);
        slow + GAIN * (value - slow)
    }

    pub(super) fn begin_anew(&mut self) {
        self.slow = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_is_nearly_gone_and_a_level_stays() {
        let mut sharpener = Sharpener::new(32.0);
        let level = (0..100).map(|_| sharpener.push(2.0)).fold(0.0, |_, value| value);
        assert!((level - 2.0).abs() < 1e-12);
        let fall = |k: i32| 2.0 + (-f64::from(k) / 32.0 / FALL_SECS).exp();
        let at: Vec<f64> = (0..96).map(|k| sharpener.push(fall(k))).collect();
        assert!(at[0] > 4.0 && (at[64] - 2.0).abs() < 0.1, "{} {}", at[0], at[64]);
    }
}
