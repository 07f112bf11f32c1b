//! Spectral tilt.

/// The frequency range of the tilt [Hz].
const BAND_HZ: (f64, f64) = (100.0, 5_000.0);
/// The number of bands per octave.
const AN_OCTAVE: f64 = 3.0;

/// The slope of the line through the third-octave levels of a spectrum [dB/octave], from 100 Hz to 5 kHz or
/// 90 % of the Nyquist frequency; NaN for silence.
///
/// The `powers` are `step_hz` [Hz] apart, from 0.
pub(super) fn tilt(powers: &[f64], step_hz: f64) -> f64 {
    let top_hz = BAND_HZ.1.min(0.9 * step_hz * (powers.len() - 1) as f64);
    let width = 2f64.powf(1.0 / AN_OCTAVE);
    let (mut low_hz, mut count) = (BAND_HZ.0, 0.0);
    let [mut x, mut y, mut xx, mut xy] = [0.0; 4];
    while low_hz * width <= top_hz {
        let bins = (low_hz / step_hz).ceil() as usize..(low_hz * width / step_hz).ceil() as usize;
        let sum: f64 = powers[bins.clone()].iter().sum();
        let density = sum / bins.len().max(1) as f64;
        if density > 0.0 {
            let (octave, level_db) = ((low_hz / BAND_HZ.0).log2(), 10.0 * density.log10());
            (x, y, count) = (x + octave, y + level_db, count + 1.0);
            (xx, xy) = (xx + octave * octave, xy + octave * level_db);
        }
        low_hz *= width;
    }
    if count < AN_OCTAVE { f64::NAN } else { (count * xy - x * y) / (count * xx - x * x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spectrum_that_falls_by_twelve_db_an_octave_has_that_tilt() {
        let powers: Vec<f64> = (0..1025).map(|k| f64::from(k.max(1)).powi(-4)).collect();
        assert!((tilt(&powers, 7.8) + 12.04).abs() < 0.1, "{}", tilt(&powers, 7.8));
        assert!(tilt(&vec![1.0; 1025], 7.8).abs() < 1e-9);
        assert!(tilt(&vec![0.0; 1025], 7.8).is_nan());
    }
}
