//! Laws of the team as a whole.

use std::ops::Range;
use std::time::Duration;

use crate::task::{Plan, What};

use super::arena::{Point, ROUTER};
use super::robot::RADIUS_M;
use super::script::{Change, Scene};
use super::telegram::{Body, Gauge};
use super::{Settings, SimTime, Team, Telegram, Topic};

fn after(secs: f64) -> SimTime {
    SimTime::START + Duration::from_secs_f64(secs)
}

/// A team after a few seconds, with everything that it published.
struct TeamRun {
    team: Team,
    telegrams: Vec<Telegram>,
}

impl TeamRun {
    fn new(settings: &Settings, secs: f64) -> TeamRun {
        let mut run = TeamRun { team: Team::new(settings), telegrams: Vec::new() };
        run.team.advance(after(secs), &mut run.telegrams);
        run
    }

    fn of(&self, robot: &str, topic: Topic) -> Vec<&Telegram> {
        let published = self.team.published();
        let wanted = |each: &&Telegram| {
            published[each.stream].robot == robot && published[each.stream].topic == topic
        };
        self.telegrams.iter().filter(wanted).collect()
    }
}

fn names(robots: u32) -> Vec<String> {
    (1..=robots).map(|number| format!("robot{number}")).collect()
}

/// The usual rates, except for one topic [Hz].
fn rates_with(topic: Topic, rate_hz: f64) -> Vec<(Topic, f64)> {
    let mut rates = Settings::default().rates;
    rates.retain(|(usual, _)| *usual != topic);
    rates.push((topic, rate_hz));
    rates
}

fn only_odometry() -> Settings {
    let rates = vec![(Topic::Odom, 20.0)];
    Settings { robots: names(1), obstacles: 0, rates, ..Settings::default() }
}

/// A change to a whole robot.
fn scene(robot: &str, secs: Range<f64>, what: Change) -> Scene {
    let (from_secs, to_secs) = (secs.start, Some(secs.end));
    Scene { robot: robot.into(), topic: None, from_secs, to_secs, what }
}

/// The odometry of one robot with a change from second 10 to second 20.
fn odometry_with(what: Change) -> Vec<Telegram> {
    let scene = scene("robot1", 10.0..20.0, what);
    TeamRun::new(&Settings { script: vec![scene], ..only_odometry() }, 30.0).telegrams
}

fn during(telegrams: &[Telegram], from_secs: f64, to_secs: f64) -> Vec<&Telegram> {
    let window = after(from_secs)..after(to_secs);
    telegrams.iter().filter(|each| window.contains(&each.at)).collect()
}

fn gauge(telegram: &Telegram) -> Gauge {
    match telegram.body {
        Body::Battery(gauge) => gauge,
        ref other => panic!("{other:?}"),
    }
}

fn power_w(telegram: &Telegram) -> f64 {
    let reading = gauge(telegram).reading;
    reading.voltage_v * reading.current_a
}

fn at(telegram: &Telegram) -> Point {
    match telegram.body {
        Body::Motion(pose, _) => pose.at,
        ref other => panic!("{other:?}"),
    }
}

fn signal_dbm(telegram: &Telegram) -> f64 {
    match telegram.body {
        Body::Reception(reception) => reception.signal_dbm,
        ref other => panic!("{other:?}"),
    }
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// Ranks from 0, with the mean rank for equal values.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = |value: &f64| {
        let below = sorted.partition_point(|other| other < value);
        let up_to = sorted.partition_point(|other| other <= value);
        (below + up_to - 1) as f64 / 2.0
    };
    values.iter().map(rank).collect()
}

/// Spearman's rank correlation.
fn rank_correlation(xs: &[f64], ys: &[f64]) -> f64 {
    let (xs, ys) = (ranks(xs), ranks(ys));
    let (mean_x, mean_y) = (mean(xs.clone()), mean(ys.clone()));
    let product = |us: &[f64], mean_u: f64, vs: &[f64], mean_v: f64| {
        us.iter().zip(vs).map(|(u, v)| (u - mean_u) * (v - mean_v)).sum::<f64>()
    };
    let (xx, yy) = (product(&xs, mean_x, &xs, mean_x), product(&ys, mean_y, &ys, mean_y));
    product(&xs, mean_x, &ys, mean_y) / (xx * yy).sqrt()
}

#[test]
fn the_same_seed_gives_the_same_telegrams_and_another_gives_others() {
    let rates = rates_with(Topic::Camera, 1.0);
    let settings = |seed| Settings { seed, rates: rates.clone(), ..Settings::default() };
    let telegrams = |seed| TeamRun::new(&settings(seed), 20.0).telegrams;
    assert_eq!(telegrams(1), telegrams(1));
    assert_ne!(telegrams(1), telegrams(2));
}

#[test]
fn it_does_not_matter_in_which_portions_time_passes() {
    let settings = Settings::default();
    let mut team = Team::new(&settings);
    let mut telegrams = Vec::new();
    while team.next() <= after(10.0) {
        team.advance(team.next(), &mut telegrams);
    }
    assert_eq!(telegrams, TeamRun::new(&settings, 10.0).telegrams);
}

#[test]
fn what_is_watched_does_not_change_what_happens() {
    let truth = |settings: &Settings| {
        let run = TeamRun::new(settings, 60.0);
        run.of("robot2", Topic::TruePose).into_iter().map(at).collect::<Vec<_>>()
    };
    let faulty = scene("robot1", 5.0..f64::INFINITY, Change::Outage);
    let watched = Settings { script: vec![faulty], ..Settings::default() };
    assert_eq!(truth(&Settings::default()), truth(&watched));
}

#[test]
fn robots_stay_in_the_arena_and_out_of_boxes() {
    for seed in 0..5 {
        let settings =
            Settings { seed, rates: rates_with(Topic::TruePose, 20.0), ..Settings::default() };
        let run = TeamRun::new(&settings, 300.0);
        for robot in &settings.robots {
            let truth = run.of(robot, Topic::TruePose);
            assert!(truth.len() > 5990, "{}", truth.len());
            for telegram in truth {
                let at = at(telegram);
                assert!(run.team.arena().is_free(at, RADIUS_M), "seed {seed}, {robot}: {at:?}");
            }
        }
    }
}

#[test]
fn robots_do_not_drive_through_each_other() {
    let settings = Settings { robots: names(10), ..Settings::default() };
    let mut team = Team::new(&settings);
    for tick in 0..300 * 20 {
        team.advance(after(f64::from(tick) / 20.0), &mut Vec::new());
        let bodies: Vec<_> = team.robots().iter().map(super::robot::Robot::body).collect();
        for (k, body) in bodies.iter().enumerate() {
            assert!(bodies[..k].iter().all(|other| body.gap_m(*other) > -1e-9), "tick {tick}");
        }
    }
}

#[test]
fn every_robot_hears_the_router_worse_the_farther_it_is() {
    for seed in 1..=8 {
        let settings =
            Settings { seed, rates: rates_with(Topic::TruePose, 5.0), ..Settings::default() };
        let run = TeamRun::new(&settings, 600.0);
        for robot in &settings.robots {
            let signals: Vec<f64> =
                run.of(robot, Topic::Wifi).into_iter().map(signal_dbm).collect();
            let truth = run.of(robot, Topic::TruePose);
            let far: Vec<f64> =
                truth.into_iter().map(|each| at(each).distance_m(ROUTER).ln()).collect();
            let both = signals.len().min(far.len());
            let correlation = rank_correlation(&signals[..both], &far[..both]);
            assert!(correlation < -0.7, "seed {seed}, {robot}: {correlation}");
        }
    }
}

#[test]
fn the_team_starts_far_from_the_router_where_all_hear_it_weakly() {
    for seed in 1..=8 {
        let settings = Settings { seed, ..Settings::default() };
        let run = TeamRun::new(&settings, 600.0);
        for robot in &settings.robots {
            let signals: Vec<f64> =
                run.of(robot, Topic::Wifi).into_iter().map(signal_dbm).collect();
            let (start_dbm, best_dbm) = (
                mean(signals[..50].iter().copied()),
                signals.iter().copied().fold(f64::MIN, f64::max),
            );
            assert!(start_dbm < best_dbm - 8.0, "seed {seed}, {robot}: {start_dbm}, {best_dbm}");
        }
    }
}

#[test]
fn the_energy_drawn_is_the_power_over_time() {
    let run = TeamRun::new(&Settings::default(), 600.0);
    for (k, robot) in run.team.robots().iter().enumerate() {
        let reported = run.of(&format!("robot{}", k + 1), Topic::BatteryState);
        let energy_j = mean(reported.into_iter().map(power_w)) * 600.0;
        let drawn_j = robot.pack().drawn_j();
        assert!((energy_j / drawn_j - 1.0).abs() < 0.01, "{energy_j} J, {drawn_j} J");
    }
}

#[test]
fn only_the_robot_whose_load_rises_draws_more() {
    let scene = scene("robot4", 250.0..420.0, Change::CpuFactor(2.5));
    let settings = Settings { script: vec![scene], ..Settings::default() };
    let run = TeamRun::new(&settings, 600.0);
    for robot in &settings.robots {
        let reports = run.of(robot, Topic::BatteryState);
        let mean_w = |from_secs: f64, to_secs: f64| {
            let window = after(from_secs)..after(to_secs);
            mean(reports.iter().filter(|each| window.contains(&each.at)).map(|each| power_w(each)))
        };
        let rise = mean_w(250.0, 420.0) / mean_w(0.0, 250.0);
        let fall = mean_w(420.0, 600.0) / mean_w(0.0, 250.0);
        if robot == "robot4" {
            assert!(rise > 1.5, "{rise}");
        } else {
            assert!((0.9..1.1).contains(&rise), "{robot}: {rise}");
        }
        assert!((0.9..1.1).contains(&fall), "{robot}: {fall}");
    }
}

#[test]
fn a_battery_of_twenty_watt_hours_lasts_about_an_hour_and_then_the_robot_is_silent() {
    let settings =
        Settings { rates: vec![(Topic::Odom, 1.0), (Topic::TruePose, 1.0)], ..only_odometry() };
    let run = TeamRun::new(&settings, 7200.0);
    let last = run.of("robot1", Topic::Odom).last().unwrap().at;
    let lasted_secs = last.secs();
    assert!((3000.0..6000.0).contains(&lasted_secs), "{lasted_secs} s");
    assert!(run.team.robots()[0].pack().is_cut_off());
    assert!(run.of("robot1", Topic::TruePose).last().unwrap().at > after(7198.0));
}

#[test]
fn every_topic_comes_at_its_rate() {
    let mut settings = Settings { rates: rates_with(Topic::Camera, 2.0), ..Settings::default() };
    settings.rates.push((Topic::Temperature, 0.5));
    let run = TeamRun::new(&settings, 100.0);
    for (index, published) in run.team.published().iter().enumerate() {
        let count = run.telegrams.iter().filter(|each| each.stream == index).count() as f64;
        let expected = 100.0 * published.rate_hz;
        assert!((count - expected).abs() <= 1.0, "{published:?}: {count}");
    }
}

#[test]
fn a_dead_robot_is_silent_and_stands_still_until_it_is_on_again() {
    let telegrams = odometry_with(Change::Dead);
    assert!(during(&telegrams, 10.0, 20.0).is_empty());
    let (before, then) = (during(&telegrams, 0.0, 10.0), during(&telegrams, 20.0, 30.0));
    assert!(then.len() > 195);
    assert!(at(before.last().unwrap()).distance_m(at(then[0])) < 0.05);
}

#[test]
fn a_dead_topic_is_silent_alone() {
    let scene =
        Scene { topic: Some(Topic::Wifi), ..scene("robot1", 10.0..f64::INFINITY, Change::Dead) };
    let run = TeamRun::new(&Settings { script: vec![scene], ..Settings::default() }, 30.0);
    assert!(run.of("robot1", Topic::Wifi).last().unwrap().at < after(10.0));
    assert!(run.of("robot1", Topic::Odom).last().unwrap().at > after(29.0));
    assert!(run.of("robot2", Topic::Wifi).last().unwrap().at > after(29.0));
}

#[test]
fn an_outage_loses_messages_while_the_robot_goes_on() {
    let telegrams = odometry_with(Change::Outage);
    assert!(during(&telegrams, 10.0, 20.0).is_empty());
    let before = at(during(&telegrams, 0.0, 10.0).last().unwrap());
    assert!(before.distance_m(at(during(&telegrams, 20.0, 30.0)[0])) > 0.3);
}

#[test]
fn a_stuck_sensor_repeats_its_values_with_new_stamps() {
    let telegrams = odometry_with(Change::Stuck);
    let stuck = during(&telegrams, 10.0, 20.0);
    assert!(stuck.len() > 195);
    assert!(stuck.windows(2).all(|two| two[0].body == two[1].body));
    assert!(stuck.windows(2).all(|two| two[0].stamp < two[1].stamp));
    let then = during(&telegrams, 20.0, 30.0);
    assert!(then[0].body != stuck[0].body);
}

#[test]
fn a_slowed_topic_comes_at_a_part_of_its_rate() {
    let telegrams = odometry_with(Change::SlowFactor(4.0));
    assert!((49..=51).contains(&during(&telegrams, 10.0, 20.0).len()));
    assert!((199..=201).contains(&during(&telegrams, 20.0, 30.0).len()));
}

#[test]
fn a_drifting_clock_runs_away_from_the_time_of_arrival() {
    let telegrams = odometry_with(Change::ClockDriftPpm(500.0));
    let drifting = during(&telegrams, 10.0, 20.0);
    let ahead_secs = |each: &Telegram| each.stamp.secs() - each.at.secs();
    assert!(ahead_secs(drifting[0]) < 1e-4);
    let last_secs = ahead_secs(drifting.last().unwrap());
    assert!((last_secs - 0.005).abs() < 1e-4, "{last_secs}");
}

#[test]
fn a_jumping_clock_is_ahead_at_once() {
    let telegrams = odometry_with(Change::ClockJumpSecs(-2.5));
    let off = |each: &&Telegram| each.stamp.nanos() - each.at.nanos() != -2_500_000_000;
    assert!(!during(&telegrams, 10.0, 20.0).iter().any(off));
    assert!(during(&telegrams, 20.0, 30.0).iter().all(off));
}

#[test]
fn a_duplicate_has_the_same_stamp_and_values() {
    let telegrams = odometry_with(Change::Duplicate);
    let twice = during(&telegrams, 10.0, 19.9);
    let mut pairs: Vec<_> = twice.iter().map(|each| (each.stamp, &each.body)).collect();
    assert!(pairs.len() > 2 * 195);
    pairs.dedup();
    assert!((twice.len() as f64 / pairs.len() as f64 - 2.0).abs() < 0.02);
}

#[test]
fn out_of_order_every_other_message_comes_after_its_successor() {
    let telegrams = odometry_with(Change::OutOfOrder);
    let back = |telegrams: &[&Telegram]| {
        telegrams.windows(2).filter(|two| two[1].stamp < two[0].stamp).count()
    };
    assert!(back(&during(&telegrams, 10.0, 20.0)) >= 98);
    assert_eq!(back(&during(&telegrams, 0.0, 10.0)), 0);
}

#[test]
fn a_sagging_battery_shows_less_voltage() {
    let scene = scene("robot2", 10.0..20.0, Change::BatterySagV(1.5));
    let settings = Settings { script: vec![scene], ..Settings::default() };
    let run = TeamRun::new(&settings, 30.0);
    let mean_v = |from_secs: f64, to_secs: f64| {
        let window = after(from_secs)..after(to_secs);
        let reports = run.of("robot2", Topic::BatteryState);
        mean(
            reports
                .into_iter()
                .filter(|each| window.contains(&each.at))
                .map(|each| gauge(each).reading.voltage_v),
        )
    };
    assert!(mean_v(10.0, 20.0) < mean_v(0.0, 10.0) - 1.3);
    assert!(mean_v(20.0, 30.0) > mean_v(0.0, 10.0) - 0.2);
}

fn commanded(people: u32, script: Vec<Scene>) -> Settings {
    let task = Plan { baseline_secs: 1.0, level_secs: 900.0, ..Plan::default() };
    Settings {
        robots: names(2),
        people,
        obstacles: 0,
        boxes: 0,
        task,
        script,
        ..Settings::default()
    }
}

fn goals(run: &TeamRun, robot: &str) -> Vec<(f64, Point)> {
    let goal = |telegram: &&Telegram| match telegram.body {
        Body::Goal(pose) => (telegram.stamp.secs(), pose.at),
        ref other => panic!("{other:?}"),
    };
    run.of(robot, Topic::GoalPose).iter().map(goal).collect()
}

#[test]
fn robots_are_commanded_when_the_people_of_the_same_seed_command_them() {
    let settings = commanded(2, Vec::new());
    let run = TeamRun::new(&settings, 300.0);
    let mut given = Vec::new();
    for number in 1..=2 {
        let mut task = settings.task_of_person(number);
        while let Some(happening) = task.next_until(300.0) {
            if let What::Command { robot } = happening.what {
                given.push((happening.at_secs, robot));
            }
        }
    }
    given.sort_by(|one, other| one.0.total_cmp(&other.0));
    let stamped = |robot: u32| {
        let of_robot = given.iter().filter(move |(_, commanded)| *commanded == robot);
        of_robot.map(|(at_secs, _)| (at_secs * 1e6).round()).collect::<Vec<_>>()
    };
    assert!(given.len() > 10, "{}", given.len());
    for robot in 0..2 {
        let sent = goals(&run, &format!("robot{}", robot + 1)).into_iter();
        assert_eq!(sent.map(|goal| (goal.0 * 1e6).round()).collect::<Vec<_>>(), stamped(robot));
    }
}

#[test]
fn a_robot_drives_where_it_is_reported_to() {
    let settings = commanded(1, Vec::new());
    let seldom = Plan { commands_per_min: 1.0, ..settings.task.clone() };
    let run = TeamRun::new(&Settings { robots: names(1), task: seldom, ..settings }, 900.0);
    let goals = goals(&run, "robot1");
    // Those after which it has time until the next.
    let calm = goals.windows(2).filter(|two| two[1].0 - two[0].0 > 45.0);
    let nearest_m = calm.map(|two| {
        let driving = after(two[0].0)..after(two[0].0 + 45.0);
        let odometry = run.of("robot1", Topic::Odom).into_iter();
        let during = odometry.filter(|each| driving.contains(&each.at));
        during.map(|each| at(each).distance_m(two[0].1)).fold(f64::INFINITY, f64::min)
    });
    let nearest_m: Vec<f64> = nearest_m.collect();
    assert!(nearest_m.len() > 2 && nearest_m.iter().all(|each| *each < 0.6), "{nearest_m:?}");
}

#[test]
fn what_a_robot_out_of_reach_is_reported_has_no_effect() {
    let out_of_reach = ["robot1", "robot2"].map(|robot| scene(robot, 0.0..300.0, Change::Outage));
    let course = |people| {
        let run = TeamRun::new(&commanded(people, out_of_reach.to_vec()), 120.0);
        assert_eq!(people > 0, !goals(&run, "robot1").is_empty());
        run.of("robot1", Topic::TruePose).into_iter().map(at).collect::<Vec<Point>>()
    };
    assert_eq!(course(1), course(0));
}

#[test]
fn a_team_without_people_is_not_commanded() {
    let run = TeamRun::new(&commanded(0, Vec::new()), 30.0);
    assert!(run.team.published().iter().all(|each| each.topic != Topic::GoalPose));
}
