//! A lead filter that separates responses superimposed on the recovery of others.

/// The recovery time constant that the filter compensates [s]: few responses recover faster, and those would reappear
/// as rises.
const FALL_SECS: f64 = 1.5;
/// The time constant that remains after the filter [s].
const REMAINING_SECS: f64 = 0.5;
/// The prominence required in the sharpened signal, relative to the threshold of the amplitude.
pub(super) const SHARPER: f64 = 1.2;
/// The longest delay of a response's peak after its sharpened peak [s]; what still rises then is drift.
pub(super) const LATER_SECS: f64 = 1.5;
const GAIN: f64 = FALL_SECS / REMAINING_SECS;

/// A lead filter, (1 + 1.5 s·p) / (1 + 0.5 s·p), with gain 1 at low and 3 at high frequencies.
///
/// A response with a rise of one second keeps about its height, peaks half a second earlier, and has decayed
/// within a second and a half.
#[derive(Clone, Debug)]
pub(super) struct Sharpener {
    kept: f64,
    slow: Option<f64>,
}

impl Sharpener {
    pub(super) fn new(rate_hz: f64) -> Sharpener {
        Sharpener { kept: (-1.0 / (REMAINING_SECS * rate_hz)).exp(), slow: None }
    }

    /// Takes in the next value; the first one also counts as the previous level.
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
