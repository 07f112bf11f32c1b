use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;
use crate::analysis::{Track, Windows};

const SEC: i64 = 1_000_000_000;
static VALUES: [Value; 1] = [Value::new("Mean", "1", "mean of the span")];

/// The mean of a span; each usable sample at a multiple of ten is an event.
struct Means {
    track: Track,
    events: Vec<Event>,
}

impl Windows for Means {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        let mut values = self.track.values_in(span);
        values.retain(|value| value.is_finite());
        let coverage = self.track.coverage(span);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let value = if coverage < LEAST_COVERAGE { Err(Reason::Gap) } else { Ok(mean) };
        Measured { coverage, quality: 1.0, values: vec![value] }
    }
}

impl Causal for Means {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        self.track.push(at_ns, channels[0]);
        if channels[0] % 10.0 == 0.0 {
            let sample = self.track.held().end as f64 - 1.0;
            self.events.push(Event { kind: "beat", sample, at_ns, details: Vec::new() });
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    fn forget(&mut self, before_ns: i64) {
        self.track.forget(before_ns);
    }
}

fn live(lengths_secs: &[i64]) -> Live {
    let make: Make =
        Box::new(|rate_hz| Ok(Box::new(Means { track: Track::new(rate_hz), events: Vec::new() })));
    let lengths_ns: Vec<i64> = lengths_secs.iter().map(|secs| secs * SEC).collect();
    Live::new(make, 2.0, 1, &lengths_ns, SEC).unwrap()
}

/// Each window as (end [s], value); each event as its sample.
type Heard = (Vec<(f64, Result<f64, Reason>)>, Vec<f64>);

fn reported(live: &mut Live, samples: &[(f64, f64)]) -> Heard {
    let (mut windows, mut events) = (Vec::new(), Vec::new());
    for (secs, value) in samples {
        live.push((secs * 1e9) as i64, &[*value], &mut |output| match output {
            LiveOutput::Event(event) => events.push(event.sample),
            LiveOutput::Window(_, span, measured) => {
                windows.push((span.end_ns as f64 / 1e9, measured.values[0]));
            }
        });
    }
    (windows, events)
}

/// Samples at 2 Hz at the given half seconds; the value of each is its number.
fn halves(range: std::ops::Range<u32>) -> Vec<(f64, f64)> {
    range.map(|k| (5.0 + f64::from(k) / 2.0, f64::from(k))).collect()
}

#[test]
fn a_window_is_reported_when_the_first_sample_after_it_has_come() {
    let (windows, _) = reported(&mut live(&[2]), &halves(0..9));
    assert_eq!(windows, [(6.0, Ok(0.5)), (7.0, Ok(1.5)), (8.0, Ok(3.5)), (9.0, Ok(5.5))]);
}

#[test]
fn a_window_that_is_not_full_yet_is_short_and_one_with_a_hole_has_a_gap() {
    let samples = [halves(0..10), halves(16..30)].concat();
    let (windows, _) = reported(&mut live(&[4]), &samples);
    let of = |secs: f64| windows.iter().find(|window| window.0 == secs).unwrap().1;
    assert_eq!(of(6.0), Err(Reason::Short));
    assert_eq!(of(9.0), Ok(3.5));
    assert_eq!(of(13.0), Err(Reason::Gap));
    assert!(of(17.0).is_ok());
}

#[test]
fn samples_are_counted_through_gaps_short_and_long() {
    // The first silence is longer than the window, the second longer than anything is held.
    for return_at in [1000, 3000] {
        let samples = [halves(0..11), halves(14..25), halves(return_at..return_at + 15)].concat();
        let (windows, events) = reported(&mut live(&[4]), &samples);
        let back = f64::from(return_at);
        assert_eq!(events, [0.0, 10.0, 20.0, back, back + 10.0]);
        // Nothing is reported for the silence, and all windows end at whole seconds after the beginning.
        let silence = 18.0..5.0 + back / 2.0;
        assert!(windows.iter().all(|(secs, _)| secs.fract() == 0.0 && !silence.contains(secs)));
    }
}

#[test]
fn what_is_held_can_be_asked_and_changes_no_window() {
    let samples = [halves(0..20), halves(40..60)].concat();
    let (mut usual, mut holding) = (live(&[2]), live(&[2]));
    holding.hold_from(Some(5 * SEC));
    assert_eq!(reported(&mut usual, &samples), reported(&mut holding, &samples));
    let span = |from, to| Span { begin_ns: from * SEC, end_ns: to * SEC };
    assert_eq!(holding.measure(span(5, 10)).values, [Ok(4.5)]);
    assert_eq!(usual.measure(span(5, 10)).values, [Err(Reason::Gap)]);
    assert_eq!(holding.measure(span(5, 35)).coverage, 40.0 / 60.0);
    holding.hold_from(None);
    reported(&mut holding, &halves(60..64));
    assert_eq!(holding.measure(span(5, 10)).values, [Err(Reason::Gap)]);
}

#[test]
fn no_more_is_held_than_is_said() {
    let mut live = live(&[2]);
    live.hold_from(Some(0));
    reported(&mut live, &halves(0..3000));
    let span = |from_secs| Span { begin_ns: from_secs * SEC, end_ns: (from_secs + 10) * SEC };
    assert_eq!(live.measure(span(1000)).coverage, 1.0);
    // 600 s, plus 5 s for queries a moment later.
    assert_eq!(live.measure(span(884)).coverage, 0.0);
}

#[test]
fn a_sample_that_is_not_after_the_last_one_is_left_out() {
    let mut live = live(&[2]);
    assert_eq!(live.push(SEC, &[1.0], &mut |_| ()), Some(0));
    assert_eq!(live.push(SEC, &[1.0], &mut |_| ()), None);
    assert_eq!(live.push(3 * SEC, &[1.0], &mut |_| ()), Some(3));
}

/// Means that are expensive to compute: one that was reported shortly before is reused.
struct Dear(Means);

impl Windows for Dear {
    fn values(&self) -> &[Value] {
        self.0.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.0.measure(span)
    }

    fn measure_again(&self, _: Span, last: &Measured) -> Measured {
        last.clone()
    }
}

impl Causal for Dear {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        self.0.push(at_ns, channels);
    }

    fn next_event(&mut self) -> Option<Event> {
        self.0.next_event()
    }

    fn forget(&mut self, before_ns: i64) {
        self.0.forget(before_ns);
    }
}

fn dear(lengths_secs: &[i64]) -> Live {
    let make: Make = Box::new(|rate_hz| {
        Ok(Box::new(Dear(Means { track: Track::new(rate_hz), events: Vec::new() })))
    });
    let lengths_ns: Vec<i64> = lengths_secs.iter().map(|secs| secs * SEC).collect();
    Live::new(make, 2.0, 1, &lengths_ns, SEC).unwrap()
}

#[test]
fn what_is_held_was_computed_less_than_ten_seconds_before() {
    let samples = halves(0..100);
    let (fresh, _) = reported(&mut live(&[1]), &samples);
    let (held, _) = reported(&mut dear(&[1]), &samples);
    assert_eq!(held.len(), fresh.len());
    for (place, window) in held.iter().enumerate() {
        assert_eq!(*window, (fresh[place].0, fresh[place - place % 10].1));
    }
}

#[test]
fn windows_of_different_lengths_take_their_turns_in_different_seconds() {
    let mut live = dear(&[30, 60, 300]);
    let (mut last, mut turns) = ([Ok(0.0); 3], BTreeSet::new());
    for (secs, value) in halves(0..1000) {
        live.push((secs * 1e9) as i64, &[value], &mut |output| {
            let LiveOutput::Window(place, span, measured) = output else { return };
            if measured.values[0] != last[place] && span.end_ns > 400 * SEC {
                turns.insert((place, span.end_ns / SEC % 10));
            }
            last[place] = measured.values[0];
        });
    }
    // Samples begin at 5 s.
    assert_eq!(turns, BTreeSet::from([(0, 7), (1, 9), (2, 1)]));
}

#[test]
fn nothing_is_held_through_a_silence_that_empties_the_windows() {
    let samples = [halves(0..10), halves(16..30)].concat();
    let (fresh, _) = reported(&mut live(&[2]), &samples);
    let (held, _) = reported(&mut dear(&[2]), &samples);
    let first = fresh.iter().position(|window| window.0 > 13.0).unwrap();
    assert_eq!((held.len(), held[first]), (fresh.len(), fresh[first]));
    assert_ne!(held[first], held[first - 1]);
}

proptest! {
    #[test]
    fn no_times_do_harm(times in prop::collection::vec(any::<i64>(), 0..20)) {
        let mut live = live(&[1, 3]);
        for at_ns in times {
            live.push(at_ns, &[1.0], &mut |_| ());
        }
    }
}

#[test]
fn a_window_of_which_not_all_is_held_is_not_reported_and_the_others_are() {
    let samples: Vec<(f64, f64)> =
        (0..80).map(|k| (f64::from(k) / 2.0, f64::from(k) + 0.5)).collect();
    let mut live = live(&[5, 20]);
    let (mut short, mut long) = (0, 0);
    for (secs, value) in samples {
        let at_ns = (secs * 1e9) as i64;
        // From the 25th second on only ten seconds are held.
        if secs >= 25.0 {
            live.hold_since(at_ns - 10 * SEC);
        }
        live.push(at_ns, &[value], &mut |output| match output {
            LiveOutput::Window(0, ..) => short += 1,
            LiveOutput::Window(_, span, _) => {
                long += 1;
                assert!(span.end_ns < 25 * SEC, "{span:?}");
            }
            LiveOutput::Event(_) => {}
        });
    }
    assert_eq!((short, long), (39, 24));
    let held = Span { begin_ns: 35 * SEC, end_ns: 39 * SEC };
    assert!(live.measure(held).coverage > 0.99);
    let gone = Span { begin_ns: 0, end_ns: 20 * SEC };
    assert_eq!(live.measure(gone).coverage, 0.0);
}
