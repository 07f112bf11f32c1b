//! Spectra and splines against SciPy and astropy.
#![expect(clippy::unwrap_used, reason = "a test")]

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/spectra.rs"]
mod golden;

use teampulse_signal::cubic::{CubicSpline, Ends};
use teampulse_signal::spectrum::{
    Average, Detrend, LombScargle, Mean, Normalisation, Rule, Scaling, Taper, Welch,
};

const FREQUENCIES_HZ: [f64; 7] = [0.013, 0.05, 0.1, 0.15, 0.25, 0.4, 0.5];

/// The script's signal.
fn signal() -> Vec<f64> {
    (0..1000u32).map(|k| f64::from(k * 7919 % 1000) / 500.0 - 1.0 + f64::from(k) / 100.0).collect()
}

/// The script's uneven series.
fn series() -> (Vec<f64>, Vec<f64>) {
    let time = |n: u32| f64::from(n) + f64::from(n * 7919 % 100) / 150.0;
    (0..60).map(|n| (time(n), f64::from(n * 4547 % 97) / 10.0)).unzip()
}

fn assert_all_close(ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len());
    let greatest = theirs.iter().fold(0.0f64, |most, each| most.max(each.abs()));
    for (ours, theirs) in ours.iter().zip(theirs) {
        assert!((ours - theirs).abs() <= tolerance * greatest, "{ours} {theirs}");
    }
}

fn every_tenth(welch: &Welch) -> Vec<f64> {
    welch.of(&signal()).unwrap().power.into_iter().step_by(10).collect()
}

#[test]
fn welch_gives_scipys_density_with_its_defaults() {
    assert_all_close(&every_tenth(&Welch::new(250.0, 256)), golden::DEFAULTS, 1e-12);
}

#[test]
fn welch_gives_scipys_density_with_its_options() {
    let options = Welch {
        overlap: Some(150),
        transform: Some(333),
        taper: Taper::Hamming,
        detrend: Detrend::Linear,
        ..Welch::new(250.0, 200)
    };
    assert_all_close(&every_tenth(&options), golden::OPTIONS, 1e-12);
    let median = Welch {
        scaling: Scaling::Power,
        average: Average::Median,
        taper: Taper::Blackman,
        detrend: Detrend::Nothing,
        ..Welch::new(250.0, 128)
    };
    assert_all_close(&every_tenth(&median), golden::MEDIAN, 1e-12);
    let whole = Welch { taper: Taper::Rectangular, ..Welch::new(250.0, 2000) };
    assert_all_close(&every_tenth(&whole), golden::WHOLE, 1e-12);
}

#[test]
fn band_power_is_scipys_integral() {
    let spectrum = Welch::new(250.0, 256).of(&signal()).unwrap();
    let both = |low_hz: f64, high_hz: f64| {
        [Rule::Trapezoid, Rule::Simpson]
            .map(|rule| spectrum.band_power(low_hz, high_hz, rule).unwrap())
    };
    assert_all_close(&both(8.0, 13.0), golden::ODD, 1e-12);
    assert_all_close(&both(8.0, 14.0), golden::EVEN, 1e-12);
}

#[test]
fn lomb_scargle_is_scipys_and_astropys() {
    let (times, values) = series();
    let power = |mean: Mean, normalisation: Normalisation| {
        let settings = LombScargle { mean, normalisation };
        settings.of(&times, &values, &FREQUENCIES_HZ).unwrap().power
    };
    assert_all_close(&power(Mean::Zero, Normalisation::Power), golden::LOMB, 1e-10);
    let centred = power(Mean::Subtracted, Normalisation::Standard);
    assert_all_close(&centred, golden::LOMB_CENTRED, 1e-10);
    let floating = power(Mean::Floating, Normalisation::Power);
    assert_all_close(&floating, golden::LOMB_FLOATING, 1e-10);
    assert_all_close(&power(Mean::Floating, Normalisation::Standard), golden::ASTROPY, 1e-10);
}

#[test]
fn splines_are_scipys() {
    let (times, values) = series();
    for (ends, theirs) in [(Ends::NotAKnot, golden::NOT_A_KNOT), (Ends::Natural, golden::NATURAL)] {
        let spline = CubicSpline::new(&times, &values, ends).unwrap();
        let ours = spline.resampled(0.0, 0.25).unwrap();
        assert_all_close(&ours[..theirs.len()], theirs, 1e-12);
    }
}

#[test]
fn splines_of_few_points_are_scipys() {
    let (times, values) = series();
    for (count, ends, theirs) in [
        (4, Ends::NotAKnot, golden::FOUR_NOT_A_KNOT),
        (4, Ends::Natural, golden::FOUR_NATURAL),
        (3, Ends::NotAKnot, golden::THREE_NOT_A_KNOT),
        (3, Ends::Natural, golden::THREE_NATURAL),
        (2, Ends::NotAKnot, golden::TWO_NOT_A_KNOT),
        (2, Ends::Natural, golden::TWO_NATURAL),
    ] {
        let spline = CubicSpline::new(&times[..count], &values[..count], ends).unwrap();
        let span = times[count - 1] - times[0];
        let ours = [0.3, 0.9].map(|share| spline.at(times[0] + span * share).unwrap());
        assert_all_close(&ours, theirs, 1e-12);
    }
}
