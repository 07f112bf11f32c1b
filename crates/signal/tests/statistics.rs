//! Group statistics against SciPy 1.17.1, pingouin 0.7.0 and statsmodels 0.15.0; the golden values are
//! printed by `golden/group_statistics.py`. All agree to a relative 1e-9.
#![expect(
    clippy::float_cmp,
    clippy::type_complexity,
    clippy::unreadable_literal,
    reason = "tests compare exactly where the arithmetic is exact, and values stand as printed"
)]

use Alternative::{Greater, Less, TwoSided};
use WilcoxonMethod::{Auto, Exact, Normal, NormalWithContinuity};
use Zeros::{LeftOut, Ranked};
use proptest::prelude::*;
use teampulse_signal::robust::median;
use teampulse_signal::statistics::*;

const A: [f64; 12] = [66.1, 71.4, 58.9, 80.2, 75.5, 62.3, 69.8, 73.1, 64.4, 77.7, 60.6, 70.9];
const B: [f64; 12] = [68.0, 72.9, 59.3, 83.8, 75.1, 65.2, 72.6, 77.8, 66.4, 80.3, 60.5, 76.4];
const C: [f64; 12] = [70.3, 74.0, 63.1, 84.4, 79.2, 64.7, 74.9, 78.2, 70.1, 85.0, 63.6, 77.0];
const D: [f64; 12] = [72.8, 77.3, 62.2, 89.9, 81.0, 70.6, 75.3, 83.7, 71.9, 84.1, 69.9, 79.5];
const TIED: [f64; 12] = [1.5, -1.5, 0.0, 2.0, 3.0, 3.0, -0.5, 2.0, 4.0, 0.0, 1.0, 5.0];

fn differences() -> Vec<f64> {
    B.iter().zip(A).map(|(b, a)| b - a).collect()
}

fn long() -> Vec<f64> {
    let at = |k: f64| (1.7 * k).sin() * 3.0 + 0.9 + 0.01 * k;
    (0..60).map(|k| (at(f64::from(k)) * 1000.0).round() / 1000.0).collect()
}

/// To the nearest ten, half to even as `numpy.round`.
fn tens(values: [f64; 12]) -> Vec<f64> {
    values.iter().map(|each| (each / 10.0).round_ties_even() * 10.0).collect()
}

#[track_caller]
fn same(ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len());
    for (ours, theirs) in ours.iter().zip(theirs) {
        assert!((ours - theirs).abs() <= 1e-9 * theirs.abs() + 1e-15, "{ours} is not {theirs}");
    }
}

#[test]
fn the_paired_t_test_is_scipys() {
    for (alternative, p) in [
        (TwoSided, 0.0011062573448308724),
        (Less, 0.9994468713275846),
        (Greater, 0.0005531286724154362),
    ] {
        let test = paired_t(&B, &A, alternative).unwrap();
        same(&[test.t, test.p, test.df], &[4.3761015017885505, p, 11.0]);
    }
    let interval = mean_interval(&differences(), 0.95).unwrap();
    same(&[interval.low, interval.high], &[1.1349178360796146, 3.431748830587051]);
    let interval = mean_interval(&differences(), 0.9).unwrap();
    same(&[interval.low, interval.high], &[1.3462884161397346, 3.2203782505269305]);
}

#[test]
fn the_signed_rank_test_is_scipys() {
    let (plain, tied, long) = (differences(), TIED.to_vec(), long());
    let golden = [
        (&plain, TwoSided, LeftOut, Auto, 0.00341796875),
        (&tied, TwoSided, LeftOut, Auto, 0.015625),
        (&tied, TwoSided, Ranked, Auto, 0.01953125),
        (&plain, TwoSided, LeftOut, Normal, 0.006039559048656822),
        (&tied, TwoSided, LeftOut, Normal, 0.018826058670236654),
        (&tied, TwoSided, Ranked, Normal, 0.022230404776220177),
        (&long, TwoSided, LeftOut, Normal, 0.0004099883731940294),
        (&plain, TwoSided, LeftOut, NormalWithContinuity, 0.006801651812875441),
        (&tied, TwoSided, LeftOut, NormalWithContinuity, 0.021567871524888073),
        (&tied, TwoSided, Ranked, NormalWithContinuity, 0.0246408512438213),
        (&long, TwoSided, LeftOut, NormalWithContinuity, 0.0004157346143241448),
        (&plain, Less, LeftOut, Auto, 0.998779296875),
        (&tied, Less, LeftOut, Auto, 0.994140625),
        (&tied, Less, Ranked, Auto, 0.9921875),
        (&plain, Less, LeftOut, Normal, 0.9969802204756716),
        (&tied, Less, LeftOut, Normal, 0.9905869706648817),
        (&tied, Less, Ranked, Normal, 0.98888479761189),
        (&long, Less, LeftOut, Normal, 0.999795005813403),
        (&plain, Less, LeftOut, NormalWithContinuity, 0.9973223682050952),
        (&tied, Less, LeftOut, NormalWithContinuity, 0.9918029506865507),
        (&tied, Less, Ranked, NormalWithContinuity, 0.9899861560766822),
        (&long, Less, LeftOut, NormalWithContinuity, 0.9997978418071136),
        (&plain, Greater, LeftOut, Auto, 0.001708984375),
        (&tied, Greater, LeftOut, Auto, 0.0078125),
        (&tied, Greater, Ranked, Auto, 0.009765625),
        (&plain, Greater, LeftOut, Normal, 0.003019779524328411),
        (&tied, Greater, LeftOut, Normal, 0.009413029335118327),
        (&tied, Greater, Ranked, Normal, 0.011115202388110089),
        (&long, Greater, LeftOut, Normal, 0.0002049941865970147),
        (&plain, Greater, LeftOut, NormalWithContinuity, 0.0034008259064377206),
        (&tied, Greater, LeftOut, NormalWithContinuity, 0.010783935762444036),
        (&tied, Greater, Ranked, NormalWithContinuity, 0.01232042562191065),
        (&long, Greater, LeftOut, NormalWithContinuity, 0.0002078673071620724),
    ];
    for (values, alternative, zeros, method, p) in golden {
        let test = Wilcoxon { alternative, zeros, method };
        same(&[test.differences(values).unwrap().p], &[p]);
    }
    let test = Wilcoxon::default().paired(&B, &A).unwrap();
    same(&[test.w_plus, test.w_minus, test.rank_biserial], &[74.0, 4.0, 0.8974358974358974]);
}

#[test]
fn an_exact_signed_rank_test_needs_no_untied_ranks() {
    // What SciPy's permutation test says of these (its `auto`), in place of its rounded `exact`.
    let test = Wilcoxon { method: Exact, ..Wilcoxon::default() };
    assert_eq!(test.differences(&TIED).unwrap().p, 0.015625);
}

#[test]
fn effect_sizes_are_the_textbooks_and_pingouins() {
    let sizes = [cohen_dz(&B, &A), hedges_gz(&B, &A), cohen_d_average(&B, &A)].map(Result::unwrap);
    same(&sizes, &[1.2632716900293726, 1.1751364558412767, 0.3127198215899006]);
}

#[test]
fn shapiro_and_wilks_test_is_scipys() {
    let skewed: Vec<f64> = A.iter().map(|each| (each / 5.0).exp()).collect();
    let golden: [(&[f64], f64, f64); 5] = [
        (&A, 0.9669572360661175, 0.8764651333804572),
        (&long(), 0.9085602780614324, 0.00027382443232085076),
        (&A[..3], 0.9923575239224323, 0.8328242965770508),
        (&A[..5], 0.9854352489431142, 0.9614147299979592),
        (&skewed, 0.7631784199344858, 0.003681393334548027),
    ];
    for (values, w, p) in golden {
        let test = shapiro_wilk(values).unwrap();
        same(&[test.w, test.p], &[w, p]);
    }
}

#[test]
fn friedmans_test_is_scipys_and_kendalls_w_pingouins() {
    let test = friedman(&[&A, &B, &C, &D]).unwrap();
    same(&[test.chi2, test.p, test.kendall_w], &[30.5, 1.0831686754579124e-06, 0.8472222222222222]);
    let test = friedman(&[&tens(A), &tens(B), &tens(C)]).unwrap();
    same(&[test.chi2, test.p], &[6.5, 0.03877420783172202]);
}

#[test]
fn analysis_of_variance_is_pingouins() {
    let test = repeated_measures(&[&A, &B, &C, &D]).unwrap();
    same(&[test.f, test.df_conditions, test.p], &[60.88359426146517, 3.0, 1.533277874236619e-13]);
    same(
        &[test.greenhouse_geisser, test.p_greenhouse_geisser],
        &[0.7263236177542255, 2.1976021146842972e-10],
    );
    same(
        &[test.partial_eta_squared, test.generalised_eta_squared],
        &[0.846974819317058, 0.12467744539824617],
    );
    let sphericity = test.sphericity.unwrap();
    same(&[sphericity.w, sphericity.p], &[0.5385526034661338, 0.3067477385633672]);
}

#[test]
fn two_conditions_in_an_analysis_of_variance_are_a_t_test() {
    let (f, t) = (repeated_measures(&[&A, &B]).unwrap(), paired_t(&A, &B, TwoSided).unwrap());
    same(&[f.f, f.p, f.greenhouse_geisser], &[t.t * t.t, t.p, 1.0]);
    assert_eq!(f.sphericity, None);
}

#[test]
fn pages_test_is_scipys() {
    let conditions: [&[f64]; 4] = [&A, &B, &C, &D];
    let golden = [
        (PageMethod::Auto, 8.974065774533838e-12),
        (PageMethod::Exact, 8.974065774533838e-12),
        (PageMethod::Normal, 1.898956246588768e-08),
    ];
    for (method, p) in golden {
        let test = page_trend(&conditions, method).unwrap();
        same(&[test.l, test.p], &[355.0, p]);
    }
    let tied: [&[f64]; 3] = [&tens(A), &tens(C), &tens(B)];
    let p = |method| page_trend(&tied, method).unwrap().p;
    same(
        &[p(PageMethod::Exact), p(PageMethod::Normal)],
        &[0.13263541385150227, 0.11033568095992341],
    );
}

#[test]
fn corrections_are_statsmodels() {
    let p = [0.01, 0.04, 0.03, 0.005, 0.6, 0.03];
    same(&corrected(&p, Correction::Holm), &[0.05, 0.12, 0.12, 0.03, 0.6, 0.12]);
    same(&corrected(&p, Correction::Bonferroni), &[0.06, 0.24, 0.18, 0.03, 1.0, 0.18]);
    same(&corrected(&p, Correction::BenjaminiHochberg), &[0.03, 0.048, 0.045, 0.03, 0.6, 0.045]);
}

#[test]
fn a_missing_p_value_does_not_count() {
    let corrected = corrected(&[0.02, f64::NAN, 0.5], Correction::Holm);
    assert!(corrected[1].is_nan());
    same(&[corrected[0], corrected[2]], &[0.04, 0.5]);
}

#[test]
fn correlations_are_scipys() {
    let of = |test: Correlation| [test.r, test.p];
    same(&of(pearson(&A, &B).unwrap()), &[0.9763217226695611, 5.6335799750351165e-08]);
    same(&of(pearson(&A, &TIED).unwrap()), &[-0.0024890744829203157, 0.9938745938646955]);
    same(
        &of(pearson(&long()[..20], &long()[40..]).unwrap()),
        &[0.42154198286814076, 0.06414586572787251],
    );
    same(&of(spearman(&A, &B).unwrap()), &[0.965034965034965, 3.880985299627466e-07]);
    same(&of(spearman(&A, &TIED).unwrap()), &[0.02811989875378381, 0.9308715940448491]);
    same(
        &of(spearman(&long()[..20], &long()[40..]).unwrap()),
        &[0.41503759398496237, 0.06880769728594094],
    );
    let interval = pearson(&A, &TIED).unwrap().interval(0.95).unwrap();
    same(&[interval.low, interval.high], &[-0.5755685011738425, 0.57222996380193]);
}

#[test]
fn pairs_of_conditions_are_pingouins() {
    let conditions: [&[f64]; 4] = [&A, &B, &C, &D];
    let pairs = pairwise_t(&conditions, Correction::Holm).unwrap();
    let p: Vec<f64> = pairs.iter().map(|pair| pair.p_corrected).collect();
    let golden = [
        0.0031378292558422805,
        2.189732948967523e-06,
        7.332099993027249e-07,
        0.0031378292558422805,
        5.860417391447486e-06,
        0.0031378292558422805,
    ];
    same(&p, &golden);
    let pairs = pairwise_wilcoxon(&conditions, &Wilcoxon::default(), Correction::Holm).unwrap();
    let p: Vec<f64> = pairs.iter().map(|pair| pair.p_corrected).collect();
    let golden =
        [0.0068359375, 0.0029296875, 0.0029296875, 0.00439453125, 0.0029296875, 0.0068359375];
    same(&p, &golden);
}

fn sd(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|each| (each - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

#[test]
fn bootstrap_intervals_are_scipys_on_the_same_draws() {
    let settings = Bootstrap { resamples: 2000, level: 0.95, seed: 7 };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let middle = |values: &[f64]| median(values).unwrap();
    let statistics: [(&dyn Fn(&[f64]) -> f64, [f64; 5]); 3] = [
        (
            &mean,
            [1.2916666666666654, 3.308333333333334, 1.392058629367846, 3.35, 0.5087797045567805],
        ),
        (&middle, [0.9499999999999993, 3.25, 0.9499999999999993, 3.25, 0.5954061674622837]),
        (
            &sd,
            [
                1.0373441518697484,
                2.2764988400447925,
                1.3291364500280893,
                2.506703032690111,
                0.3144177199653765,
            ],
        ),
    ];
    for (statistic, golden) in statistics {
        let drawn = bootstrap(&differences(), statistic, &settings).unwrap();
        let (plain, better) = (drawn.percentile, drawn.bias_corrected.unwrap());
        same(&[plain.low, plain.high, better.low, better.high, drawn.standard_error], &golden);
    }
}

#[test]
fn equal_values_have_nothing_to_compare() {
    let equal = [5.0; 8];
    assert_eq!(paired_t(&equal, &equal, TwoSided), Err(StatisticsError::NoSpread));
    assert_eq!(Wilcoxon::default().paired(&equal, &equal), Err(StatisticsError::NoSpread));
    assert_eq!(cohen_dz(&equal, &equal), Err(StatisticsError::NoSpread));
    assert_eq!(shapiro_wilk(&equal), Err(StatisticsError::NoSpread));
    assert_eq!(friedman(&[&equal[..]; 3]), Err(StatisticsError::NoSpread));
    assert_eq!(repeated_measures(&[&equal[..]; 3]), Err(StatisticsError::NoSpread));
    assert_eq!(pearson(&equal, &equal), Err(StatisticsError::NoSpread));
}

#[test]
fn a_missing_value_is_an_error_until_its_row_is_left_out() {
    let with_gap = [66.0, f64::NAN, 59.5, 80.0];
    assert_eq!(paired_t(&with_gap, &A[..4], TwoSided), Err(StatisticsError::NotFinite));
    let complete = complete_rows(&[&with_gap, &A[..4]]).unwrap();
    assert_eq!(complete.left_out, [1]);
    let columns = complete.columns();
    assert_eq!(paired_t(columns[0], columns[1], TwoSided).unwrap().df, 2.0);
}

#[test]
fn columns_must_be_equally_long() {
    let error = Err(StatisticsError::UnequalLengths { first: 12, other: 3 });
    assert_eq!(paired_t(&A, &B[..3], TwoSided), error);
}

fn any_columns() -> impl Strategy<Value = Vec<Vec<f64>>> {
    let value = prop_oneof![
        prop::num::f64::ANY,
        -100.0..100.0,
        (-3i32..3).prop_map(f64::from),
        Just(1e308),
        Just(5e-324),
    ];
    (0usize..5, 0usize..30).prop_flat_map(move |(columns, rows)| {
        prop::collection::vec(prop::collection::vec(value.clone(), rows), columns)
    })
}

fn is_share(p: f64) -> bool {
    (0.0..=1.0 + 1e-12).contains(&p)
}

#[track_caller]
fn sound<T: std::fmt::Debug>(result: &Result<T, StatisticsError>, is_sound: impl Fn(&T) -> bool) {
    assert!(result.as_ref().map_or(true, is_sound), "{result:?}");
}

const SLOW: [f64; 12] = [68.0, 70.9, 69.1, 71.2, 72.8, 70.5, 71.6, 68.9, 69.7, 66.9, 68.2, 66.6];

#[test]
fn a_phase_differs_from_the_baseline_by_the_differences_of_its_statistics() {
    let change = baseline_change(&C[..9], &A).unwrap();
    let ours = [
        change.mean_difference,
        change.sd_difference,
        change.median_difference,
        change.percent_change.unwrap(),
        change.z.unwrap(),
        change.robust_z.unwrap(),
    ];
    let golden = [
        3.9694444444444485,
        0.05985607747238664,
        3.6500000000000057,
        5.7327395996309285,
        0.579266810166611,
        0.44358334922805465,
    ];
    same(&ours, &golden);
    let still = baseline_change(&A, &[0.0, 0.0, 0.0]).unwrap();
    assert_eq!((still.percent_change, still.z, still.robust_z), (None, None, None));
    assert!(baseline_change(&A, &[1.0]).is_err() && baseline_change(&[f64::NAN; 3], &A).is_err());
}

#[test]
fn neighbours_that_resemble_each_other_are_worth_less() {
    same(&[effective_count(&SLOW).unwrap()], &[6.283391068057864]);
    // Where they differ more than by chance, they are worth no more than they are.
    assert_eq!(effective_count(&A), Ok(12.0));
    assert_eq!(effective_count(&[1.0; 9]), Err(StatisticsError::NoSpread));
    let difference = standardised_difference(&C[..9], &SLOW, 0.95).unwrap();
    let ours = [
        difference.d,
        difference.g,
        difference.standard_error,
        difference.interval.low,
        difference.interval.high,
    ];
    let golden = [
        0.7794057106777013,
        0.7345551971040776,
        0.5365753022799663,
        -0.3171130703583491,
        1.7862234645665043,
    ];
    same(&ours, &golden);
}

proptest! {
    #[test]
    fn whatever_comes_an_answer_is_a_number(
        columns in any_columns(),
        level in prop::num::f64::ANY,
    ) {
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let column = |index: usize| columns.get(index).copied().unwrap_or_default();
        let (first, second) = (column(0), column(1));
        for alternative in [TwoSided, Less, Greater] {
            sound(&paired_t(first, second, alternative), |test| is_share(test.p));
            for method in [Auto, Exact, Normal, NormalWithContinuity] {
                for zeros in [LeftOut, Ranked] {
                    let test = Wilcoxon { alternative, zeros, method };
                    sound(&test.paired(first, second), |test| is_share(test.p));
                }
            }
        }
        sound(&friedman(&columns), |test| is_share(test.p) && is_share(test.kendall_w));
        sound(&repeated_measures(&columns), |test| is_share(test.p));
        sound(&repeated_measures(&columns), |test| is_share(test.p_greenhouse_geisser));
        sound(&page_trend(&columns, PageMethod::Auto), |test| is_share(test.p));
        sound(&shapiro_wilk(first), |test| is_share(test.p));
        sound(&pearson(first, second), |test| is_share(test.p) && test.r.abs() <= 1.0);
        sound(&spearman(first, second), |test| is_share(test.p) && test.r.abs() <= 1.0);
        sound(&cohen_dz(first, second), |size| size.is_finite());
        sound(&hedges_gz(first, second), |size| size.is_finite());
        sound(&cohen_d_average(first, second), |size| size.is_finite());
        sound(&mean_interval(first, level), |interval| interval.low <= interval.high);
        let settings = Bootstrap { resamples: 50, level, seed: 3 };
        let drawn = bootstrap(first, |values| values.iter().sum(), &settings);
        sound(&drawn, |drawn| drawn.percentile.low <= drawn.percentile.high);
        prop_assert_eq!(corrected(first, Correction::Holm).len(), first.len());
    }

    #[test]
    fn a_greater_p_is_never_corrected_to_a_lesser(p in prop::collection::vec(0.0..1.0, 1..20)) {
        for correction in [Correction::Holm, Correction::Bonferroni, Correction::BenjaminiHochberg] {
            let corrected = corrected(&p, correction);
            for (a, of_a) in p.iter().zip(&corrected) {
                prop_assert!(of_a >= a);
                for (b, of_b) in p.iter().zip(&corrected) {
                    prop_assert!(a > b || of_a <= of_b);
                }
            }
        }
    }

    #[test]
    fn turning_a_pair_round_turns_the_result_round(a in prop::collection::vec(-9.0..9.0, 6), b in prop::collection::vec(-9.0..9.0, 6)) {
        let (ab, ba) = (Wilcoxon::default().paired(&a, &b).unwrap(), Wilcoxon::default().paired(&b, &a).unwrap());
        prop_assert_eq!(ab.w_plus, ba.w_minus);
        prop_assert!((ab.p - ba.p).abs() < 1e-12);
        prop_assert_eq!(ab.rank_biserial, -ba.rank_biserial);
    }

    #[test]
    fn a_change_is_finite_or_an_error(
        phase in prop::collection::vec(prop::num::f64::ANY, 0..12),
        baseline in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -9.0..9.0], 0..12),
    ) {
        for (a, b) in [(&phase, &baseline), (&baseline, &phase), (&baseline, &baseline)] {
            if let Ok(change) = baseline_change(a, b) {
                prop_assert!(change.mean_difference.is_finite() && change.sd_difference.is_finite());
                prop_assert!(change.z.is_none_or(f64::is_finite));
            }
            if let Ok(difference) = standardised_difference(a, b, 0.9) {
                prop_assert!(difference.interval.low <= difference.interval.high);
            }
        }
    }
}
