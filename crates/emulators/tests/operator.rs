//! Laws of a simulated operator: what the task does to the body, in a group of thirty.

#![expect(clippy::unwrap_used, reason = "a test")]

use teampulse_emulators::body::{Body, Rates, Sensor, Settings, Traits, Truth};
use teampulse_emulators::task::{Happening, Operator, Plan, Skill, Task, What};
use teampulse_signal::ecg::find_beats;
use teampulse_signal::hrv::time_domain;
use teampulse_signal::intervals::{Beats, Correction};
use teampulse_signal::statistics::{PageMethod, page_trend};

const PEOPLE: u64 = 30;
const PHASES: [&str; 4] = ["baseline", "1-back", "2-back", "3-back"];

fn operator(seed: u64, plan: Plan, rates: Rates) -> Operator {
    let settings = Settings { rates, ..Settings::default() };
    let body = Body::wearing(&Traits::of_seed(seed), seed, &settings).unwrap();
    Operator::new(body, Task::new(plan, Skill::of_seed(seed), seed))
}

fn one_round() -> Plan {
    Plan { rounds: Some(1), ..Plan::default() }
}

/// The measures of a phase: heart rate and RMSSD of the beats found in the ECG, true level and responses of
/// the skin.
#[derive(Clone, Copy, Default)]
struct Row {
    heart_rate_bpm: f64,
    rmssd_ms: f64,
    skin_level_us: f64,
    responses: f64,
    right_share: f64,
}

fn rows(seed: u64) -> [Row; 4] {
    let plan = one_round();
    let phases: Vec<_> = (0..).map_while(|number| plan.phase(number)).collect();
    let mut operator = operator(seed, plan, Rates { ecg_hz: 130.0, ..Rates::NONE });
    let mut rows = [Row::default(); 4];
    for phase in phases {
        let step = operator.until(phase.to_secs);
        if let Some(place) = PHASES.iter().position(|name| *name == phase.name) {
            let wave = step.record.wave(Sensor::Ecg);
            rows[place] = row(&wave.samples, wave.rate_hz, &step.record.truth, step.happened);
        }
    }
    rows
}

fn row(ecg: &[f64], rate_hz: f64, truth: &Truth, happened: &[Happening]) -> Row {
    let beats = find_beats(ecg, rate_hz).unwrap();
    let times_secs: Vec<f64> = beats.iter().map(|beat| beat.sample / rate_hz).collect();
    let corrected = Correction::default().correct(&Beats::detected(&times_secs));
    let hrv = time_domain(&corrected.beats.intervals_ms()).unwrap();
    let levels = truth.moments.iter().map(|moment| moment.skin_level_us);
    let presses: Vec<bool> = happened
        .iter()
        .filter_map(|each| match each.what {
            What::Press { is_right, .. } => Some(is_right),
            _ => None,
        })
        .collect();
    let right = presses.iter().filter(|right| **right).count();
    Row {
        heart_rate_bpm: hrv.hr_of_mean_nn_bpm,
        rmssd_ms: hrv.rmssd_ms,
        skin_level_us: levels.sum::<f64>() / truth.moments.len() as f64,
        responses: truth.responses.len() as f64,
        right_share: right as f64 / presses.len().max(1) as f64,
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn harder_levels_raise_heart_rate_and_skin_conductance_and_lower_variability() {
    let people: Vec<[Row; 4]> = (0..PEOPLE).map(rows).collect();
    let series = |value: fn(&Row) -> f64| -> [Vec<f64>; 4] {
        std::array::from_fn(|place| people.iter().map(|rows| value(&rows[place])).collect())
    };
    let rising = [
        series(|row| row.heart_rate_bpm),
        series(|row| -row.rmssd_ms),
        series(|row| row.skin_level_us),
        series(|row| row.responses),
    ];
    for conditions in rising {
        let means = conditions.each_ref().map(|values| mean(values));
        assert!(means.windows(2).all(|two| two[0] < two[1]), "{means:?}");
        let slices = conditions.each_ref().map(Vec::as_slice);
        let page = page_trend(&slices, PageMethod::Auto).unwrap();
        assert!(page.p < 0.001, "{page:?}");
    }
    let right = series(|row| row.right_share);
    let [_, one, two, three] = right.each_ref().map(|values| mean(values));
    assert!(one > two && two > three && one > 0.9 && three > 0.5, "{one} {two} {three}");
}

#[test]
fn an_operator_is_the_same_however_time_is_cut() {
    let lived = |times_secs: &[f64]| {
        let mut operator = operator(2, one_round(), Rates { emg_hz: 200.0, ..Rates::NONE });
        let (mut happened, mut samples, mut beats) = (Vec::new(), Vec::new(), Vec::new());
        for &secs in times_secs {
            let step = operator.until(secs);
            happened.extend_from_slice(step.happened);
            samples.extend(step.record.wave(Sensor::Emg).samples.iter().map(|uv| uv.to_bits()));
            beats.extend_from_slice(&step.record.truth.beats);
        }
        (happened, samples, beats)
    };
    let odd: Vec<f64> = (0..2390).map(|k| 0.0417 * f64::from(k)).collect();
    let whole = lived(&[100.0]);
    assert!(whole == lived(&[odd, vec![f64::NAN, 100.0]].concat()));
    assert!(whole.0.len() > 50);
}

#[test]
fn muscles_contract_before_each_press() {
    let mut operator = operator(5, one_round(), Rates::NONE);
    let step = operator.until(330.0);
    let contractions = &step.record.truth.contractions;
    let presses = step.happened.iter().filter(|each| matches!(each.what, What::Press { .. }));
    let mut count = 0;
    for press in presses {
        let from_secs = press.at_secs - 0.06;
        assert!(contractions.iter().any(|each| (each.from_secs - from_secs).abs() < 1e-9));
        count += 1;
    }
    assert!(count > 50, "{count}");
}

#[test]
fn some_people_give_up_at_three_back_for_a_while_and_nobody_before() {
    let mut gave_up = 0;
    for seed in 0..PEOPLE {
        let mut task = Task::new(one_round(), Skill::of_seed(seed), seed);
        let (mut phase, mut bouts) = ("", 0);
        while let Some(happening) = task.next_until(f64::INFINITY) {
            match happening.what {
                What::Begins { phase: name, .. } => phase = name,
                What::Demands { disengaged: true, .. } => {
                    assert_eq!(phase, "3-back");
                    bouts += 1;
                }
                _ => {}
            }
        }
        gave_up += u32::from(bouts > 0);
    }
    assert!((5..25).contains(&gave_up), "{gave_up}");
}

#[test]
fn happenings_come_in_the_order_of_their_times() {
    let mut task = Task::new(Plan::default(), Skill::of_seed(1), 1);
    let mut last_secs = 0.0;
    let mut commands = 0;
    for _ in 0..5000 {
        let happening = task.next_until(f64::INFINITY).unwrap();
        assert!(happening.at_secs >= last_secs);
        last_secs = happening.at_secs;
        commands += u32::from(matches!(happening.what, What::Command { .. }));
    }
    assert!(last_secs > 1000.0 && commands > 20);
}
