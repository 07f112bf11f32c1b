use std::time::Duration;

use super::*;

fn status(life: &Life, now: Time) -> StreamStatus {
    life.status("/x", now, &crate::clocks::UNKNOWN, None)
}

/// Simulates `secs` seconds from `from_secs` on, with `rate` samples in each.
fn live(life: &mut Life, from_secs: i64, secs: i64, rate: i64) -> Time {
    for second in from_secs..from_secs + secs {
        for k in 0..rate {
            let nanos = second * 1_000_000_000 + k * 1_000_000_000 / rate;
            let now = Time::from_nanos(nanos);
            life.arrived(1, now, now, None);
        }
        life.second(Time::from_nanos((second + 1) * 1_000_000_000));
    }
    Time::from_nanos((from_secs + secs) * 1_000_000_000)
}

#[test]
fn a_stream_without_samples_is_never_ok() {
    let life = Life::new(5.0);
    assert_eq!(status(&life, Time::from_nanos(1)).state, State::Never);
}

#[test]
fn a_standstill_of_the_session_is_no_silence_of_a_stream() {
    let mut life = Life::new(5.0);
    let stopped = live(&mut life, 0, 20, 5);
    let woke = stopped + Duration::from_secs(60);
    life.stood_still(woke);
    (21..=80).for_each(|second| life.second(Time::from_stamp(second, 0)));
    assert_eq!(status(&life, woke).state, State::Ok);
    let back = live(&mut life, 80, 1, 5);
    assert_eq!(status(&life, back).state, State::Ok, "{}", status(&life, back).reason);
    let gone = back + Duration::from_secs(6);
    assert_eq!(status(&life, gone).state, State::Dead);
    // A stream that does not come back is silent.
    let mut life = Life::new(5.0);
    live(&mut life, 0, 20, 5);
    life.stood_still(woke);
    let status = status(&life, woke + Duration::from_secs(6));
    assert_eq!((status.state, &*status.reason), (State::Dead, "silent for 66.2 s"));
}

#[test]
fn samples_that_arrive_several_at_a_time_are_not_silent_in_between() {
    let mut life = Life::new(0.0);
    for second in 1..=120 {
        // Pulse intervals, as they come from a wrist.
        if second % 5 == 0 {
            for k in 0..(6 + second % 2) as u32 {
                let now = Time::from_stamp(second, k * 1_000_000);
                life.arrived(1, now, now, None);
            }
        }
        let now = Time::from_stamp(second, 900_000_000);
        life.second(now);
        let status = status(&life, now);
        assert!(second < 5 || status.state == State::Ok, "{second}: {}", status.reason);
    }
    let silent = status(&life, Time::from_stamp(140, 0));
    assert_eq!((silent.state, &*silent.reason), (State::Stale, "silent for 20.0 s"));
}

#[test]
fn a_stream_without_samples_is_reported_now_and_then() {
    let mut life = Life::new(0.0);
    let reported = |life: &mut Life, from_secs: i64, secs: i64| {
        let seconds = from_secs..from_secs + secs;
        let due = seconds.filter(|second| {
            life.second(Time::from_stamp(*second as i32 + 1, 0));
            life.is_due()
        });
        due.count()
    };
    assert_eq!(reported(&mut life, 0, 10), 1);
    assert_eq!(reported(&mut life, 10, 290), 9);
    live(&mut life, 300, 1, 5);
    assert_eq!(
        reported(&mut life, 301, 60),
        60,
        "once a sample came the status is published every second"
    );
}

#[test]
fn a_learned_rate_is_held_against_the_stream() {
    let mut life = Life::new(0.0);
    let now = live(&mut life, 0, 20, 10);
    assert_eq!(status(&life, now).state, State::Ok);
    let now = live(&mut life, 20, 12, 4);
    let status = status(&life, now);
    assert_eq!(
        (status.state, status.reason.as_str()),
        (State::Degraded, "4.0 Hz instead of 10.0 Hz")
    );
}

#[test]
fn an_irregular_stream_is_never_dead() {
    let mut life = Life::irregular();
    live(&mut life, 0, 20, 10);
    let now = live(&mut life, 20, 100, 0);
    assert_eq!(status(&life, now).state, State::Ok);
}

#[test]
fn a_run_counts_as_the_samples_in_it() {
    for declared_hz in [0.0, 128.0] {
        let mut life = Life::new(declared_hz);
        for quarter in 1..=60 {
            let now = Time::from_nanos(quarter * 250_000_000);
            life.arrived(32, now, now, None);
            if quarter % 4 == 0 {
                life.second(now);
            }
        }
        let status = status(&life, Time::from_nanos(15_000_000_000));
        assert_eq!((status.state, status.reason.as_str()), (State::Ok, ""));
        assert!((status.rate_hz - 128.0).abs() < 1e-9, "{}", status.rate_hz);
        assert_eq!(status.received, 60);
    }
}

#[test]
fn silence_is_stale_then_dead_and_ends() {
    let mut life = Life::new(2.0);
    let now = live(&mut life, 0, 10, 2);
    let after = |secs: u64| now + std::time::Duration::from_secs(secs);
    assert_eq!(status(&life, after(2)).state, State::Stale);
    assert_eq!(status(&life, after(6)).state, State::Dead);
    live(&mut life, 10, 6, 0);
    let now = live(&mut life, 16, 12, 2);
    assert_eq!(status(&life, now).state, State::Ok);
}

#[test]
fn a_silence_while_learning_does_not_lower_the_rate() {
    let mut life = Life::new(0.0);
    live(&mut life, 0, 3, 20);
    let now = live(&mut life, 3, 8, 0);
    assert_eq!(status(&life, now).state, State::Dead, "silent for 8 s");
    let now = live(&mut life, 11, 30, 20);
    assert_eq!(status(&life, now).state, State::Ok);
    let now = live(&mut life, 41, 2, 0);
    assert_eq!(status(&life, now).state, State::Stale);
}

#[test]
fn a_burst_while_learning_does_not_raise_the_rate() {
    for (held_up_from, held_up_secs) in [(2, 3), (6, 3), (15, 4), (30, 4)] {
        let mut life = Life::new(0.0);
        live(&mut life, 0, held_up_from, 20);
        live(&mut life, held_up_from, held_up_secs, 0);
        let resumed = held_up_from + held_up_secs;
        let at_once = Time::from_nanos(resumed * 1_000_000_000);
        (0..20 * held_up_secs).for_each(|_| life.arrived(1, at_once, at_once, None));
        let now = live(&mut life, resumed, 25, 20);
        assert_eq!(status(&life, now).reason, "", "held up after {held_up_from} s");
        let now = live(&mut life, resumed + 25, 15, 10);
        assert_eq!(status(&life, now).reason, "10.0 Hz instead of 20.0 Hz");
    }
}

#[test]
fn losses_are_unknown_until_reported() {
    let mut life = Life::new(0.0);
    let now = live(&mut life, 0, 1, 5);
    assert_eq!(status(&life, now).lost_source, None);
    life.lost_on_the_way(Some(0));
    assert_eq!(status(&life, now).lost_source, Some(0));
    life.lost_on_the_way(Some(3));
    life.second(now);
    let status = status(&life, now);
    assert_eq!((status.lost_source, status.state), (Some(3), State::Degraded));
}
