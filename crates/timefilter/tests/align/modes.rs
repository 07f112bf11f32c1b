//! Rows for screens, with what is there.

use teampulse_timefilter::align::{Mode, RowTimes, Validity};

use crate::story::{MS, Outcome, SECOND};

#[test]
fn a_row_for_a_screen_is_out_at_its_time() {
    let mut outcome = Outcome::new(RowTimes::Grid { period_nanos: 100 * MS }, Mode::Available);
    let (moving, slow, dying) =
        (outcome.add("linear:500ms"), outcome.add("hold:2s"), outcome.add("hold:1s"));
    for time in (0..10 * SECOND).step_by(10 * MS as usize) {
        outcome.push(moving, time - 150 * MS, time, time as f64);
        if time % SECOND == 0 {
            outcome.at(slow, time, 5.0);
        }
        if time < 5 * SECOND {
            outcome.at(dying, time, 7.0);
        }
        let newest = outcome.times().last().copied();
        assert_eq!(newest, (time >= 100 * MS).then_some(time / (100 * MS) * 100 * MS));
    }
    assert!(outcome.left_out().is_empty());
    for row in &outcome.rows()[5..] {
        let moving = row.cell(moving);
        assert_eq!((moving.validity, moving.age_nanos), (Validity::Held, 160 * MS));
        assert!(row.cell(slow).age_nanos <= SECOND);
        let expected = if row.at < 6 * SECOND { Validity::Held } else { Validity::Stale };
        assert_eq!(
            (row.cell(dying).value(), row.cell(dying).validity),
            (7.0, expected),
            "{}",
            row.at
        );
    }
}

#[test]
fn onto_a_pivot_for_a_screen_a_row_comes_with_its_sample() {
    let mut outcome = Outcome::new(RowTimes::Pivot, Mode::Available);
    let (pivot, other) = (outcome.add("exact"), outcome.add("hold:1s"));
    outcome.at(other, 5 * MS, 3.0);
    outcome.push(pivot, 10 * MS, 40 * MS, 1.0);
    assert_eq!(outcome.times(), [10 * MS]);
    assert_eq!(outcome.rows()[0].cell(other).value(), 3.0);
    outcome.push(pivot, 8 * MS, 41 * MS, 1.0);
    assert_eq!(outcome.aligner.counts(pivot).unwrap().late, 1);
}
