use super::*;
use crate::clock::simulated::{Device, SECOND};

const LATENCY: Latency = Latency::new(0.0, 0.0);

fn model() -> OneWay {
    OneWay::new(OneWaySettings::new(LATENCY))
}

fn events(clock: &mut OneWay) -> Vec<ClockEvent> {
    std::iter::from_fn(|| clock.next_event()).collect()
}

/// Feeds the packets of some seconds to the clock; returns the error of the last sample [s].
fn run(clock: &mut OneWay, device: &mut Device, secs: i64) -> f64 {
    let mut error = f64::NAN;
    let end = device.now + secs * SECOND;
    while device.now < end {
        let (truth, stamps) = device.send();
        error = (clock.correct(&stamps).measured - truth) as f64 / 1e9;
    }
    error
}

#[test]
fn a_steady_clock_is_found_and_nothing_is_reported() {
    let (mut clock, mut device) = (model(), Device::new(10.0));
    device.rate = 1.0 + 40e-6;
    let error = run(&mut clock, &mut device, 300) - device.least_delay;
    assert!(error.abs() < 0.003, "{error}");
    let state = clock.state();
    assert!((state.skew_ppm - 40.0).abs() < 20.0, "{state:?}");
    assert!(state.uncertainty_secs < 0.006 && state.epoch == 0, "{state:?}");
    assert_eq!(events(&mut clock), []);
}

#[test]
fn a_clock_that_runs_two_percent_fast_is_followed_and_reported() {
    for rate in [0.98, 1.02] {
        let (mut clock, mut device) = (model(), Device::new(10.0));
        device.rate = rate;
        run(&mut clock, &mut device, 60);
        for _ in 0..20 {
            let error = run(&mut clock, &mut device, 3) - device.least_delay;
            assert!(error.abs() < 0.01, "{error}");
        }
        let reported = events(&mut clock);
        assert!(matches!(reported[..], [ClockEvent::Fast { .. }]), "{reported:?}");
        assert!((clock.state().skew_ppm - (rate - 1.0) * 1e6).abs() < 100.0);
        assert_eq!(clock.state().epoch, 0);
    }
}

#[test]
fn a_clock_that_is_set_begins_a_new_epoch() {
    for hours in [1, -1] {
        let (mut clock, mut device) = (model(), Device::new(10.0));
        device.clock += 7200 * SECOND;
        run(&mut clock, &mut device, 60);
        device.clock += hours * 3600 * SECOND;
        let error = run(&mut clock, &mut device, 60) - device.least_delay;
        assert!(error.abs() < 0.01, "{error}");
        match events(&mut clock)[..] {
            [ClockEvent::Jumped { epoch: 1, secs }] => {
                assert!((secs - hours as f64 * 3600.0).abs() < 1.0, "{secs}");
            }
            ref reported => panic!("{reported:?}"),
        }
    }
}

#[test]
fn a_device_that_is_switched_on_again_begins_a_new_epoch() {
    let (mut clock, mut device) = (model(), Device::new(10.0));
    device.clock += 7200 * SECOND;
    run(&mut clock, &mut device, 60);
    device.now += 20 * SECOND;
    device.clock = 0;
    let error = run(&mut clock, &mut device, 30) - device.least_delay;
    assert!(error.abs() < 0.02, "{error}");
    assert_eq!(events(&mut clock), [ClockEvent::Restarted { epoch: 1 }]);
}

#[test]
fn a_device_that_is_switched_on_again_soon_begins_a_new_epoch_at_once() {
    for (on, off) in [(3, 2), (8, 5), (9, 60), (17, 5), (25, 3), (90, 4), (250, 2)] {
        let settings =
            OneWaySettings { wraps_nanos: Some(512 * SECOND), ..OneWaySettings::new(LATENCY) };
        let (mut clock, mut device) = (OneWay::new(settings), Device::new(128.0));
        (device.clock, device.wraps) = (0, 512 * SECOND);
        // Three streams of one sensor share its stamps.
        let send = |clock: &mut OneWay, device: &mut Device| {
            let (truth, stamps) = device.send();
            let errors = [0, 1, 2].map(|stream| {
                let measured = clock.correct(&Stamps { stream, ..stamps }).measured;
                (measured - truth) as f64 / 1e9
            });
            errors.iter().fold(0.0, |most: f64, error| most.max(error.abs()))
        };
        let run = |clock: &mut OneWay, device: &mut Device, secs: i64| {
            let end = device.now + secs * SECOND;
            let mut most: f64 = 0.0;
            while device.now < end {
                most = most.max(send(clock, device));
            }
            most
        };
        run(&mut clock, &mut device, on);
        device.now += off * SECOND;
        device.clock = 0;
        let error = run(&mut clock, &mut device, 20);
        assert!(error < 0.3, "{error} s after {on} s on and {off} s off");
        assert_eq!(events(&mut clock), [ClockEvent::Restarted { epoch: 1 }], "{on} {off}");
    }
}

#[test]
fn batches_that_arrive_in_pairs_show_a_restart() {
    let (mut clock, mut device) = (model(), Device::new(55.0));
    (device.batch, device.tail) = (21, 0.005);
    let pair = |clock: &mut OneWay, device: &mut Device| {
        let ((truth, first), (_, second)) = (device.send(), device.send());
        let measured = clock.correct(&Stamps { arrival: second.arrival, ..first }).measured;
        clock.correct(&second);
        (measured - truth) as f64 / 1e9
    };
    for _ in 0..20 {
        pair(&mut clock, &mut device);
    }
    (device.now, device.clock) = (device.now + 2 * SECOND, 0);
    for number in 0..20 {
        let error = pair(&mut clock, &mut device);
        assert!(error.abs() < if number < 3 { 1.0 } else { 0.3 }, "pair {number}: {error}");
    }
    assert_eq!(events(&mut clock), [ClockEvent::Restarted { epoch: 1 }]);
}

#[test]
fn a_counter_that_wraps_goes_on_and_is_reported() {
    let settings =
        OneWaySettings { wraps_nanos: Some(64 * SECOND), ..OneWaySettings::new(LATENCY) };
    let (mut clock, mut device) = (OneWay::new(settings), Device::new(10.0));
    device.wraps = 64 * SECOND;
    let error = run(&mut clock, &mut device, 200) - device.least_delay;
    assert!(error.abs() < 0.01, "{error}");
    assert_eq!(events(&mut clock), [ClockEvent::Wrapped; 3]);
    assert_eq!(clock.state().epoch, 0);
}

#[test]
fn a_repeated_or_reordered_packet_keeps_its_time() {
    let (mut clock, mut device) = (model(), Device::new(10.0));
    let mut sent = Vec::new();
    for _ in 0..600 {
        let (_, stamps) = device.send();
        sent.push((clock.correct(&stamps).measured, stamps));
    }
    let arrival = sent[599].1.arrival;
    for (measured, stamps) in &sent[560..] {
        let again = clock.correct(&Stamps { arrival, ..*stamps });
        assert_eq!(again.measured, *measured);
    }
    assert_eq!(events(&mut clock), []);
}

#[test]
fn a_stamp_of_zero_is_disbelieved_and_changes_nothing() {
    let (mut clock, mut device) = (model(), Device::new(10.0));
    run(&mut clock, &mut device, 60);
    for device in [0, i64::MIN, i64::MAX, 0, 0, 0] {
        let arrival = 1_700_000_061 * SECOND;
        let corrected = clock.correct(&Stamps { device: Some(device), ..Stamps::arrived(arrival) });
        assert_eq!((corrected.measured, corrected.disbelieved), (arrival, true));
    }
    let error = run(&mut clock, &mut device, 30) - device.least_delay;
    assert!(error.abs() < 0.01, "{error}");
    assert_eq!(events(&mut clock), []);
}

#[test]
fn a_clock_that_stood_still_for_a_second_begins_a_new_epoch() {
    let (mut clock, mut device) = (model(), Device::new(10.0));
    run(&mut clock, &mut device, 60);
    device.clock -= SECOND;
    let error = run(&mut clock, &mut device, 30) - device.least_delay;
    assert!(error.abs() < 0.02, "{error}");
    assert!(
        matches!(events(&mut clock)[..], [ClockEvent::Jumped { epoch: 1, secs }] if secs < -0.9)
    );
}

#[test]
fn one_device_does_not_change_anothers_times() {
    let mut devices = [Device::new(10.0), Device::new(13.0)];
    let alone = devices.clone().map(|mut device| {
        let mut clock = model();
        (0..500).map(|_| clock.correct(&device.send().1)).collect::<Vec<_>>()
    });
    let (mut clocks, mut together) = ([model(), model()], [Vec::new(), Vec::new()]);
    for _ in 0..500 {
        for (number, device) in devices.iter_mut().enumerate() {
            together[number].push(clocks[number].correct(&device.send().1));
        }
    }
    assert!(together == alone);
}

#[test]
fn the_uncertainty_shrinks_to_that_of_the_latency() {
    let latency = Latency::BLUETOOTH;
    let (mut clock, mut device) = (OneWay::new(OneWaySettings::new(latency)), Device::new(10.0));
    assert!(clock.state().uncertainty_secs.is_nan());
    clock.correct(&device.send().1);
    let first = clock.state().uncertainty_secs;
    run(&mut clock, &mut device, 600);
    let last = clock.state().uncertainty_secs;
    assert!(first > 2.0 * last && last > latency.uncertainty_secs, "{first} {last}");
    assert!(last < 1.01 * latency.uncertainty_secs, "{last}");
}

#[test]
fn many_packets_with_little_delay_make_a_young_clock_sure_soon() {
    let stated = |rate_hz: f64, tail: f64| {
        let (mut clock, mut device) = (model(), Device::new(rate_hz));
        (device.tail, device.rate) = (tail, 1.0 + 40e-6);
        run(&mut clock, &mut device, 120);
        clock.state().uncertainty_secs
    };
    let (many, few) = (stated(50.0, 0.001), stated(1.0, 0.02));
    assert!(many < 0.6e-3 && few > 0.15 / 121.0, "{many} s, {few} s");
}

#[test]
fn a_late_burst_after_a_stall_is_no_jump() {
    let (mut clock, mut device) = (model(), Device::new(10.0));
    run(&mut clock, &mut device, 60);
    let until = device.now + 30 * SECOND;
    for _ in 0..300 {
        let (truth, stamps) = device.send();
        let late = Stamps { arrival: stamps.arrival.max(until), ..stamps };
        let error = clock.correct(&late).measured - truth;
        assert!(error.abs() < SECOND / 20, "{error}");
    }
    assert_eq!(events(&mut clock), []);
}

#[test]
fn batches_follow_each_other_though_their_period_is_nominal() {
    let (mut clock, mut device) = (model(), Device::new(130.0));
    (device.batch, device.rate) = (73, 0.98); // by its clock a sample comes early
    let mut end = i64::MIN;
    for batch in 0..200 {
        let (_, stamps) = device.send();
        let corrected = clock.correct(&stamps);
        assert!(corrected.measured > end, "batch {batch}");
        let last = 72.0 * corrected.period_nanos;
        end = corrected.measured + last as i64;
        if batch > 60 {
            let period = corrected.period_nanos / device.period as f64;
            assert!((period - 1.0).abs() < 0.002, "{period}");
        }
    }
}

#[test]
fn a_clock_that_is_set_by_little_is_found_within_a_second_by_its_numbers() {
    for step_ms in [-600, -265, -80, -75, -60, 60, 265, 600] {
        let (mut clock, mut device) = (model(), Device::new(50.0));
        run(&mut clock, &mut device, 120);
        device.clock += step_ms * 1_000_000;
        let error = run(&mut clock, &mut device, 1) - device.least_delay;
        assert!(error.abs() < 0.01, "{step_ms}: {error}");
        let reported = events(&mut clock);
        let [ClockEvent::Jumped { epoch: 1, secs }] = reported[..] else {
            panic!("{step_ms}: {reported:?}")
        };
        assert!((secs - step_ms as f64 / 1e3).abs() < 0.005, "{step_ms}: {secs}");
    }
}

#[test]
fn a_clock_that_is_set_back_while_packets_queue_is_found() {
    let (mut clock, mut device) = (model(), Device::new(50.0));
    (device.least_delay, device.tail) = (0.02, 0.001);
    run(&mut clock, &mut device, 120);
    device.least_delay = 0.11;
    for packet in 0..20 {
        if packet == 5 {
            device.clock -= 350 * 1_000_000;
        }
        clock.correct(&device.send().1);
    }
    device.least_delay = 0.02;
    let error = run(&mut clock, &mut device, 10) - device.least_delay;
    assert!(error.abs() < 0.01, "{error}");
    let reported = events(&mut clock);
    assert!(matches!(reported[..], [ClockEvent::Jumped { epoch: 1, .. }]), "{reported:?}");
}

#[test]
fn packets_that_are_sent_once_more_in_a_row_are_no_clock_that_was_set_back() {
    for packets in 1..=4 {
        let (mut clock, mut device) = (model(), Device::new(50.0));
        run(&mut clock, &mut device, 120);
        let mut last: Vec<Stamps> = Vec::new();
        for round in 0..2_000 {
            let (_, stamps) = device.send();
            last.push(stamps);
            clock.correct(&stamps);
            if round % 50 == 49 {
                let arrival = stamps.arrival;
                for again in last.split_off(last.len() - packets) {
                    // A driver that numbers packets on arrival gives each repeat its own index.
                    device.index += 1;
                    let index = device.index - 1;
                    clock.correct(&Stamps { arrival, index, ..again });
                }
                last.clear();
            }
        }
        assert_eq!(events(&mut clock), [], "{packets}");
    }
}

#[test]
fn a_period_that_is_declared_wrong_is_reported_and_corrected() {
    for wrong in [0.25, 0.7, 1.5, 4.0] {
        let (mut clock, mut device) = (model(), Device::new(130.0));
        device.batch = 73;
        let mut worst = 0.0_f64;
        for k in 0..200 {
            let (truth, stamps) = device.send();
            let declared = Stamps { period_nanos: stamps.period_nanos * wrong, ..stamps };
            let corrected = clock.correct(&declared);
            let last = corrected.measured as f64 + 72.0 * corrected.period_nanos;
            let true_last = truth as f64 + 72.0 * stamps.period_nanos;
            if k > 100 {
                let error = (last - true_last) / 1e9 - device.least_delay;
                worst = worst.max(error.abs());
            }
        }
        let reported = events(&mut clock);
        let [ClockEvent::WrongRate { hz, .. }] = reported[..] else {
            panic!("{wrong}: {reported:?}")
        };
        assert!((hz - 130.0).abs() < 0.1 && worst < 0.015, "{wrong}: {hz} Hz, {worst} s");
    }
}

#[test]
fn a_clock_that_runs_fast_is_found_within_16_seconds() {
    for ppm in [-2000, -900, 900, 2000] {
        let (mut clock, mut device) = (model(), Device::new(10.0));
        (device.rate, device.tail) = (1.0 + f64::from(ppm) * 1e-6, 0.010);
        run(&mut clock, &mut device, 16);
        let reported = events(&mut clock);
        let [ClockEvent::Fast { ppm: found }] = reported[..] else { panic!("{ppm}: {reported:?}") };
        assert!((found - f64::from(ppm)).abs() < 500.0, "{ppm}: {found}");
    }
}

#[test]
fn a_link_that_is_too_slow_from_the_first_packet_on_is_no_slow_clock() {
    let (mut clock, mut device) = (model(), Device::new(50.0));
    let mut worst = 0.0_f64;
    for k in 0..50 * 1_200 {
        let (truth, stamps) = device.send();
        let held_up = k * 20_000_000 / 5; // a fifth too slow
        let stamps = Stamps { arrival: stamps.arrival + held_up, ..stamps };
        let error = (clock.correct(&stamps).measured - truth) as f64 / 1e9 - device.least_delay;
        worst = worst.max(if k > 50 * 30 { error.abs() } else { 0.0 });
    }
    assert_eq!(events(&mut clock), []);
    assert!(worst < 0.2, "{worst}");
}

#[test]
fn a_route_that_is_longer_for_minutes_does_not_move_the_clock_and_is_stated() {
    let (mut clock, mut device) = (model(), Device::new(50.0));
    run(&mut clock, &mut device, 300);
    let least = device.least_delay;
    device.least_delay += 0.080;
    let error = run(&mut clock, &mut device, 200) - least;
    assert!(error.abs() < 0.005, "{error}");
    assert!(clock.state().uncertainty_secs > 0.07, "{:?}", clock.state());
    device.least_delay = least;
    let error = run(&mut clock, &mut device, 60) - least;
    assert!(error.abs() < 0.005 && clock.state().uncertainty_secs < 0.01, "{error}");
    assert_eq!(events(&mut clock), []);
}

#[test]
fn waits_for_link_events_that_fall_with_each_of_a_few_packets_are_no_fast_clock() {
    let (mut clock, mut device) = (model(), Device::new(1.0));
    device.tail = 0.0;
    for packet in 0..60 {
        let wait = 2_500_000 * (14 - packet % 15);
        let (_, stamps) = device.send();
        clock.correct(&Stamps { arrival: stamps.arrival + wait, ..stamps });
    }
    assert_eq!(events(&mut clock), []);
}

#[test]
fn waits_for_link_events_that_change_steadily_from_packet_to_packet_are_no_fast_clock() {
    let mut random = Device::new(1.0);
    for session in 0..400 {
        // Batches of 73 samples at 130 Hz, over intervals of 7.5 to 50 ms.
        let (mut clock, mut device) = (model(), Device::new(130.0));
        (device.batch, device.tail, device.least_delay) = (73, 0.0, 0.0);
        let interval = 1_250_000 * (6 + session % 35);
        device.now += (random.uniform() * interval as f64) as i64;
        while device.clock < 125 * SECOND {
            let (_, stamps) = device.send();
            let again = i64::from(random.uniform() < 0.1);
            let arrival = (stamps.arrival / interval + 1 + again) * interval;
            clock.correct(&Stamps { arrival, ..stamps });
        }
        assert_eq!(events(&mut clock), [], "{session}");
    }
}

#[test]
fn first_packets_that_were_held_up_do_not_delay_all_times_or_look_like_a_clock_that_was_set() {
    for held_millis in [300, 1_000, 5_000, 9_000] {
        let (mut clock, mut device) = (model(), Device::new(2.0));
        let up = device.now + held_millis * SECOND / 1_000;
        let start = device.now;
        let mut error = f64::NAN;
        while device.now < start + 60 * SECOND {
            let (truth, stamps) = device.send();
            let stamps = Stamps { arrival: stamps.arrival.max(up), ..stamps };
            error = (clock.correct(&stamps).measured - truth) as f64 / 1e9 - device.least_delay;
            let settles = up + 3 * (up - start) + SECOND;
            assert!(truth < settles || error.abs() < 0.25, "{held_millis}: {error}");
        }
        assert!(error.abs() < 0.05, "{held_millis}: {error}");
        assert_eq!(events(&mut clock), [], "{held_millis}");
    }
}

#[test]
fn a_perfect_clock_of_few_packets_makes_no_news() {
    for tenths_hz in [10, 15, 20, 30, 50] {
        let (mut clock, mut device) = (model(), Device::new(f64::from(tenths_hz) / 10.0));
        run(&mut clock, &mut device, 600);
        assert_eq!(events(&mut clock), [], "{tenths_hz}");
    }
}

proptest::proptest! {
    #[test]
    fn any_stamps_are_placed_without_a_panic(
        wraps: Option<i64>,
        stamps: Vec<(Option<i64>, i64, u64, u32, f64)>,
    ) {
        let settings = OneWaySettings { wraps_nanos: wraps, ..OneWaySettings::new(LATENCY) };
        let mut clock = OneWay::new(settings);
        for (device, arrival, index, count, period_nanos) in stamps {
            let arrived = Stamps::arrived(arrival);
            clock.correct(&Stamps { device, index, count, period_nanos, ..arrived });
            clock.state();
        }
    }

    #[test]
    fn time_is_strictly_increasing_in_device_time(
        packets in proptest::collection::vec((4_i64..4_000_000_000, 0_i64..2_000_000_000), 2..200),
    ) {
        let mut clock = model();
        let (mut device, mut placed) = (0, Vec::new());
        for (step, delay) in packets {
            device += step;
            let stamps = Stamps { device: Some(device), ..Stamps::arrived(device + delay) };
            let corrected = clock.correct(&stamps);
            if !corrected.disbelieved {
                placed.push((clock.state().epoch, device, corrected.measured));
            }
        }
        for pair in placed.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            proptest::prop_assert!(pair[0].2 < pair[1].2, "{:?}", pair);
        }
    }
}

#[test]
fn behind_a_long_silence_a_clock_runs_as_it_did() {
    let mut device = Device::new(52.0);
    (device.rate, device.tail) = (1.0 + 45e-6, 0.004);
    let mut clock = OneWay::new(OneWaySettings::new(Latency::new(0.0, 0.0)));
    for _ in 0..52 * 300 {
        clock.correct(&device.send().1);
    }
    device.now += 900 * SECOND;
    device.clock += (900.0 * 1e9 * device.rate) as i64;
    for _ in 0..52 * 60 {
        let (truth, stamps) = device.send();
        let error = (clock.correct(&stamps).measured - truth) as f64 / 1e9 - device.least_delay;
        assert!(error.abs() < 0.01 && error.abs() <= clock.state().uncertainty_secs, "{error}");
    }
    assert_eq!(clock.next_event(), None);
    assert!((clock.state().skew_ppm - 45.0).abs() < 5.0, "{}", clock.state().skew_ppm);
}
