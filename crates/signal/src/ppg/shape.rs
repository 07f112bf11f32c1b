//! The shape of a pulse wave.

use super::pulse::Pulse;

/// The search range of the peak around the maximum of the band-passed signal [s].
const SEARCH_SECS: f64 = 0.12;
/// The distance of the outer points of the parabola that interpolates the peak [s].
const PARABOLA_SECS: f64 = 0.015;
/// The shortest rise before a peak at the start of a signal [s].
pub(super) const SHORTEST_RISE_SECS: f64 = 0.05;
/// The longest rise [s].
const LONGEST_RISE_SECS: f64 = 0.5;
/// The tolerated ripple on the way down to the onset, as a share of the fall.
const WIGGLE: f64 = 0.03;
/// The longest fall to half of the height [s].
pub(super) const LONGEST_FALL_SECS: f64 = 1.0;

/// A smoothed signal with pulse waves.
pub(super) struct Wave<'a> {
    pub(super) smoothed: &'a [f64],
    pub(super) rate_hz: f64,
}

impl Wave<'_> {
    /// Measures the pulse at the maximum of the band-passed signal around an index, not extending back beyond `floor`;
    /// `None` outside the signal.
    pub(super) fn pulse_near(&self, place: usize, floor: usize) -> Option<Pulse> {
        let reach = self.samples(SEARCH_SECS);
        let begin = place.saturating_sub(reach).max(floor).max(1);
        let end = (place + reach + 1).min(self.smoothed.len().checked_sub(1)?);
        let maxima = (begin..end).filter(|&place| self.is_maximum(place));
        let highest = maxima.reduce(|a, b| if self.smoothed[b] > self.smoothed[a] { b } else { a });
        self.pulse_at(highest.unwrap_or(place), floor)
    }

    /// Measures the pulse with its peak within half a sample of a position.
    pub(super) fn pulse_at(&self, peak: usize, floor: usize) -> Option<Pulse> {
        let (sample, top) = self.vertex(peak)?;
        let (foot, bottom) = self.foot(peak, floor);
        // Between samples, the peak of a very narrow wave may come before the foot of its rise.
        let onset = self.tangent(foot, peak, bottom).min(sample);
        let amplitude = top - bottom;
        let half = bottom + amplitude / 2.0;
        let up = self.crossing(half, (foot..peak).rev(), 1);
        let last = (peak + self.samples(LONGEST_FALL_SECS)).min(self.smoothed.len() - 1);
        let down = self.crossing(half, (peak + 1)..=last, -1);
        let millis = 1e3 / self.rate_hz;
        let rise_ms = (sample - onset) * millis;
        let middle = if up.is_finite() { up.min(sample) } else { sample };
        Some(Pulse { sample, onset, middle, amplitude, rise_ms, width_ms: (down - up) * millis })
    }

    fn samples(&self, secs: f64) -> usize {
        (secs * self.rate_hz).round().max(1.0) as usize
    }

    fn is_maximum(&self, place: usize) -> bool {
        let [left, middle, right] = [place - 1, place, place + 1].map(|place| self.smoothed[place]);
        middle > left && middle >= right
    }

    /// The position and height of the vertex of the parabola through a peak.
    fn vertex(&self, peak: usize) -> Option<(f64, f64)> {
        let middle = *self.smoothed.get(peak)?;
        let step = self.samples(PARABOLA_SECS);
        let beside = |place: Option<usize>| self.smoothed.get(place?).copied();
        let sides = (beside(peak.checked_sub(step)), beside(Some(peak + step)));
        let (Some(left), Some(right)) = sides else { return Some((peak as f64, middle)) };
        let (bend, tilt) = (left - 2.0 * middle + right, left - right);
        let shift = 0.5 * tilt / bend;
        let fits = bend < 0.0 && shift.abs() <= 0.5;
        let vertex = (peak as f64 + shift * step as f64, middle - tilt * tilt / (8.0 * bend));
        Some(if fits { vertex } else { (peak as f64, middle) })
    }

    /// The index and value of the minimum before the rise to a peak.
    fn foot(&self, peak: usize, floor: usize) -> (usize, f64) {
        let begin = peak.saturating_sub(self.samples(LONGEST_RISE_SECS)).max(floor).min(peak);
        let before = &self.smoothed[begin..=peak];
        let lowest = before.iter().copied().fold(f64::INFINITY, f64::min);
        let wiggle = WIGGLE * (self.smoothed[peak] - lowest);
        let mut foot = peak;
        for place in (begin..peak).rev() {
            if self.smoothed[place] < self.smoothed[foot] {
                foot = place;
            } else if self.smoothed[place] > self.smoothed[foot] + wiggle {
                break;
            }
        }
        (foot, self.smoothed[foot])
    }

    /// The intersection of the steepest tangent with the level of the foot.
    fn tangent(&self, foot: usize, peak: usize, bottom: f64) -> f64 {
        let slope = |place: &usize| self.smoothed[place + 1] - self.smoothed[*place];
        let steepest = (foot..peak).reduce(|a, b| if slope(&b) > slope(&a) { b } else { a });
        let Some(steepest) = steepest.filter(|place| slope(place) > 0.0) else {
            return foot as f64;
        };
        let middle = self.smoothed[steepest].midpoint(self.smoothed[steepest + 1]);
        (steepest as f64 + 0.5 - (middle - bottom) / slope(&steepest)).max(foot as f64)
    }

    /// The first position at which the signal falls below a level; NaN if it does not.
    fn crossing(&self, level: f64, mut along: impl Iterator<Item = usize>, back: i64) -> f64 {
        let Some(below) = along.find(|&place| self.smoothed[place] < level) else {
            return f64::NAN;
        };
        let above = (below as i64 + back) as usize;
        let share = (level - self.smoothed[below]) / (self.smoothed[above] - self.smoothed[below]);
        below as f64 + back as f64 * share.clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_its_own_shape() {
        // Up from 0 at 10 to 20 at 20.3, down to 0 at 40.
        let height = |k: usize| {
            let at = k as f64;
            (20.0 * (at - 10.0) / 10.3).min(20.0 * (40.0 - at) / 19.7).max(0.0)
        };
        let smoothed: Vec<f64> = (0..60).map(height).collect();
        let pulse = Wave { smoothed: &smoothed, rate_hz: 100.0 }.pulse_near(18, 0).unwrap();
        assert!((pulse.sample - 20.3).abs() < 0.4, "{pulse:?}");
        assert!((pulse.onset - 10.0).abs() < 0.05, "{pulse:?}");
        assert!((pulse.amplitude - 20.0).abs() < 1.0, "{pulse:?}");
        assert!((pulse.width_ms - 150.0).abs() < 5.0, "{pulse:?}");
    }

    #[test]
    fn the_rise_of_a_needle_beside_another_one_is_not_negative() {
        let smoothed = [0.0, 9.0, 9.0, 0.0, 10.0, 5.0, 2.0, 0.0, 0.0];
        let pulse = Wave { smoothed: &smoothed, rate_hz: 200.0 }.pulse_at(4, 0).unwrap();
        assert!(pulse.sample < 3.0 && pulse.onset <= pulse.sample, "{pulse:?}");
        assert!(pulse.rise_ms >= 0.0, "{pulse:?}");
    }

    #[test]
    fn what_does_not_fall_again_has_no_width() {
        let smoothed: Vec<f64> = (0..30).map(|k| f64::from(k.min(20))).collect();
        let pulse = Wave { smoothed: &smoothed, rate_hz: 100.0 }.pulse_at(20, 0).unwrap();
        assert!(pulse.width_ms.is_nan() && pulse.amplitude > 15.0);
    }
}
