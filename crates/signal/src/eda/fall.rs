//! Extrapolates the recovery of an earlier response.

/// The assumed recovery time constant [s]. Few real ones are shorter. If the real one is longer, the amplitude of the
/// next response comes out slightly too small; if this value were too long, there would be false responses.
const FALL_SECS: f64 = 1.5;
/// The time before an onset over which the slope of the recovery is taken [s].
const SLOPE_SECS: f64 = 0.75;
/// A slope below this share of the threshold is noise.
const SHALLOW: f64 = 0.25;

/// The level that the signal would have without the response: constant, or an exponential decay with the slope before
/// the onset of the response.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fall {
    level_us: f64,
    depth_us: f64,
    rate_hz: f64,
}

impl Fall {
    /// The recovery at the end of a signal, where a response begins.
    pub(super) fn before(phasic: &[f64], rate_hz: f64, threshold_us: f64) -> Fall {
        let count = (SLOPE_SECS * rate_hz).round().max(1.0) as usize + 1;
        let newest = &phasic[phasic.len().saturating_sub(count)..];
        // The fitted slope applies at the centre of the stretch; the decay is less steep at its end.
        let half_secs = newest.len().saturating_sub(1) as f64 / 2.0 / rate_hz;
        let depth_us = slope(newest) * rate_hz * FALL_SECS * (-half_secs / FALL_SECS).exp();
        let depth_us = if depth_us < -SHALLOW * threshold_us { depth_us } else { 0.0 };
        Fall { level_us: newest.last().copied().unwrap_or(0.0), depth_us, rate_hz }
    }

    /// The level after a number of samples.
    pub(super) fn level_us(&self, samples: usize) -> f64 {
        let secs = samples as f64 / self.rate_hz;
        self.level_us + self.depth_us * (1.0 - (-secs / FALL_SECS).exp())
    }

    /// The index of the maximum of the signal above the extrapolated decay, and its height [µS].
    pub(super) fn highest(&self, phasic: &[f64]) -> (usize, f64) {
        let above = |(samples, value): (usize, &f64)| (samples, value - self.level_us(samples));
        let all = phasic.iter().enumerate().map(above);
        all.reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap_or((0, 0.0))
    }
}

/// The least-squares slope [per sample]; 0 with fewer than two values.
fn slope(values: &[f64]) -> f64 {
    let middle = (values.len() as f64 - 1.0) / 2.0;
    let terms = values.iter().enumerate().map(|(place, value)| {
        let at = place as f64 - middle;
        (at * value, at * at)
    });
    let (products, squares) = terms.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1));
    if squares > 0.0 { products / squares } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_in_a_fall_has_its_own_height() {
        let fall = |k: i32| (-f64::from(k) / 32.0 / 2.0).exp();
        let rise = |k: i32| 0.2 * (1.0 - (-f64::from((k - 40).max(0)) / 20.0).exp());
        let signal: Vec<f64> = (0..80).map(|k| fall(k) + rise(k)).collect();
        let (samples, amplitude_us) =
            Fall::before(&signal[..=40], 32.0, 0.05).highest(&signal[40..]);
        assert!((0.12..0.2).contains(&amplitude_us) && samples > 20, "{samples}: {amplitude_us}");
        let alone: Vec<f64> = (0..80).map(rise).collect();
        let (_, amplitude_us) = Fall::before(&alone[..=40], 32.0, 0.05).highest(&alone[40..]);
        assert!((amplitude_us - alone[79]).abs() < 1e-12);
    }
}
