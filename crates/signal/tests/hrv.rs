//! Heart rate variability against plain formulas and NeuroKit2 0.2.13; the golden values are printed by
//! `golden/hrv.py`. All agree to a relative 1e-9.
#![expect(clippy::unreadable_literal, reason = "values as printed")]

#[path = "synthetic/intervals.rs"]
mod synthetic;

use proptest::prelude::*;
use synthetic::intervals_ms;
use teampulse_signal::hrv::*;

#[track_caller]
fn same(ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len());
    for (ours, theirs) in ours.iter().zip(theirs) {
        assert!((ours - theirs).abs() <= 1e-9 * theirs.abs(), "{ours} is not {theirs}");
    }
}

/// The features of a name each.
fn named(measures: &[Measure], names: &[&str]) -> Vec<f64> {
    let value =
        |name: &&str| measures.iter().find(|each| each.name == *name).map(|each| each.value);
    names.iter().filter_map(value).collect()
}

#[test]
fn the_time_domain_is_the_textbooks() {
    let rr = intervals_ms(350);
    assert!((rr.iter().sum::<f64>() - 297851.0).abs() < 0.5, "not the series of the golden values");
    let names = [
        "HRV_MeanNN",
        "HRV_MedianNN",
        "HRV_SDNN",
        "HRV_RMSSD",
        "HRV_SDSD",
        "HRV_NN50",
        "HRV_pNN50",
        "HRV_pNN20",
        "HRV_MeanHR",
        "HRV_StdHR",
    ];
    let golden = [
        851.0028571428571,
        851.0,
        36.83950310397814,
        28.512049430911073,
        28.552943963186326,
        25.0,
        7.163323782234957,
        51.57593123209169,
        70.63755933243591,
        3.073859100970741,
    ];
    let features = time_domain(&rr).unwrap();
    same(&named(&features.measures(), &names), &golden);
    same(&[features.hr_of_mean_nn_bpm], &[70.50505118330977]);
}

#[test]
fn the_rest_of_the_time_domain_is_neurokits() {
    let names = [
        "HRV_CVNN",
        "HRV_CVSD",
        "HRV_SDRMSSD",
        "HRV_MadNN",
        "HRV_MCVNN",
        "HRV_IQRNN",
        "HRV_Prc20NN",
        "HRV_Prc80NN",
        "HRV_MinNN",
        "HRV_MaxNN",
    ];
    let golden = [
        0.04328951753189463,
        0.03350405840779073,
        1.2920678744348322,
        38.547599999999996,
        0.04529682726204465,
        51.75,
        818.8,
        886.0,
        760.0,
        940.0,
    ];
    same(&named(&time_domain(&intervals_ms(350)).unwrap().measures(), &names), &golden);
}

#[test]
fn nothing_is_computed_across_a_missing_interval() {
    let mut rr = intervals_ms(350);
    for missing in [50, 51, 200] {
        rr[missing] = f64::NAN;
    }
    let features = time_domain(&rr).unwrap();
    let ours = [features.mean_nn_ms, features.sdnn_ms, features.rmssd_ms, features.sdsd_ms];
    same(&ours, &[851.2247838616714, 36.892221827694044, 28.40114434314223, 28.441537773476007]);
}

#[test]
fn the_poincare_ellipse_is_brennans() {
    let ellipse = poincare(&intervals_ms(350)).unwrap();
    same(&[ellipse.sd1_ms, ellipse.sd2_ms], &[20.189980299208546, 48.02772817252135]);
}

#[test]
fn the_triangular_index_is_neurokits() {
    same(&[geometric(&intervals_ms(350)).unwrap().triangular_index], &[9.45945945945946]);
}

#[test]
fn a_histogram_that_is_a_triangle_has_its_base() {
    // Bins of 1, 2, 3, 4, 3, 2, 1 intervals: the triangle comes down four bins from its peak.
    let bins = [1, 2, 3, 4, 3, 2, 1].into_iter().enumerate();
    let interval = |bin: usize| (100.5 + bin as f64) * BIN_MS;
    let rr: Vec<f64> = bins.flat_map(|(bin, count)| vec![interval(bin); count]).collect();
    same(&[geometric(&rr).unwrap().tinn_ms], &[8.0 * BIN_MS]);
}

#[test]
fn entropies_are_neurokits() {
    let features = entropies(&intervals_ms(350)).unwrap();
    same(&[features.approximate, features.sample], &[1.2073636367936036, 1.771293638635764]);
    same(&[features.fuzzy, features.multiscale], &[1.2951612331072622, 1.0408110246078826]);
}

#[test]
fn fluctuation_exponents_are_neurokits_at_the_same_scales() {
    let rr = intervals_ms(350);
    let exponents = detrended_fluctuation(&rr).unwrap();
    same(&[exponents.alpha1, exponents.alpha2], &[1.1990252565156538, 0.8616134087730568]);
    same(&[dfa_alpha(&rr, &(4..=11)).unwrap()], &[1.4101281786964734]);
}

#[test]
fn asymmetry_and_fragmentation_are_neurokits() {
    let names = ["HRV_GI", "HRV_SI", "HRV_AI", "HRV_PI", "HRV_C1d", "HRV_C2d", "HRV_Cd", "HRV_Ca"];
    let golden = [
        49.89637937339998,
        49.89298730034826,
        49.89987813629193,
        51.162790697674424,
        0.5060042648432406,
        0.505336105738858,
        0.5054363164324004,
        0.4945636835675999,
    ];
    same(&named(&asymmetry(&intervals_ms(350)).unwrap().measures(), &names), &golden);
    let names = ["HRV_PIP", "HRV_IALS", "HRV_PSS", "HRV_PAS"];
    let golden = [0.5314285714285715, 0.5290697674418605, 0.7527472527472527, 0.12195121951219512];
    same(&named(&fragmentation(&intervals_ms(350)).unwrap().measures(), &names), &golden);
}

/// The intervals, and when each ends [s].
fn timed(count: u32) -> (Vec<f64>, Vec<f64>) {
    let rr = intervals_ms(count);
    let mut end_ms = 0.0;
    let end = |interval: &f64| {
        end_ms += interval;
        end_ms / 1000.0
    };
    (rr.iter().map(end).collect(), rr)
}

#[test]
fn band_powers_are_scipys_with_the_same_recipe() {
    let (ends, rr) = timed(350);
    let welch = |segment_secs| Recipe::Welch { rate_hz: 4.0, segment_secs };
    let golden = [
        (Recipe::default(), [788.8791293068568, 127.84054182742483]),
        (welch(64.0), [804.3014573416946, 122.13653907769947]),
        (
            Recipe::Autoregressive { rate_hz: 4.0, order: 16 },
            [944.8498005014011, 147.74990135974298],
        ),
        (Recipe::LombScargle, [805.8675303810219, 132.77060862182955]),
    ];
    for (recipe, [lf, hf]) in golden {
        let features = frequency_domain(&ends, &rr, &recipe).unwrap();
        same(&[features.lf_ms2, features.hf_ms2, features.lf_hf()], &[lf, hf, lf / hf]);
        // 298 s are too short for the slowest waves.
        assert!(features.vlf_ms2.is_nan() && features.span_secs < 300.0);
    }
    let (ends, rr) = timed(400);
    assert!(frequency_domain(&ends, &rr, &Recipe::default()).unwrap().vlf_ms2 > 0.0);
}

#[test]
fn segments_are_the_textbooks() {
    let (ends, rr) = timed(350);
    let of = |secs| segments(&ends, &rr, secs).map(|each| [each.sdann_ms, each.sdnni_ms]).unwrap();
    same(&of(60.0), &[1.534308408974723, 36.985571176618784]);
    same(&of(120.0), &[0.12036465530864728, 36.759517972867386]);
    assert_eq!(segments(&ends, &rr, 300.0), None);
    assert_eq!(segments(&ends, &rr, f64::NAN), None);
}

#[test]
fn a_band_needs_its_time() {
    let (ends, rr) = timed(100);
    let features = frequency_domain(&ends, &rr, &Recipe::default()).unwrap();
    assert!(features.lf_ms2.is_nan() && features.lf_hf().is_nan() && features.hf_ms2 > 0.0);
    let features = frequency_domain(&ends[..60], &rr[..60], &Recipe::default()).unwrap();
    assert!(features.hf_ms2.is_nan());
}

#[test]
fn lomb_and_scargle_bridge_a_gap() {
    let (mut ends, mut rr) = timed(400);
    let whole = frequency_domain(&ends, &rr, &Recipe::LombScargle).unwrap();
    ends.drain(150..170);
    rr.drain(150..170);
    let gapped = frequency_domain(&ends, &rr, &Recipe::LombScargle).unwrap();
    assert!((gapped.lf_hf() / whole.lf_hf() - 1.0).abs() < 0.15, "{gapped:?} {whole:?}");
}

#[test]
fn equal_intervals_have_no_variability() {
    let features = time_domain(&[800.0; 60]).unwrap();
    same(&[features.mean_hr_bpm], &[75.0]);
    assert!(features.sdnn_ms <= 0.0 && features.rmssd_ms <= 0.0);
    assert_eq!(entropies(&[800.0; 60]), None);
    assert_eq!(detrended_fluctuation(&[800.0; 60]), None);
    assert_eq!(asymmetry(&[800.0; 60]), None);
    assert_eq!(fragmentation(&[800.0; 60]), None);
}

#[test]
fn no_intervals_have_no_features() {
    assert_eq!(time_domain(&[]), None);
    assert_eq!(time_domain(&[f64::NAN, f64::INFINITY]), None);
    assert_eq!(geometric(&[]), None);
    assert_eq!(poincare(&[800.0, 810.0]), None);
    assert_eq!(entropies(&[]), None);
    assert_eq!(detrended_fluctuation(&[]), None);
}

/// Sample entropy by comparing every two triples.
fn sample_entropy_by_force(nn: &[f64], tolerance: f64) -> Option<f64> {
    let alike = |a: usize, b: usize, length: usize| {
        (0..length).all(|k| (nn[a + k] - nn[b + k]).abs() <= tolerance)
    };
    let pairs = (0..nn.len() - 2).flat_map(|a| (a + 1..nn.len() - 2).map(move |b| (a, b)));
    let count = |length| pairs.clone().filter(|&(a, b)| alike(a, b, length)).count() as f64;
    let (two, three) = (count(2), count(3));
    (three > 0.0).then(|| (two / three).ln())
}

proptest! {
    #[test]
    fn sample_entropy_compares_every_two(
        nn in prop::collection::vec((600u32..1000).prop_map(f64::from), 4..80),
        tolerance in 1.0..100.0,
    ) {
        prop_assert_eq!(sample_entropy(&nn, tolerance), sample_entropy_by_force(&nn, tolerance));
    }

    #[test]
    fn nothing_panics_and_shares_are_shares(
        rr in prop::collection::vec(
            prop_oneof![prop::num::f64::ANY, 300.0..2000.0, Just(800.0), Just(1e308), Just(-1e308)],
            0..120,
        ),
    ) {
        if let Some(features) = time_domain(&rr) {
            prop_assert!(features.n > 0 && features.nn50 < features.n);
        }
        if let Some(fragments) = fragmentation(&rr) {
            prop_assert!((0.0..=1.0).contains(&fragments.short_runs));
        }
        if let Some(exponents) = detrended_fluctuation(&rr) {
            prop_assert!(exponents.alpha1.is_finite());
        }
        let ends: Vec<f64> = (0..rr.len()).map(|k| k as f64).collect();
        let burg = Recipe::Autoregressive { rate_hz: 4.0, order: 16 };
        for recipe in [Recipe::default(), burg, Recipe::LombScargle] {
            for (ends, rr) in [(&ends, &rr), (&rr, &ends)] {
                frequency_domain(ends, rr, &recipe).ok();
            }
        }
        geometric(&rr);
        poincare(&rr);
        asymmetry(&rr);
        entropies(&rr);
    }
}
