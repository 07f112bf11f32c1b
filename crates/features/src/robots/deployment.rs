//! The time that a robot has been deployed.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;

use crate::context::{FeatureContext, duration_setting};
use crate::value::{moment, window_of};
use crate::whole_seconds::WholeSeconds;

/// The family of the feature's streams.
pub(crate) const FAMILY: &str = "deployment";

/// The time that a robot has been deployed: its time online since it was first seen, and its
/// outages.
///
/// - Measures: whether the robot publishes on any of its topics, its total time online, the age of
///   its newest sample, and the number of its outages.
/// - Formula: the sum of (last arrival − first arrival) over the stretches without a silence longer
///   than `offline_secs`; a silence that long is an outage and does not count.
/// - Unit: s; 1 for `online` (1 or 0) and `outages`.
/// - Window: none; once a second, and an event at each change.
/// - Reference: Jo et al., "A ROS-based framework for monitoring human and robot conditions in a
///   human-multi-robot team", the robots' deployment time.
/// - Limits: a robot that runs but can't be reached counts as offline. Only messages show that a
///   robot is online: neither the existence of its topics nor the commands of people do. While teampulse itself is
///   suspended, no robot goes offline.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Deployment {
    /// The silence after which a robot is offline [s].
    pub offline_secs: f64,
}

impl Default for Deployment {
    fn default() -> Deployment {
        Deployment { offline_secs: 5.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for Deployment {
    const EXAMPLE: &'static str = "offline_secs = 5";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("offline_secs", self.offline_secs)?;
        Ok(Box::new(self))
    }
}

impl Feature for Deployment {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.about == About::Robot
            && stream.origin == Origin::Raw
            && stream.signal != Signal::Input
            && !stream.id.is_empty()
    }

    fn scope(&self) -> Scope {
        Scope::Subject
    }

    fn start(&self, stream: &Stream) -> Box<dyn Extractor> {
        Box::new(DeploymentExtractor {
            offline_ns: (self.offline_secs * 1e9) as i64,
            robot: stream.id.clone(),
            inputs: Vec::new(),
            outputs: None,
            seconds: WholeSeconds::default(),
            duty: None,
        })
    }
}

struct DeploymentExtractor {
    offline_ns: i64,
    robot: String,
    inputs: Vec<String>,
    outputs: Option<(OutputId, OutputId)>,
    seconds: WholeSeconds,
    duty: Option<Duty>,
}

/// The state of a robot since its first sample.
struct Duty {
    /// Since when the robot has been online; `None` while it is offline.
    since: Option<Time>,
    last_arrival: Time,
    newest_measured: Time,
    /// Time online before `since` [ns].
    before_ns: i64,
    outages: u32,
}

impl Extractor for DeploymentExtractor {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        if !self.inputs.contains(&stream.name) {
            self.inputs.push(stream.name.clone());
        }
        let state = out.declare(self.state_stream(stream));
        let events = out.declare(self.events_stream(stream));
        self.outputs = Some((state, events));
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        self.judge(sample.log_time, out);
        let measured = sample.measured.min(sample.log_time);
        let duty = self.duty.get_or_insert(Duty::unseen(sample.log_time, measured));
        let silence_ns = sample.log_time.nanos_since(duty.last_arrival);
        duty.last_arrival = duty.last_arrival.max(sample.log_time);
        duty.newest_measured = duty.newest_measured.max(measured);
        if duty.since.is_none() {
            duty.since = Some(sample.log_time);
            self.say(sample.log_time, self.online_event(silence_ns), out);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.judge(now, out);
        let second = self.seconds.passed(now);
        if let (Some(second), Some(duty), Some((state, _))) = (second, &self.duty, self.outputs) {
            out.emit(state, second, duty.state_at(second));
        }
    }

    fn stood_still(&mut self, until: Time) {
        if let Some(duty) = self.duty.as_mut().filter(|duty| duty.since.is_some()) {
            duty.last_arrival = duty.last_arrival.max(until);
        }
    }
}

impl DeploymentExtractor {
    /// Detects that the robot has been silent for too long by `now`.
    fn judge(&mut self, now: Time, out: &mut Outputs) {
        let Some(duty) = &mut self.duty else { return };
        let Some(since) = duty.since else { return };
        if now.nanos_since(duty.last_arrival) <= self.offline_ns {
            return;
        }
        duty.before_ns += duty.last_arrival.nanos_since(since);
        duty.since = None;
        duty.outages += 1;
        let gone = Time::from_nanos(duty.last_arrival.nanos().saturating_add(self.offline_ns));
        self.say(gone, self.offline_event(), out);
    }

    fn say(&self, at: Time, event: Event, out: &mut Outputs) {
        if let Some((_, events)) = self.outputs {
            out.emit(events, at, Data::Event(Arc::new(event)));
        }
    }

    fn online_event(&self, silence_ns: i64) -> Event {
        let online = moment(EventKind::Marker, format!("{} online", self.robot));
        Event { duration_secs: silence_ns as f64 / 1e9, ..online }
    }

    fn offline_event(&self) -> Event {
        let offline = moment(EventKind::Fault, format!("{} offline", self.robot));
        Event { value: self.offline_ns as f64 / 1e9, duration_secs: f64::NAN, ..offline }
    }

    fn state_stream(&self, stream: &Stream) -> Stream {
        let channels =
            [("deployed_secs", "s"), ("online", "1"), ("age_secs", "s"), ("outages", "1")];
        let name = format!("/{}/{FAMILY}", self.robot);
        let state = Stream::concluded(name, stream.subject(), FAMILY, Shape::Feature);
        Stream {
            inputs: self.inputs.clone(),
            rate_hz: 1.0,
            method: format!(
                "time from first to last arrival, silences longer than {} s left out",
                self.offline_ns as f64 / 1e9
            ),
            doc: format!("The time that {} has been online, and whether it is.", self.robot),
            ..state.with_channels(&channels)
        }
    }

    fn events_stream(&self, stream: &Stream) -> Stream {
        let state = self.state_stream(stream);
        Stream {
            signal: Signal::Event,
            shape: Shape::Event,
            channels: Vec::new(),
            rate_hz: 0.0,
            doc: format!("When {} goes offline (value: its age [s]) and comes back.", self.robot),
            ..state.below("events")
        }
    }
}

impl Duty {
    fn unseen(arrival: Time, measured: Time) -> Duty {
        Duty {
            since: None,
            last_arrival: arrival,
            newest_measured: measured,
            before_ns: 0,
            outages: 0,
        }
    }

    /// Deployed time, online, age and outages at `now`.
    fn state_at(&self, now: Time) -> Data {
        let current_ns = self.since.map_or(0, |since| self.last_arrival.nanos_since(since));
        let deployed_secs = (self.before_ns + current_ns) as f64 / 1e9;
        let online = f64::from(u8::from(self.since.is_some()));
        let age_secs = now.secs_since(self.newest_measured).max(0.0);
        let values = [deployed_secs, online, age_secs, f64::from(self.outages)];
        window_of(1.0, 1.0, 1.0, &values.map(|value| Ok(Estimate::unstated(value))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::{Drive, built, plain};

    fn drive() -> Drive {
        let stream = plain("/r1/odom", Signal::Odometry, &[("x", "m")]);
        Drive::new(built::<Deployment>("offline_secs = 5").as_ref(), &stream)
    }

    fn online(drive: &mut Drive, secs: std::ops::Range<u32>) {
        secs.for_each(|secs| drive.at(f64::from(secs) + 0.5, &[0.0]));
    }

    #[test]
    fn the_clock_stops_while_a_robot_is_gone_and_goes_on_when_it_is_back() {
        let mut drive = drive();
        online(&mut drive, 0..11);
        drive.until(60.0);
        assert_eq!(drive.last("/r1/deployment").values, [10.0, 0.0, 49.5, 1.0]);
        online(&mut drive, 100..121);
        drive.until(121.0);
        assert_eq!(drive.last("/r1/deployment").values, [30.0, 1.0, 0.5, 1.0]);
    }

    #[test]
    fn each_change_is_reported_once() {
        let mut drive = drive();
        online(&mut drive, 0..11);
        online(&mut drive, 100..121);
        let events = drive.events("/r1/deployment/events");
        let found: Vec<_> = events.iter().map(|(at, e)| (*at, e.kind, e.label.as_str())).collect();
        assert_eq!(
            found,
            [
                (0.5, EventKind::Marker, "r1 online"),
                (15.5, EventKind::Fault, "r1 offline"),
                (100.5, EventKind::Marker, "r1 online"),
            ]
        );
        assert_eq!((events[1].1.value, events[2].1.duration_secs), (5.0, 90.0));
    }

    #[test]
    fn no_robot_goes_offline_while_teampulse_did_not_run() {
        let mut drive = drive();
        online(&mut drive, 0..11);
        drive.stood_still(60.0);
        drive.until(62.0);
        assert_eq!(drive.events("/r1/deployment/events").len(), 1, "it was seen, and no more");
        online(&mut drive, 62..70);
        assert_eq!(drive.last("/r1/deployment").values[3], 0.0, "no outage");
        drive.stood_still(100.0);
        drive.until(110.0);
        let events = drive.events("/r1/deployment/events");
        assert_eq!((events[1].0, events[1].1.label.as_str()), (105.0, "r1 offline"));
    }

    #[test]
    fn deployed_time_never_goes_back() {
        let mut drive = drive();
        online(&mut drive, 0..11);
        online(&mut drive, 13..15);
        online(&mut drive, 40..45);
        let deployed = drive.features("/r1/deployment").into_iter().map(|(_, each)| each.values[0]);
        assert!(deployed.is_sorted());
    }

    #[test]
    fn commands_to_a_robot_do_not_show_that_it_is_online() {
        let commands = plain("/r1/goal_pose", Signal::Input, &[]);
        assert!(!built::<Deployment>("").accepts(&commands));
    }

    #[test]
    fn a_robot_that_was_never_seen_has_no_deployment() {
        let mut drive = drive();
        drive.until(10.0);
        assert!(drive.features("/r1/deployment").is_empty());
    }

    #[test]
    fn a_stamp_from_the_future_is_as_old_as_its_arrival() {
        let mut drive = drive();
        drive.until(10.0);
        drive.late(1e6, &[0.0]);
        drive.until(12.0);
        let age_secs = drive.last("/r1/deployment").values[2];
        assert!((1.8..=2.0).contains(&age_secs), "{age_secs}");
    }

    #[test]
    fn a_late_sample_shows_that_a_robot_is_online_but_has_its_own_age() {
        let mut drive = drive();
        online(&mut drive, 0..11);
        drive.until(13.9);
        drive.late(2.0, &[0.0]);
        drive.until(16.0);
        assert_eq!(drive.last("/r1/deployment").values, [13.5, 1.0, 5.5, 0.0]);
    }
}
