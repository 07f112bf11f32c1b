use super::*;
use crate::clock::simulated::{Device, SECOND};

/// The mean error of a model's times [s].
fn error(clock: &mut dyn ClockModel, sent: &[(i64, Stamps)], least_delay: f64) -> f64 {
    let errors = sent.iter().map(|(truth, stamps)| {
        ((clock.correct(stamps).measured - truth) as f64 / 1e9 - least_delay).abs()
    });
    errors.sum::<f64>() / sent.len() as f64
}

#[test]
fn times_with_hindsight_are_better() {
    let mut device = Device::new(4.0);
    device.rate = 1.0 - 60e-6;
    let sent: Vec<(i64, Stamps)> = (0..2_400).map(|_| device.send()).collect();
    let settings = OneWaySettings::new(Latency::new(0.0018, 0.0));
    let mut smoother = Smoother::new(settings);
    for (_, stamps) in &sent {
        smoother.push(stamps);
    }
    let after = error(&mut smoother.finish(), &sent, device.least_delay);
    let live = error(&mut OneWay::new(settings), &sent, device.least_delay);
    assert!(after < 0.7 * live, "{after} {live}");
}

#[test]
fn a_device_that_was_set_has_an_epoch_before_and_one_after() {
    let mut device = Device::new(10.0);
    device.clock += 7200 * SECOND;
    let mut sent: Vec<(i64, Stamps)> = (0..600).map(|_| device.send()).collect();
    device.clock += 3600 * SECOND;
    sent.extend((0..600).map(|_| device.send()));
    let settings = OneWaySettings::new(Latency::new(0.0, 0.0));
    let mut smoother = Smoother::new(settings);
    for (_, stamps) in &sent {
        smoother.push(stamps);
    }
    let mut smoothed = smoother.finish();
    assert!(error(&mut smoothed, &sent, device.least_delay) < 0.01);
    assert_eq!(smoothed.state().epoch, 1);
}

#[test]
fn the_first_readings_after_a_restart_are_placed_by_those_after_them() {
    let mut device = Device::new(55.0);
    (device.batch, device.tail) = (21, 0.005);
    let mut sent = Vec::new();
    for number in 0..120 {
        if number == 60 || number == 90 {
            (device.now, device.clock) = (device.now + 8 * SECOND, 0);
        }
        // Batches arrive in pairs, those of two streams at the same device times.
        let ((truth, first), second) = (device.send(), device.send());
        for (truth, stamps) in [(truth, Stamps { arrival: second.1.arrival, ..first }), second] {
            sent.extend([1, 2].map(|stream| (truth, Stamps { stream, ..stamps })));
        }
    }
    let mut smoother = Smoother::new(OneWaySettings::new(Latency::new(0.0, 0.0)));
    for (_, stamps) in &sent {
        smoother.push(stamps);
    }
    let mut smoothed = smoother.finish();
    for (number, (truth, stamps)) in sent.iter().enumerate() {
        let error = (smoothed.correct(stamps).measured - truth) as f64 / 1e9;
        assert!(error.abs() < 0.05, "reading {number}: {error} s");
    }
    assert_eq!(smoothed.state().epoch, 2);
}

#[test]
fn a_link_that_is_too_slow_at_the_end_leaves_the_clock_as_sure_as_its_rate() {
    let mut device = Device::new(50.0);
    (device.rate, device.tail) = (1.0 + 80e-6, 0.001);
    let mut sent: Vec<(i64, Stamps)> = (0..30_000).map(|_| device.send()).collect();
    for (number, (_, stamps)) in sent.iter_mut().skip(24_000).enumerate() {
        stamps.arrival += number as i64 * SECOND / 500;
    }
    let mut smoother = Smoother::new(OneWaySettings::new(Latency::new(0.0, 0.0)));
    for (_, stamps) in &sent {
        smoother.push(stamps);
    }
    let mut smoothed = smoother.finish();
    let (mut most, mut before) = (0.0_f64, 0.0);
    for (number, (truth, stamps)) in sent.iter().enumerate() {
        let error = (smoothed.correct(stamps).measured - truth) as f64 / 1e9 - device.least_delay;
        let stated = smoothed.state().uncertainty_secs;
        assert!(number < 24_000 || error.abs() < stated, "{error} s, {stated} s stated");
        assert!(number < 24_200 || stated >= before, "{stated} s after {before} s");
        (most, before) = (most.max(error.abs()), stated);
    }
    assert!(most < 1e-3 && before < 0.01, "{most} s, {before} s stated");
}

#[test]
fn a_last_packet_that_was_held_up_is_smoothed_with_the_others() {
    let mut device = Device::new(10.0);
    let mut sent: Vec<(i64, Stamps)> = (0..600).map(|_| device.send()).collect();
    let (truth, old) = sent[570];
    sent.push((truth, Stamps { arrival: sent[599].1.arrival + 2 * SECOND, ..old }));
    let mut smoother = Smoother::new(OneWaySettings::new(Latency::new(0.0, 0.0)));
    for (_, stamps) in &sent {
        smoother.push(stamps);
    }
    assert!(error(&mut smoother.finish(), &sent, device.least_delay) < 0.01);
}

#[test]
fn a_link_that_seemed_to_beat_for_a_moment_does_not() {
    let mut history = History::default();
    (0..100).for_each(|_| history.beats(0.0));
    (0..10).for_each(|_| history.beats(0.02));
    assert!(history.beat_interval() <= 0.0);
    (0..100).for_each(|_| history.beats(0.02));
    assert!(history.beat_interval() > 0.0);
}

#[test]
fn a_few_points_on_a_line_are_no_surer_than_the_others() {
    let mut device = Device::new(10.0);
    let scattered =
        |place: i32| Point { device: f64::from(2 * place), delay: 0.02 * device.uniform() };
    let mut points: Vec<Point> = (0..400).map(scattered).collect();
    // Between outages.
    points.retain(|point| !(300.0..600.0).contains(&point.device) || point.device % 50.0 < 9.0);
    let between = 300.0..600.0;
    for point in points.iter_mut().filter(|point| between.contains(&point.device)) {
        point.delay = 0.005;
    }
    let bins = points.into_iter().map(|point| Bin { point, is_raised: false }).collect();
    let map = Map::new(&History { bins, ..History::default() }, 50e-6, Stretches::SINGLE);
    assert!(map.error_at(450.0) > 0.8 * map.error_at(100.0));
}

#[test]
fn any_settings_are_smoothed_without_a_panic() {
    for usual_skew_ppm in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300] {
        let latency = Latency::new(f64::NAN, f64::INFINITY);
        let mut device = Device::new(10.0);
        let sent: Vec<(i64, Stamps)> = (0..600).map(|_| device.send()).collect();
        let mut smoother =
            Smoother::new(OneWaySettings { usual_skew_ppm, ..OneWaySettings::new(latency) });
        for (_, stamps) in &sent {
            smoother.push(stamps);
        }
        assert!(error(&mut smoother.finish(), &sent, device.least_delay) < 0.01);
    }
}

proptest::proptest! {
    #[test]
    fn any_stamps_are_smoothed_without_a_panic(
        stamps: Vec<(Option<i64>, i64, u64, u32, f64)>,
    ) {
        let mut smoother = Smoother::new(OneWaySettings::new(Latency::BLUETOOTH));
        let stamps: Vec<Stamps> = stamps
            .into_iter()
            .map(|(device, arrival, index, count, period_nanos)| {
                Stamps { device, index, count, period_nanos, ..Stamps::arrived(arrival) }
            })
            .collect();
        for stamps in &stamps {
            smoother.push(stamps);
        }
        let mut smoothed = smoother.finish();
        for stamps in &stamps {
            smoothed.correct(stamps);
        }
    }
}
