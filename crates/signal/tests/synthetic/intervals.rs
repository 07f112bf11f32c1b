//! Intervals between beats that Python makes alike: see `golden/hrv.py`.

/// Two waves and noise from a linear congruential generator, in whole ms.
pub fn intervals_ms(count: u32) -> Vec<f64> {
    let mut state: u32 = 1;
    let mut interval = |k: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 8) / f64::from(1u32 << 23) - 1.0;
        let waves = 40.0 * (0.55 * f64::from(k)).sin() + 25.0 * (0.09 * f64::from(k)).sin();
        (850.0 + waves + 30.0 * noise).round_ties_even()
    };
    (0..count).map(&mut interval).collect()
}
