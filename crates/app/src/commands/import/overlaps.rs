//! Removes samples whose times other samples of their signal already have: from a file that was given twice, from files
//! that overlap, and from a clock that was set back.

use std::collections::BTreeSet;

use teampulse_formats::{Content, Mark, Run, Signal};

/// A run may start this much before the end of the previous one [ns]: consecutive files of a device may overlap by as
/// much, since clocks are imperfect.
const OVERLAP_NS: i64 = 1_000_000_000;

/// Adds the content of another file. Marks, and samples with their own times, that are already there are left out, and
/// their number is returned. Returns `None` and adds nothing if the content has another form.
pub fn append(known: &mut Content, more: &Content, width: usize) -> Option<usize> {
    match (known, more) {
        (Content::Even(runs), Content::Even(more)) => {
            runs.extend(more.iter().cloned());
            Some(0)
        }
        (Content::Marks(marks), Content::Marks(more)) => {
            let key = |mark: &Mark| (mark.at_ns, mark.label.clone());
            let there: BTreeSet<_> = marks.iter().map(key).collect();
            let before = marks.len();
            marks.extend(more.iter().filter(|mark| !there.contains(&key(mark))).cloned());
            Some(more.len() - (marks.len() - before))
        }
        (
            Content::Uneven { at_ns, values },
            Content::Uneven { at_ns: more_ns, values: more_values },
        ) => {
            let bits = |numbers: &[f64]| numbers.iter().map(|value| value.to_bits()).collect();
            let samples = at_ns.iter().zip(values.chunks_exact(width));
            let there: BTreeSet<(i64, Vec<u64>)> =
                samples.map(|(at_ns, numbers)| (*at_ns, bits(numbers))).collect();
            let before = at_ns.len();
            for (more_ns, numbers) in more_ns.iter().zip(more_values.chunks_exact(width)) {
                if !there.contains(&(*more_ns, bits(numbers))) {
                    at_ns.push(*more_ns);
                    values.extend_from_slice(numbers);
                }
            }
            Some(more_ns.len() - (at_ns.len() - before))
        }
        _ => None,
    }
}

/// Removes samples of runs that lie within an earlier run; returns their number.
pub fn without_overlaps(signal: &mut Signal) -> usize {
    let width = signal.channels.len().max(1);
    let Content::Even(runs) = &mut signal.content else { return 0 };
    runs.sort_by_key(|run| run.start_ns);
    let (mut end_ns, mut removed) = (i64::MIN, 0);
    for run in runs.iter_mut() {
        let within_ns = end_ns.saturating_sub(run.start_ns);
        if within_ns > OVERLAP_NS {
            let within = (within_ns as f64 / run.period_ns).round() as usize;
            let within = within.min(run.samples.len() / width);
            run.start_ns = after(run, within);
            run.samples.drain(..within * width);
            removed += within;
        }
        end_ns = end_ns.max(after(run, run.samples.len() / width));
    }
    runs.retain(|run| !run.samples.is_empty());
    removed
}

/// The time this many samples after the start of a run [ns].
fn after(run: &Run, samples: usize) -> i64 {
    run.start_ns.saturating_add((samples as f64 * run.period_ns).round() as i64)
}

#[cfg(test)]
mod tests {
    use teampulse_formats::{Channel, Quantity};

    use super::*;

    const SEC_NS: i64 = 1_000_000_000;

    /// At 4 Hz.
    fn run(start_secs: i64, samples: std::ops::Range<i32>) -> Run {
        let samples = samples.map(f64::from).collect();
        Run { start_ns: start_secs * SEC_NS, period_ns: 0.25e9, samples }
    }

    /// What is left of runs: the start of each [s] and its samples; and how many samples were removed.
    fn left(runs: Vec<Run>) -> (Vec<(f64, Vec<f64>)>, usize) {
        let mut signal = Signal {
            name: "eda".into(),
            quantity: Quantity::Eda,
            channels: vec![Channel::new("eda", "uS")],
            rate_hz: 4.0,
            content: Content::Even(runs),
        };
        let removed = without_overlaps(&mut signal);
        let Content::Even(runs) = signal.content else { panic!("still even") };
        (runs.into_iter().map(|run| (run.start_ns as f64 / 1e9, run.samples)).collect(), removed)
    }

    #[test]
    fn samples_within_an_earlier_run_are_removed_and_counted() {
        let twice = left(vec![run(0, 0..40), run(0, 0..40)]);
        assert_eq!(twice, (vec![(0.0, run(0, 0..40).samples)], 40));
        let (kept, removed) = left(vec![run(5, 0..40), run(0, 0..40)]);
        assert_eq!((kept[1].0, &kept[1].1[..2], removed), (10.0, &[20.0, 21.0][..], 20));
        // One lies wholly within another that lasts longer.
        let (kept, removed) = left(vec![run(0, 0..80), run(2, 0..8), run(10, 0..60)]);
        assert_eq!((kept.len(), kept[1].0, removed), (2, 20.0, 8 + 40));
    }

    #[test]
    fn runs_that_follow_each_other_stay_as_they_are() {
        let mut late = run(10, 0..40);
        late.start_ns -= SEC_NS / 2;
        let (kept, removed) = left(vec![run(0, 0..40), late]);
        assert_eq!((kept.len(), kept[1].0, removed), (2, 9.5, 0));
    }

    #[test]
    fn marks_and_intervals_of_two_files_are_joined_without_those_that_both_have() {
        let marks = |times: &[i64]| {
            let mark = |at_ns: &i64| Mark { at_ns: *at_ns, duration_ns: 0, label: "tag".into() };
            Content::Marks(times.iter().map(mark).collect())
        };
        let mut known = marks(&[1, 5]);
        assert_eq!(append(&mut known, &marks(&[5, 7]), 1), Some(1));
        assert_eq!(known, marks(&[1, 5, 7]));
        let uneven = |samples: &[(i64, f64)]| Content::Uneven {
            at_ns: samples.iter().map(|sample| sample.0).collect(),
            values: samples.iter().map(|sample| sample.1).collect(),
        };
        // Two equal intervals that came together in one file are two.
        let mut known = uneven(&[(1, 800.0), (1, 800.0)]);
        let more = uneven(&[(1, 800.0), (1, 810.0), (2, 800.0)]);
        assert_eq!(append(&mut known, &more, 1), Some(1));
        assert_eq!(known, uneven(&[(1, 800.0), (1, 800.0), (1, 810.0), (2, 800.0)]));
        assert_eq!(append(&mut known, &marks(&[1]), 1), None);
    }
}
