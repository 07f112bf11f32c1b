use crate::clock::simulated::SECOND;
use crate::clock::{ClockModel, Latency, OneWay, OneWaySettings, Smoother, Stamps};

/// The approximate time of the second step, from which on the truth is known [s].
const KNOWN_SECS: i64 = 1050;

/// The packets of a clock that runs 100 ppm fast, sent every `period` over a link with events every
/// `interval` [ns]: their stamps, and the true time of measurement [ns]. Every fiftieth packet fails and is
/// sent again at the next event.
fn beating(period: i64, interval: i64, secs: i64) -> Vec<(Stamps, i64)> {
    let packet = |number: i64| {
        let device = number * period;
        let truth = 1_700_000_000 * SECOND + device - device / 10_000;
        let failed = interval * i64::from(number % 50 == 7);
        let arrival = (truth / interval + 1) * interval + failed + (number * 7919) % 200_000;
        let device = Some(device + 5 * SECOND);
        (Stamps { device, index: number as u64, ..Stamps::arrived(arrival) }, truth)
    };
    let mut packets: Vec<_> = (0..secs * SECOND / period).map(packet).collect();
    let mut newest = i64::MIN;
    for (stamps, _) in &mut packets {
        newest = newest.max(stamps.arrival);
        stamps.arrival = newest;
    }
    packets
}

fn settings() -> OneWaySettings {
    OneWaySettings::new(Latency::new(0.0, 0.0))
}

/// The error of each packet's time, and the stated uncertainty [ms].
fn errors(clock: &mut dyn ClockModel, packets: &[(Stamps, i64)]) -> Vec<(f64, f64)> {
    let error = |(stamps, truth): &(Stamps, i64)| {
        let error = (clock.correct(stamps).measured - truth) as f64 / 1e6;
        (error, clock.state().uncertainty_secs * 1e3)
    };
    packets.iter().map(error).collect()
}

#[test]
fn behind_the_second_step_of_a_saw_tooth_the_truth_is_known() {
    let packets = beating(SECOND / 20, SECOND / 20, 2000);
    let errors = errors(&mut OneWay::new(settings()), &packets);
    let (before, after) = errors.split_at(KNOWN_SECS as usize * 20);
    for (error, stated) in &before[20 * 60..] {
        assert!(error.abs() <= *stated, "{error} ms, {stated} stated");
    }
    for (error, stated) in after {
        assert!(error.abs() < 2.0 && error.abs() <= *stated, "{error} ms, {stated} stated");
        assert!(*stated < 10.0, "{stated} ms stated");
    }
}

#[test]
fn until_the_interval_is_recognised_it_is_stated_how_long_packets_may_have_waited() {
    let packets = beating(SECOND / 10, SECOND / 20, 120);
    for (error, stated) in &errors(&mut OneWay::new(settings()), &packets)[64..] {
        assert!(error.abs() <= *stated, "{error} ms, {stated} ms stated");
    }
}

#[test]
fn packets_held_up_and_delivered_at_once_lie_on_no_lattice() {
    let held_up = 190..256;
    let packet = |number: i64| {
        let truth = 1_700_000_000 * SECOND + number * SECOND / 50;
        let sent =
            if held_up.contains(&number) { truth + (256 - number) * SECOND / 50 } else { truth };
        let device = Some(truth + 5 * SECOND);
        let arrival = sent + (number * 7919) % 200_000;
        (Stamps { device, index: number as u64, ..Stamps::arrived(arrival) }, truth)
    };
    let packets: Vec<_> = (0..50 * 600).map(packet).collect();
    for (error, stated) in &errors(&mut OneWay::new(settings()), &packets)[50 * 300..] {
        assert!(error.abs() <= *stated && *stated < 1.0, "{error} ms, {stated} ms stated");
    }
}

#[test]
fn the_more_even_the_steps_the_less_is_stated() {
    let packets = beating(SECOND / 125, SECOND / 125, 1200);
    let errors = errors(&mut OneWay::new(settings()), &packets);
    let most = |from_secs: usize, to_secs: usize| {
        let within = &errors[from_secs * 125..to_secs * 125];
        for (error, stated) in within {
            assert!(error.abs() <= *stated, "{error} ms, {stated} stated");
        }
        within.iter().map(|(_, stated)| *stated).fold(0.0, f64::max)
    };
    // A tooth lasts 80 s.
    let (first, last) = (most(300, 400), most(1100, 1200));
    assert!(last < 0.75 * first, "{first} ms stated after three steps, {last} ms after thirteen");
}

#[test]
fn the_more_steadily_delays_change_between_steps_the_less_is_stated() {
    let last_stated = |rough_nanos: i64| {
        let mut packets = beating(SECOND / 125, SECOND / 125, 1200);
        for (number, (stamps, _)) in packets.iter_mut().enumerate() {
            stamps.arrival += number as i64 / 250 * 7919 % rough_nanos;
        }
        let errors = errors(&mut OneWay::new(settings()), &packets);
        errors[1100 * 125..].iter().map(|(_, stated)| *stated).fold(0.0, f64::max)
    };
    let (steady, rough) = (last_stated(1), last_stated(200_000));
    assert!(steady < 0.85 * rough, "{steady} ms, {rough} ms");
}

#[test]
fn with_hindsight_the_truth_in_all_of_a_saw_tooth_is_known() {
    let packets = beating(SECOND / 20, SECOND / 20, 2000);
    let mut smoother = Smoother::new(settings());
    for (stamps, _) in &packets {
        smoother.push(stamps);
    }
    for (error, stated) in errors(&mut smoother.finish(), &packets) {
        assert!(error.abs() < 1.0 && error.abs() <= stated, "{error} ms, {stated} stated");
    }
}

#[test]
fn polled_data_are_off_by_at_most_half_an_interval_before_a_step() {
    let interval = 8_000_000;
    let packets = beating(interval, interval, 70);
    let packets: Vec<_> =
        packets.into_iter().filter(|(stamps, _)| stamps.index % 50 != 7).collect();
    let errors = errors(&mut OneWay::new(settings()), &packets);
    for (error, stated) in &errors[errors.len() / 2..] {
        assert!(error.abs() < 4.3 && error.abs() <= *stated, "{error} ms, {stated} stated");
    }
}
