use std::ops::Range;

use proptest::prelude::*;

use super::*;

const START: i64 = 1_700_000_000_000_000_000;
const SECOND: i64 = 1_000_000_000;

/// A computer with a clock that is ahead and fast, and with delayed messages.
struct Computer {
    ahead_nanos: i64,
    fast_ppm: i64,
    remote: Remote,
    events: Vec<ClockEvent>,
    /// The largest error of times from the tenth second on [ns].
    worst_nanos: i64,
    disbelieved: usize,
    messages: usize,
}

impl Computer {
    fn new(ahead_nanos: i64, fast_ppm: i64) -> Computer {
        let remote = Remote::default();
        let (events, worst_nanos) = (Vec::new(), 0);
        let (disbelieved, messages) = (0, 0);
        Computer { ahead_nanos, fast_ppm, remote, events, worst_nanos, disbelieved, messages }
    }

    fn stamp(&self, time: i64) -> i64 {
        time + self.ahead_nanos + (time - START) / 1_000_000 * self.fast_ppm
    }

    /// Sends messages at 50 Hz; the fastest take 1 ms, most take longer.
    fn run(&mut self, from_secs: i64, to_secs: i64) {
        for k in from_secs * 50..to_secs * 50 {
            let sent = START + k * SECOND / 50;
            let way = 1_000_000 + (k * 7919 % 17) * 1_000_000;
            let corrected = self.arrives(self.stamp(sent), sent + way);
            if k > 500 && !corrected.disbelieved {
                self.worst_nanos = self.worst_nanos.max((corrected.measured - sent).abs());
            }
        }
    }

    fn arrives(&mut self, stamp: i64, arrival: i64) -> Corrected {
        let stamps = Stamps { source: Some(stamp), ..Stamps::arrived(arrival) };
        let corrected = self.remote.correct(&stamps);
        self.events.extend(std::iter::from_fn(|| self.remote.next_event()));
        self.disbelieved += usize::from(corrected.disbelieved);
        self.messages += 1;
        corrected
    }

    /// Sends a burst of probes with asymmetric paths; the fastest takes 0.4 ms.
    fn probed(&mut self, at_secs: i64) {
        for k in 0..8 {
            let sent = START + at_secs * SECOND + k * 64_000_000;
            let (there, back) = (250_000 + (k * 5 % 8) * 900_000, 150_000);
            let over_there = self.stamp(sent + there);
            let middle = sent + i64::midpoint(there, back);
            self.remote.probe(&Probe {
                arrival: sent + there + back,
                offset_secs: (over_there - middle) as f64 * 1e-9,
                round_trip_secs: (there + back) as f64 * 1e-9,
            });
        }
    }

    fn run_with_probes(&mut self, from_secs: i64, to_secs: i64) {
        for second in from_secs..to_secs {
            if second % 4 == 0 {
                self.probed(second);
            }
            self.run(second, second + 1);
        }
    }

    fn truth_secs(&self, at_secs: i64) -> f64 {
        (self.ahead_nanos + at_secs * 1_000 * self.fast_ppm) as f64 * 1e-9
    }
}

#[test]
fn a_clock_in_step_is_trusted_and_its_stamps_taken_as_they_are() {
    let mut computer = Computer::new(500_000, 0);
    computer.run(0, 300);
    assert_eq!(computer.worst_nanos, 500_000);
    assert_eq!((computer.disbelieved, computer.events.len()), (0, 0));
    assert_eq!(computer.remote.state().kind, ClockKind::Remote);
    assert!(computer.remote.state().offset_secs.abs() < 0.003);
}

#[test]
fn a_clock_that_is_off_is_shifted_to_within_its_fastest_message() {
    for (ahead_nanos, fast_ppm) in
        [(1_500_000_000, 40), (-1_500_000_000, -40), (-180_000_000, 200), (5_000_000, 200)]
    {
        let mut computer = Computer::new(ahead_nanos, fast_ppm);
        computer.run(0, 300);
        assert!(
            matches!(computer.events[..], [ClockEvent::Off { .. }, ..]),
            "{:?}",
            computer.events
        );
        assert!(computer.worst_nanos < 20_000_000, "{ahead_nanos}: {}", computer.worst_nanos);
        assert!(computer.disbelieved < 30, "{}", computer.disbelieved);
        let state = computer.remote.state();
        let wrong_secs = (state.offset_secs - computer.truth_secs(300)).abs();
        assert!(wrong_secs < 0.004 && wrong_secs < state.uncertainty_secs, "{state:?}");
        assert!((state.skew_ppm - fast_ppm as f64).abs() < 25.0, "{state:?}");
        assert!((0.005..0.02).contains(&state.jitter_secs), "{state:?}");
    }
}

#[test]
fn stamps_alone_cannot_distinguish_a_late_publisher_from_a_clock_that_is_behind() {
    for held_nanos in [20_000_000, 200_000_000, 800_000_000] {
        let mut computer = Computer::new(0, 0);
        for k in 0..1_000 {
            let measured = START + k * SECOND / 50;
            let way = held_nanos + 1_000_000 + (k * 7919 % 17) * 1_000_000;
            let corrected = computer.arrives(measured, measured + way);
            let wrong_secs = (corrected.measured - measured).abs() as f64 * 1e-9;
            let stated_secs = computer.remote.state().uncertainty_secs;
            assert!(k < 50 || wrong_secs <= stated_secs, "{wrong_secs} {stated_secs}");
        }
        let stated_secs = computer.remote.state().uncertainty_secs;
        assert!(stated_secs < held_nanos as f64 * 1e-9 + 0.02, "{stated_secs}");
    }
}

#[test]
fn stamps_after_their_arrival_are_a_clock_that_is_ahead() {
    let mut computer = Computer::new(1_500_000_000, 0);
    computer.run(0, 60);
    let state = computer.remote.state();
    assert!(state.uncertainty_secs < 0.02, "{state:?}");
    assert!((state.offset_secs - 1.5).abs() < state.uncertainty_secs, "{state:?}");
}

#[test]
fn probes_distinguish_a_late_publisher_from_a_clock_that_is_behind() {
    let mut computer = Computer::new(0, 0);
    for k in 0..3_000 {
        let measured = START + k * SECOND / 50;
        if k % 200 == 0 {
            computer.probed(k / 50);
        }
        let corrected = computer.arrives(measured, measured + 201_000_000);
        let wrong_nanos = (corrected.measured - measured).abs();
        assert!(k < 2_000 || wrong_nanos < 1_000_000, "{k}: {wrong_nanos}");
    }
    let state = computer.remote.state();
    assert!(state.uncertainty_secs < 0.002, "{state:?}");
}

#[test]
fn probes_give_the_offset_to_half_their_round_trip() {
    for (ahead_nanos, fast_ppm) in [(1_500_000_000, 40), (-20_000_000, -200), (0, 0)] {
        let mut computer = Computer::new(ahead_nanos, fast_ppm);
        computer.run_with_probes(0, 300);
        let state = computer.remote.state();
        assert_eq!(state.kind, ClockKind::TwoWay);
        let wrong_secs = (state.offset_secs - computer.truth_secs(300)).abs();
        assert!(wrong_secs < 0.000_5 && wrong_secs < state.uncertainty_secs, "{state:?}");
        assert!(state.uncertainty_secs < 0.002, "{state:?}");
        assert!((state.skew_ppm - fast_ppm as f64).abs() < 10.0, "{state:?}");
        assert!(computer.worst_nanos < 2_500_000, "{}", computer.worst_nanos);
    }
}

#[test]
fn after_a_minute_without_probes_timestamps_are_used_again() {
    let mut computer = Computer::new(1_500_000_000, 40);
    computer.run_with_probes(0, 60);
    computer.run(60, 180);
    assert_eq!(computer.remote.state().kind, ClockKind::Remote);
    assert!(computer.worst_nanos < 20_000_000, "{}", computer.worst_nanos);
    assert_eq!(computer.remote.state().epoch, 0);
}

#[test]
fn a_single_stamp_that_is_far_off_moves_nothing() {
    let mut computer = Computer::new(1_500_000_000, 0);
    computer.run(0, 60);
    let (before, believed) = (computer.remote.state(), computer.disbelieved);
    let arrival = START + 60 * SECOND;
    let hour = 3_600 * SECOND;
    let absurd =
        [1, -5, i64::MIN, i64::MAX, arrival + hour, arrival - hour / 6, arrival + 2 * SECOND];
    for stamp in absurd {
        let corrected = computer.arrives(stamp, arrival);
        assert!(corrected.disbelieved, "{stamp}");
        assert_eq!(corrected.measured, arrival);
    }
    let none = computer.arrives(0, arrival);
    assert_eq!((none.measured, none.disbelieved), (arrival, false));
    computer.run(60, 90);
    assert_eq!(computer.disbelieved, believed + absurd.len());
    let after = computer.remote.state();
    assert!((after.offset_secs - before.offset_secs).abs() < 1e-3, "{before:?} {after:?}");
    assert_eq!(after.epoch, 0);
}

#[test]
fn messages_delayed_by_the_network_keep_their_timestamps() {
    let mut computer = Computer::new(0, 0);
    computer.run(0, 60);
    let believed = computer.disbelieved;
    let back = START + 70 * SECOND;
    for k in 60 * 50..80 * 50 {
        let sent = START + k * SECOND / 50;
        let corrected = computer.arrives(sent, (sent + 1_000_000).max(back + k * 1_000));
        assert!((corrected.measured - sent).abs() < 2_000_000, "{k}");
    }
    assert_eq!((computer.disbelieved, computer.events.len()), (believed, 0));
}

/// Delivers samples of a stream that were held until `arrival`; returns the worst error of those placed by
/// their stamps [ns], and how many are not.
fn held(computer: &mut Computer, stream: u32, sent: Range<i64>, arrival: i64) -> (i64, usize) {
    let (mut worst_nanos, mut disbelieved) = (0, 0);
    for sent in sent.step_by(100_000_000) {
        let source = Some(computer.stamp(sent));
        let corrected =
            computer.remote.correct(&Stamps { source, stream, ..Stamps::arrived(arrival) });
        disbelieved += usize::from(corrected.disbelieved);
        worst_nanos = worst_nanos.max((corrected.measured - sent).abs());
    }
    (worst_nanos, disbelieved)
}

#[test]
fn what_was_held_until_probes_were_answered_keeps_its_stamps() {
    // Minutes apart, one that counts from power-on, and one in step.
    for ahead_nanos in [-185 * SECOND, 240 * SECOND, 1_000 * SECOND - START, 0] {
        let mut computer = Computer::new(ahead_nanos, 20);
        computer.probed(0);
        // A regular stream with recent samples, and markers, the first of which are old.
        let known = START + 1_200_000_000;
        assert_eq!(held(&mut computer, 2, known - 200_000_000..known, known).1, 0);
        let (worst_nanos, disbelieved) = held(&mut computer, 1, START..known, known);
        assert!(worst_nanos < 2_000_000, "{ahead_nanos}: {worst_nanos}");
        assert_eq!(disbelieved, 0, "{ahead_nanos}");
        // A stream whose probes were answered seconds later, while the clock is known.
        let second = |secs| START + secs * SECOND;
        computer.run_with_probes(4, 24);
        let (worst_nanos, disbelieved) = held(&mut computer, 3, second(20)..second(23), second(24));
        assert!(worst_nanos < 2_000_000, "{ahead_nanos}: {worst_nanos}");
        assert_eq!(disbelieved, 0, "{ahead_nanos}");
        assert!(computer.events.len() <= 1, "{:?}", computer.events);
        // The first of a stream may not be older than that.
        assert_eq!(held(&mut computer, 4, second(0)..second(0) + 1, second(24)).1, 1);
    }
}

#[test]
fn a_backlog_keeps_its_stamps_though_a_message_is_there_twice_and_another_out_of_order() {
    let mut computer = Computer::new(0, 0);
    computer.run_with_probes(0, 20);
    let second = |secs| START + secs * SECOND;
    let (late, back) = (second(20)..second(40), second(40));
    let mut disbelieved = 0;
    for (place, sent) in late.clone().step_by(50_000_000).enumerate() {
        let stamp = if place == 20 { sent - 120_000_000 } else { sent };
        for _ in 0..=usize::from(place % 50 == 10) {
            let corrected = computer.arrives(stamp, back);
            disbelieved += usize::from(corrected.disbelieved);
            assert!(place == 20 || (corrected.measured - sent).abs() < 2_000_000, "{place}");
        }
    }
    assert_eq!(disbelieved, 1);
    // A stream that began during the outage, in the middle of the backlog.
    let (worst_nanos, disbelieved) = held(&mut computer, 7, second(25)..second(40), back);
    assert!(worst_nanos < 2_000_000 && disbelieved == 0, "{worst_nanos} {disbelieved}");
}

#[test]
fn stored_samples_for_late_joiners_do_not_set_the_clock() {
    let mut computer = Computer::new(0, 0);
    for k in 0..5 {
        let kept = computer.arrives(START - 600 * SECOND + k, START);
        assert!(kept.disbelieved);
    }
    computer.run(0, 60);
    assert_eq!(computer.events, []);
    assert_eq!(computer.disbelieved, 5);
}

#[test]
fn a_clock_that_jumps_begins_an_epoch_within_some_seconds() {
    for (jump, within_secs) in [(-2 * SECOND, 4), (SECOND / 2, 4), (-SECOND / 4, 25)] {
        let mut computer = Computer::new(0, 0);
        computer.run(0, 60);
        computer.ahead_nanos += jump;
        computer.run(60, 60 + within_secs);
        let state = computer.remote.state();
        assert_eq!(state.epoch, 1, "{jump}");
        assert!((state.offset_secs - jump as f64 * 1e-9).abs() < 0.02, "{state:?}");
        assert!(matches!(computer.events[..], [ClockEvent::Jumped { .. }, ClockEvent::Off { .. }]));
        computer.ahead_nanos -= jump;
        computer.run(60 + within_secs, 120);
        assert_eq!(computer.remote.state().epoch, 2);
        assert_eq!(computer.events.last(), Some(&ClockEvent::Trusted), "{:?}", computer.events);
    }
}

#[test]
fn a_clock_that_is_set_in_a_small_step_is_followed_without_one() {
    let mut computer = Computer::new(0, 0);
    computer.run_with_probes(0, 60);
    computer.ahead_nanos = 30_000_000;
    computer.run_with_probes(60, 120);
    let state = computer.remote.state();
    assert!((state.offset_secs - 0.030).abs() < 0.001, "{state:?}");
    assert_eq!(state.epoch, 0);
}

#[test]
fn a_probed_clock_that_was_set_back_by_a_tenth_of_a_second_is_not_reported_minutes_later() {
    for back_millis in [60, 98, 100, 101] {
        let mut computer = Computer::new(-80_000_000, 0);
        computer.run_with_probes(0, 200);
        computer.ahead_nanos -= back_millis * 1_000_000;
        for second in 200..600 {
            computer.ahead_nanos -= 100_000;
            computer.run_with_probes(second, second + 1);
        }
        let state = computer.remote.state();
        assert!((state.offset_secs - computer.truth_secs(600)).abs() < 0.002, "{state:?}");
        assert!(matches!(computer.events[..], [ClockEvent::Off { .. }]), "{:?}", computer.events);
    }
}

/// The fraction of messages whose true time is outside the stated interval [0..1].
fn outside(computer: &mut Computer, seconds: Range<i64>, probe_secs: Option<i64>) -> f64 {
    let (mut outside, mut all) = (0, 0);
    for k in seconds.start * 50..seconds.end * 50 {
        if probe_secs.is_some_and(|every| k % (every * 50) == 0) {
            computer.probed(k / 50);
        }
        let sent = START + k * SECOND / 50;
        let way = 1_000_000 + (k * 7919 % 17) * 1_000_000;
        let corrected = computer.arrives(computer.stamp(sent), sent + way);
        let wrong_secs = (corrected.measured - sent).abs() as f64 * 1e-9;
        all += 1;
        outside += i32::from(wrong_secs > computer.remote.state().uncertainty_secs);
    }
    f64::from(outside) / f64::from(all)
}

#[test]
fn after_a_jump_the_stated_uncertainty_holds_the_truth() {
    for jump in [-500, -250, -60, -30, -12, 12, 30, 60, 150, 250, 500, 5_000, -5_000] {
        for probe_secs in [None, Some(4)] {
            for ahead_nanos in [0, 1_500_000_000] {
                let mut computer = Computer::new(ahead_nanos, 40);
                outside(&mut computer, 0..41, probe_secs);
                computer.ahead_nanos += jump * 1_000_000;
                for (from, to) in [(41, 43), (43, 50), (50, 120)] {
                    let part = outside(&mut computer, from..to, probe_secs);
                    assert!(part <= 0.05, "{jump} ms {probe_secs:?} {ahead_nanos} {from}: {part}");
                }
            }
        }
    }
}

#[test]
fn however_fast_a_clock_runs_the_stated_uncertainty_holds_the_truth() {
    for fast_ppm in [-20_000, -2_000, 2_000, 20_000] {
        for probe_secs in [None, Some(4)] {
            let mut computer = Computer::new(0, fast_ppm);
            for from in [1, 5, 20, 60] {
                let part = outside(&mut computer, from..from * 2, probe_secs);
                assert!(part <= 0.05, "{fast_ppm} ppm {probe_secs:?} {from}: {part}");
            }
        }
    }
}

#[test]
fn a_longer_path_does_not_cast_doubt_on_a_probed_clock() {
    let mut computer = Computer::new(0, 0);
    computer.run_with_probes(0, 60);
    for k in 0..1_000 {
        let sent = START + 60 * SECOND + k * SECOND / 50;
        if k % 200 == 0 {
            computer.probed(60 + k / 50);
        }
        computer.arrives(sent, sent + 40_000_000 + (k * 7919 % 17) * 1_000_000);
    }
    let state = computer.remote.state();
    assert!(state.uncertainty_secs < 0.002, "{state:?}");
}

#[test]
fn simulated_time_is_not_taken_for_a_clock() {
    let mut computer = Computer::new(0, 0);
    for k in 0..5_000 {
        let arrival = START + k * SECOND / 50;
        let corrected = computer.arrives(100 * SECOND + k * SECOND / 5, arrival);
        assert_eq!(corrected.measured, arrival);
    }
}

#[test]
fn probes_of_another_clock_than_that_of_the_stamps_are_not_used() {
    let mut computer = Computer::new(0, 0);
    computer.run(0, 20);
    computer.ahead_nanos = 3_600 * SECOND;
    for second in (20..60).step_by(4) {
        computer.probed(second);
        computer.ahead_nanos = 0;
        computer.run(second, second + 4);
        computer.ahead_nanos = 3_600 * SECOND;
    }
    assert_eq!(computer.remote.state().kind, ClockKind::Remote);
    assert_eq!(computer.events, []);
}

fn any_stamp() -> impl Strategy<Value = i64> {
    prop_oneof![any::<i64>(), -2 * SECOND..2 * SECOND, -200_000_000i64..200_000_000]
}

proptest! {
    #[test]
    fn any_stamps_and_probes_are_handled(
        given in prop::collection::vec(
            (any::<Option<i64>>(), any::<i64>(), any::<u32>(), any::<f64>(), any::<f64>()),
            0..200,
        )
    ) {
        let mut remote = Remote::default();
        for (source, arrival, count, offset_secs, round_trip_secs) in given {
            let period_nanos = offset_secs;
            let stamps = Stamps { source, count, period_nanos, ..Stamps::arrived(arrival) };
            let corrected = remote.correct(&stamps);
            prop_assert!(corrected.measured <= arrival.saturating_add(TRUSTED_AHEAD_NANOS));
            remote.probe(&Probe { arrival, offset_secs, round_trip_secs });
            remote.tick(arrival);
            remote.state();
            prop_assert!(remote.events.len() <= MOST_EVENTS);
        }
    }

    #[test]
    fn within_an_epoch_later_stamps_have_later_times(
        given in prop::collection::vec(
            (0..3 * SECOND, any_stamp(), 0..50_000_000i64, -1.0..1.0f64, 0.0..0.01f64),
            1..300,
        )
    ) {
        let mut remote = Remote::default();
        let (mut arrival, mut last) = (START, None::<(u32, i64, i64)>);
        for (later, stamp, jitter, offset_secs, round_trip_secs) in given {
            arrival += later;
            let source = Some(arrival.saturating_add(stamp).saturating_sub(jitter));
            let corrected = remote.correct(&Stamps { source, ..Stamps::arrived(arrival) });
            prop_assert!(corrected.measured <= arrival + TRUSTED_AHEAD_NANOS);
            let epoch = remote.state().epoch;
            if let (Some(source), false) = (source, corrected.disbelieved) {
                if let Some((_, _, before)) = last.filter(|l| l.0 == epoch && l.1 <= source) {
                    prop_assert!(corrected.measured >= before);
                }
                if last.is_none_or(|l| l.0 != epoch || l.1 <= source) {
                    last = Some((epoch, source, corrected.measured));
                }
            }
            remote.probe(&Probe { arrival, offset_secs, round_trip_secs });
        }
    }
}

/// Sends a device's waves at 2 Hz, each measured 70 ms before its arrival.
fn sends_waves(computer: &mut Computer, from_secs: i64, to_secs: i64) -> (i64, usize) {
    let (mut worst_nanos, mut disbelieved) = (0, 0);
    for k in from_secs * 2..to_secs * 2 {
        let measured = START + k * SECOND / 2;
        let arrival = measured + 70_000_000 + (k * 7919 % 17) * 1_000_000;
        let source = Some(computer.stamp(measured));
        let stamps = Stamps { source, stamp_of: StampOf::Measured, ..Stamps::arrived(arrival) };
        let corrected = computer.remote.correct(&stamps);
        disbelieved += usize::from(corrected.disbelieved);
        worst_nanos = worst_nanos.max((corrected.measured - measured).abs());
        computer.events.extend(std::iter::from_fn(|| computer.remote.next_event()));
    }
    (worst_nanos, disbelieved)
}

#[test]
fn a_device_that_takes_long_is_no_clock_that_is_behind() {
    let mut computer = Computer::new(0, 0);
    assert_eq!(sends_waves(&mut computer, 0, 300), (0, 0));
    assert!(computer.remote.state().offset_secs.is_nan() && computer.events.is_empty());
    // Messages show that the clock is in step, and probes confirm it to within a millisecond.
    computer.run(300, 330);
    assert_eq!(sends_waves(&mut computer, 330, 600), (0, 0));
    for second in (600..640).step_by(4) {
        computer.probed(second);
        assert_eq!(sends_waves(&mut computer, second + 2, second + 4).0, 0);
    }
    assert!(computer.remote.state().uncertainty_secs < 0.005 && computer.events.is_empty());
}

#[test]
fn a_wave_that_lies_after_its_arrival_shows_a_clock_that_is_ahead() {
    let mut computer = Computer::new(600_000_000, 40);
    sends_waves(&mut computer, 0, 30);
    assert!(matches!(computer.events[..], [ClockEvent::Off { .. }]), "{:?}", computer.events);
    let (worst_nanos, _) = sends_waves(&mut computer, 30, 300);
    let state = computer.remote.state();
    assert!(worst_nanos as f64 * 1e-9 <= state.uncertainty_secs, "{worst_nanos} {state:?}");
    assert!(worst_nanos < 100_000_000, "{worst_nanos}");
}

#[test]
fn with_probes_waves_are_placed_to_a_millisecond() {
    for ahead_nanos in [600_000_000, -600_000_000] {
        let mut computer = Computer::new(ahead_nanos, 40);
        for second in 0..60 {
            if second % 4 == 0 {
                computer.probed(second);
            }
            let (worst_nanos, _) = sends_waves(&mut computer, second, second + 1);
            assert!(second < 8 || worst_nanos < 1_000_000, "{ahead_nanos} {second}: {worst_nanos}");
        }
    }
}

/// A wave of one of a computer's many streams.
fn wave_of(stream: u32, measured: i64, arrival: i64) -> Stamps {
    let source = Some(measured);
    Stamps { stream, source, stamp_of: StampOf::Measured, ..Stamps::arrived(arrival) }
}

#[test]
fn waves_that_a_network_held_up_keep_their_stamps_though_nothing_is_known_of_the_clock() {
    let mut remote = Remote::default();
    for k in 0..80 {
        let measured = START + k * SECOND / 2;
        let is_held_up = k >= 60;
        for stream in 0..40 {
            let way = 70_000_000 + (k * 7919 % 17) * 1_000_000;
            let arrival =
                if is_held_up { START + 41 * SECOND + k * 2_000_000 } else { measured + way };
            let corrected = remote.correct(&wave_of(stream, measured, arrival));
            assert!(!is_held_up || corrected.measured == measured, "{stream}: {corrected:?}");
        }
    }
}

#[test]
fn stored_samples_are_placed_by_the_known_clock_and_do_not_affect_it() {
    let mut computer = Computer::new(1_500_000_000, 0);
    computer.run(0, 60);
    let before = computer.remote.state();
    let (happened, arrival) = (START - 600 * SECOND, START + 60 * SECOND);
    let source = Some(computer.stamp(happened));
    let stamps = Stamps { source, stamp_of: StampOf::Kept, ..Stamps::arrived(arrival) };
    let wrong_nanos = computer.remote.correct(&stamps).measured - happened;
    assert!(wrong_nanos.abs() < 10_000_000, "{wrong_nanos}");
    assert_eq!(computer.remote.state(), before);
}
