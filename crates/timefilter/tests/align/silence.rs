//! What becomes of the rows when a source dies.

use teampulse_timefilter::align::{Mode, ROWS_IN_SILENCE, RowTimes, SourceEvent, Validity};

use crate::story::{MS, Outcome, SECOND};

const PERIOD: i64 = SECOND / 50;

#[test]
fn a_source_that_dies_for_five_minutes_is_stale_and_nothing_else_is_lost() {
    let mut outcome = Outcome::grid(PERIOD);
    let alive = outcome.add("linear:500ms");
    let dying = outcome.add("hold:1s");
    let dead = 60 * SECOND..360 * SECOND;
    let mut delay_longest = 0;
    for time in (0..420 * SECOND).step_by(10 * MS as usize) {
        if time % (100 * MS) == 0 && !dead.contains(&time) {
            outcome.at(dying, time, 1.0);
        }
        outcome.at(alive, time, time as f64);
        delay_longest = delay_longest.max(time - outcome.times_last());
    }
    outcome.finish();
    assert_eq!(outcome.times(), (0..21_000).map(|row| row * PERIOD).collect::<Vec<_>>());
    assert!(delay_longest <= 2 * SECOND + PERIOD, "{delay_longest}");
    assert!(outcome.rows().iter().all(|row| row.cell(alive).validity == Validity::Fresh));
    assert_eq!(outcome.events(), [SourceEvent::Silent(dying), SourceEvent::Back(dying)]);
    assert!(outcome.left_out().is_empty());
    for row in outcome.rows() {
        let last_sample = dead.start - 100 * MS;
        let cell = row.cell(dying);
        match cell.validity {
            Validity::Fresh | Validity::Held => assert!(!(dead.start..dead.end).contains(&row.at)),
            Validity::Stale => assert_eq!(cell.age_nanos, row.at - last_sample),
            other => panic!("{other:?} at {}", row.at),
        }
    }
    let used_again =
        outcome.rows().iter().find(|row| row.at >= dead.end).map(|row| row.cell(dying).validity);
    assert_eq!(used_again, Some(Validity::Fresh));
}

#[test]
fn a_source_that_returns_late_is_used_within_a_second() {
    let mut outcome = Outcome::grid(PERIOD);
    let alive = outcome.add("linear:500ms");
    let returning = outcome.add("linear:500ms");
    for time in (0..40 * SECOND).step_by(10 * MS as usize) {
        outcome.at(alive, time, 1.0);
        let is_there = !(10 * SECOND..30 * SECOND).contains(&time);
        if is_there && time % (100 * MS) == 0 {
            outcome.push(returning, time - 300 * MS, time, 1.0);
        }
    }
    outcome.finish();
    let used = |from| {
        let mut after = outcome.rows().into_iter().filter(|row| row.at >= from);
        after.find(|row| row.cell(returning).validity == Validity::Fresh).map(|row| row.at)
    };
    assert!(used(30 * SECOND).is_some_and(|at| at <= 31 * SECOND));
}

#[test]
fn rows_go_on_in_complete_silence_for_a_while_and_those_left_out_are_counted() {
    let mut outcome = Outcome::grid(PERIOD);
    let only = outcome.add("hold:1s");
    outcome.at(only, 0, 1.0);
    let hour = 3_600 * SECOND;
    for tick in (0..hour).step_by(SECOND as usize) {
        outcome.tick(tick);
    }
    let in_silence = ROWS_IN_SILENCE as u64 + 1;
    assert_eq!(outcome.aligner.rows(), in_silence);
    outcome.at(only, hour, 2.0);
    outcome.at(only, hour + PERIOD, 2.0);
    assert_eq!(outcome.times().last(), Some(&(hour + PERIOD)));
    assert_eq!(outcome.aligner.rows() + outcome.aligner.skipped(), 3_600 * 50 + 2);
    assert_eq!(outcome.aligner.rows(), in_silence + 2);
}

#[test]
fn a_source_that_never_says_anything_is_missing_after_its_time_out() {
    let mut outcome = Outcome::grid(PERIOD);
    let alive = outcome.add("hold:1s");
    let mute = outcome.add("hold:1s");
    for time in (0..5 * SECOND).step_by(PERIOD as usize) {
        outcome.at(alive, time, 1.0);
        assert_eq!(outcome.aligner.rows() > 0, time >= 2 * SECOND);
    }
    assert!(outcome.rows().iter().all(|row| row.cell(mute).validity == Validity::Missing));
    assert_eq!(outcome.times().len(), 250);
}

#[test]
fn rows_begin_with_the_first_sample_of_a_source_that_was_late_to_begin() {
    let mut outcome = Outcome::grid(PERIOD);
    let only = outcome.add("hold:1s");
    outcome.tick(0);
    outcome.at(only, 5 * SECOND, 1.0);
    outcome.at(only, 6 * SECOND, 2.0);
    outcome.finish();
    assert_eq!(outcome.times(), (250..=300).map(|row| row * PERIOD).collect::<Vec<_>>());
}

#[test]
fn a_pivot_that_dies_and_returns_misses_no_row() {
    let mut outcome = Outcome::new(RowTimes::Pivot, Mode::Reproducible);
    let pivot = outcome.add("exact");
    let other = outcome.add("linear:1s");
    for time in (0..60 * SECOND).step_by(PERIOD as usize) {
        outcome.at(other, time, time as f64);
        if time % SECOND == 0 && !(20 * SECOND..40 * SECOND).contains(&time) {
            outcome.at(pivot, time, 1.0);
        }
    }
    outcome.finish();
    assert_eq!(outcome.times().len(), 40);
    assert!(outcome.rows().iter().all(|row| row.cell(other).value() == row.at as f64));
}

impl Outcome {
    fn times_last(&self) -> i64 {
        self.kept
            .iter()
            .rev()
            .find_map(
                |kept| if let crate::story::Kept::Row(row) = kept { Some(row.at) } else { None },
            )
            .unwrap_or(0)
    }
}
