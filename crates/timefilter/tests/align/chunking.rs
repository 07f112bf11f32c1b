//! The same samples give the same rows, however they are cut and however often the time is given.

use proptest::prelude::*;
use teampulse_timefilter::align::{Mode, Output, RowTimes, Run, SourceSettings};

use crate::story::{Kept, MS, Outcome, SECOND, keep};

/// A batch: its source, how long after the one before it arrives, how long before that it was
/// measured, and how many samples it has.
type Batch = (usize, i64, i64, usize);

const POLICIES: [&str; 4] = ["linear:200ms", "hold:300ms", "nearest:20ms", "mean:100ms"];
const PERIOD: i64 = 7 * MS;

fn report(
    onto: RowTimes,
    mode: Mode,
    batches: &[Batch],
    cuts: &[usize],
    ticks: &[i64],
) -> Vec<Kept> {
    let mut outcome = Outcome::new(onto, mode);
    let settings = |policy: &str| {
        let (lateness_nanos, idle_nanos) = (40 * MS, 250 * MS);
        SourceSettings {
            lateness_nanos,
            idle_nanos,
            ..SourceSettings::new(policy.parse().unwrap())
        }
    };
    let sources = POLICIES.map(|policy| outcome.aligner.add(settings(policy)).unwrap());
    let (mut now, mut cuts, mut ticks) = (SECOND, cuts.iter().cycle(), ticks.iter().cycle());
    outcome.tick(now);
    for (number, &(source, later, delay, count)) in batches.iter().enumerate() {
        let tick = ticks.next().map_or(later, |tick| tick.min(&later) + now);
        outcome.tick(tick);
        now += later;
        // In the middle of the story a source joins that never says anything.
        if number == batches.len() / 2 {
            let out = |output: Output<'_>| keep(&mut outcome.kept, output);
            outcome.aligner.join(settings("hold:1s"), now, out).unwrap();
        }
        let values: Vec<f64> = (0..count).map(|k| (now / MS + k as i64) as f64).collect();
        let measured = now - delay - count as i64 * PERIOD;
        let mut from = 0;
        while from < count {
            let to = (from + cuts.next().unwrap_or(&count)).min(count);
            let run = Run {
                measured: measured + from as i64 * PERIOD,
                period_nanos: PERIOD as f64,
                arrival: now,
                values: &values[from..to],
            };
            outcome
                .aligner
                .push_run(sources[source], run, |output| keep(&mut outcome.kept, output))
                .unwrap();
            from = to;
        }
    }
    outcome.tick(now + 3 * SECOND);
    outcome.finish();
    outcome.kept
}

proptest! {
    #[test]
    fn any_cutting_and_any_ticks_give_the_same_rows(
        batches in prop::collection::vec((0..4_usize, 0..400 * MS, 0..500 * MS, 1..12_usize), 1..60),
        cuts in prop::collection::vec(1..6_usize, 1..9),
        ticks in prop::collection::vec(0..400 * MS, 1..9),
        on_pivot in any::<bool>(),
        available in any::<bool>(),
    ) {
        let onto = if on_pivot { RowTimes::Pivot } else { RowTimes::Grid { period_nanos: 15_625_000 } };
        let mode = if available { Mode::Available } else { Mode::Reproducible };
        let whole = report(onto, mode, &batches, &[usize::MAX >> 1], &[0]);
        let parts = report(onto, mode, &batches, &cuts, &ticks);
        prop_assert!(whole == parts);
        prop_assert!(on_pivot || whole.iter().any(|kept| matches!(kept, Kept::Row(_))));
    }

    /// Rows come in order, each on time at the latest, and no sample disappears.
    #[test]
    fn rows_come_in_order(
        batches in prop::collection::vec((0..4_usize, 0..400 * MS, 0..500 * MS, 1..12_usize), 1..60),
    ) {
        let onto = RowTimes::Grid { period_nanos: 15_625_000 };
        let kept = report(onto, Mode::Reproducible, &batches, &[1], &[0]);
        let times: Vec<i64> = kept
            .iter()
            .filter_map(|kept| if let Kept::Row(row) = kept { Some(row.at) } else { None })
            .collect();
        prop_assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 15_625_000));
    }
}
