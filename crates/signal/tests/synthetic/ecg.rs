//! Made-up ECGs.

/// P, Q, R, S and T of a beat: time [s] from R, height [mV], width [s].
const WAVES: [(f64, f64, f64); 5] = [
    (-0.16, 0.12, 0.025),
    (-0.03, -0.12, 0.008),
    (0.0, 1.0, 0.01),
    (0.03, -0.25, 0.01),
    (0.25, 0.3, 0.05),
];

/// When beats come [s]: about 73 a minute, not evenly.
pub fn beat_secs(count: u32) -> Vec<f64> {
    (0..count).map(|k| 0.6 + 0.82 * f64::from(k) + 0.04 * (0.7 * f64::from(k)).sin()).collect()
}

pub fn ecg(beats: &[f64], length_secs: f64, rate_hz: f64) -> Vec<f64> {
    let sample = |k: usize| {
        let secs = k as f64 / rate_hz;
        let near = beats.iter().filter(|&&beat| (secs - beat).abs() < 1.0);
        let wave = |beat: &f64| {
            let at = |(offset, height, width): (f64, f64, f64)| {
                height * (-((secs - beat - offset) / width).powi(2) / 2.0).exp()
            };
            WAVES.map(at).iter().sum::<f64>()
        };
        near.map(wave).sum::<f64>() + 0.2 * (secs * 1.3).sin()
    };
    (0..(length_secs * rate_hz) as usize).map(sample).collect()
}
