//! Outages of people's sensors: when one falls silent or gets stuck, and when it is back.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;

use crate::context::{FeatureContext, duration_setting};
use crate::value::moment;

/// A silence is longer than this many of the stream's usual intervals.
const USUAL_INTERVALS: f64 = 3.0;
/// Samples within this time are one arrival [s]: some devices send the samples of five seconds at once.
const BURST_SECS: f64 = 0.02;
/// Samples that follow each other that closely for this long are not a burst but a fast stream [s].
const LONGEST_BURST_SECS: f64 = 0.5;
/// The longest assumed interval of a stream with a single sample so far [s].
const SLOWEST_SECS: f64 = 60.0;
/// Signals whose numbers never stay constant for long on a living body.
const RESTLESS: [Signal; 7] = [
    Signal::Ecg,
    Signal::Ppg,
    Signal::Eda,
    Signal::Emg,
    Signal::Eeg,
    Signal::Respiration,
    Signal::Acceleration,
];

/// Faults when a sensor of a person falls silent or gets stuck, and markers when it recovers.
///
/// - Measures: silences of each stream of a person's signal, and times in which its numbers do not change
///   at all (ECG, PPG, skin conductance, EMG, EEG, breathing and acceleration).
/// - Formula: a silence longer than `silent_secs` and than three usual intervals between arrivals is a
///   fault at the time of the last sample; so are unchanged numbers for `stalled_secs`, at the time of the
///   first of them. A marker states when the stream is back, and how long it was gone.
/// - Unit: s (the duration of the marker).
/// - Window: none; judged at each sample and tick.
/// - Reference: as for robots, Zahumenský (2004), "Guidelines on quality control procedures for data from
///   automatic weather stations", WMO: the checks on missing data and on minimum variability.
/// - Limits: a sensor that never appeared is not detected here; one that is off the body but noisy shows in the quality
///   of its signal.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Outages {
    /// How long a stream may be silent [s].
    pub silent_secs: f64,
    /// How long the numbers of a stream may stay the same [s].
    pub stalled_secs: f64,
}

impl Default for Outages {
    fn default() -> Outages {
        Outages { silent_secs: 5.0, stalled_secs: 30.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for Outages {
    const EXAMPLE: &'static str = "silent_secs = 5\nstalled_secs = 30";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("silent_secs", self.silent_secs)?;
        duration_setting("stalled_secs", self.stalled_secs)?;
        Ok(Box::new(self))
    }
}

impl Feature for Outages {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.about == About::Person
            && stream.origin == Origin::Raw
            && stream.signal != Signal::Input
            && !stream.is_reported_on_change()
            && matches!(stream.shape, Shape::Sample | Shape::Wave)
    }

    fn start(&self, stream: &Stream) -> Box<dyn Extractor> {
        Box::new(OutagesExtractor {
            settings: *self,
            name: short_name(stream),
            output: None,
            readout: None,
            presence: None,
            run: None,
        })
    }
}

struct OutagesExtractor {
    settings: Outages,
    name: String,
    output: Option<OutputId>,
    readout: Option<Readout>,
    presence: Option<Presence>,
    run: Option<Run>,
}

/// The arrivals of a stream so far.
struct Presence {
    last_arrival: Time,
    /// The start of the current burst.
    burst_began: Time,
    /// The end of the newest sample.
    newest: Time,
    /// The number of intervals between arrivals, and their sum, without silences [s].
    intervals: f64,
    came_secs: f64,
    is_silent: bool,
    /// Until when nothing could be received, as teampulse itself was suspended.
    deaf_until: Option<Time>,
}

impl Presence {
    /// The arrivals of a stream whose first sample arrives at this time.
    fn since(arrival: Time, newest: Time) -> Presence {
        Presence {
            last_arrival: arrival,
            burst_began: arrival,
            newest,
            intervals: 0.0,
            came_secs: 0.0,
            is_silent: false,
            deaf_until: None,
        }
    }

    /// Learns the usual interval from the next arrival, unless a silence precedes it.
    fn arrive(&mut self, at: Time, was_silent: bool) {
        let was_deaf = self.deaf_until.is_some_and(|until| until > self.last_arrival);
        let waited_secs = at.secs_since(self.last_arrival);
        let is_burst = waited_secs < BURST_SECS;
        if was_silent || was_deaf {
            self.burst_began = at;
        } else if !is_burst {
            self.came_after(waited_secs, at);
        } else if at.secs_since(self.burst_began) >= LONGEST_BURST_SECS {
            self.came_after(BURST_SECS, at);
        }
        self.last_arrival = at;
    }

    fn came_after(&mut self, interval_secs: f64, at: Time) {
        self.intervals += 1.0;
        self.came_secs += interval_secs;
        self.burst_began = at;
    }
}

/// Consecutive samples with the same numbers.
struct Run {
    numbers: Vec<f64>,
    since: Time,
    is_reported: bool,
}

impl Extractor for OutagesExtractor {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        let is_restless = RESTLESS.contains(&stream.signal);
        self.readout = Readout::of(stream).filter(|_| is_restless);
        self.output = Some(out.declare(events(stream, &self.settings)));
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        self.judge(sample.log_time, out);
        self.arrive(sample, out);
        self.compare(sample, out);
    }

    /// A late sample ends a silence, too.
    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.judge(sample.log_time, out);
        self.arrive(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.judge(now, out);
    }

    fn stood_still(&mut self, until: Time) {
        let Some(presence) = &mut self.presence else { return };
        presence.deaf_until = presence.deaf_until.max(Some(until));
    }
}

impl OutagesExtractor {
    /// Detects a silence that has become too long by `now`.
    fn judge(&mut self, now: Time, out: &mut Outputs) {
        let Some(presence) = &mut self.presence else { return };
        let is_known = presence.intervals > 0.0;
        let usual_secs =
            if is_known { presence.came_secs / presence.intervals } else { SLOWEST_SECS };
        let limit_secs = self.settings.silent_secs.max(USUAL_INTERVALS * usual_secs);
        let heard =
            presence.deaf_until.map_or(presence.last_arrival, |it| it.max(presence.last_arrival));
        if presence.is_silent || now.secs_since(heard) <= limit_secs {
            return;
        }
        presence.is_silent = true;
        // A stream that stands still and then falls silent has one outage.
        self.run = None;
        let silent = moment(EventKind::Fault, format!("{} silent", self.name));
        let since = presence.newest;
        self.say(since, Event { duration_secs: f64::NAN, ..silent }, out);
    }

    fn arrive(&mut self, sample: &Sample, out: &mut Outputs) {
        let newest = end_of(sample);
        let Some(presence) = &mut self.presence else {
            self.presence = Some(Presence::since(sample.log_time, newest));
            return;
        };
        let gone_secs = sample.measured.secs_since(presence.newest).max(0.0);
        let was_silent = std::mem::take(&mut presence.is_silent);
        presence.arrive(sample.log_time, was_silent);
        presence.newest = presence.newest.max(newest);
        if was_silent {
            let back = moment(EventKind::Marker, format!("{} is back", self.name));
            self.say(sample.measured, Event { duration_secs: gone_secs, ..back }, out);
        }
    }

    /// Compares the numbers of a sample or of a wave with the previous ones.
    fn compare(&mut self, sample: &Sample, out: &mut Outputs) {
        let Some(mut readout) = self.readout.take() else { return };
        if let Some(numbers) = readout.read(&sample.data) {
            let width = match &sample.data {
                Data::Wave(wave) => wave.channels.max(1) as usize,
                _ => numbers.len().max(1),
            };
            for (place, numbers) in numbers.chunks_exact(width).enumerate() {
                let after_ns = (sample.period_ns * place as f64).round() as i64;
                let at = Time::from_nanos(sample.measured.nanos().saturating_add(after_ns));
                self.compare_one(numbers, at, out);
            }
        }
        self.readout = Some(readout);
    }

    fn compare_one(&mut self, numbers: &[f64], at: Time, out: &mut Outputs) {
        if numbers.iter().all(|number| number.is_nan()) {
            return;
        }
        let is_same = |run: &&mut Run| {
            let pairs = run.numbers.iter().zip(numbers);
            run.numbers.len() == numbers.len()
                && pairs.into_iter().all(|(a, b)| a.total_cmp(b).is_eq())
        };
        let Some(run) = self.run.as_mut().filter(is_same) else {
            self.change(numbers, at, out);
            return;
        };
        if !run.is_reported && at.secs_since(run.since) >= self.settings.stalled_secs {
            run.is_reported = true;
            let since = run.since;
            let stalled = moment(EventKind::Fault, format!("{} stands still", self.name));
            self.say(since, Event { duration_secs: f64::NAN, ..stalled }, out);
        }
    }

    /// Notes that the numbers have changed.
    fn change(&mut self, numbers: &[f64], at: Time, out: &mut Outputs) {
        let since = self.run.as_ref().filter(|run| run.is_reported).map(|run| run.since);
        match &mut self.run {
            Some(run) => {
                run.numbers.clear();
                run.numbers.extend(numbers);
                (run.since, run.is_reported) = (at, false);
            }
            None => {
                self.run = Some(Run { numbers: numbers.to_vec(), since: at, is_reported: false });
            }
        }
        if let Some(since) = since {
            let moves = moment(EventKind::Marker, format!("{} changes again", self.name));
            self.say(at, Event { duration_secs: at.secs_since(since), ..moves }, out);
        }
    }

    fn say(&self, at: Time, event: Event, out: &mut Outputs) {
        if let Some(output) = self.output {
            out.emit(output, at, Data::Event(Arc::new(event)));
        }
    }
}

/// The time of the last sample of a wave.
fn end_of(sample: &Sample) -> Time {
    let samples = match &sample.data {
        Data::Wave(wave) => wave.samples.len() / wave.channels.max(1) as usize,
        _ => 1,
    };
    let length_ns = (sample.period_ns * samples.saturating_sub(1) as f64).round() as i64;
    Time::from_nanos(sample.measured.nanos().saturating_add(length_ns))
}

/// The name of a stream for display: `p001/polar_h10/ecg`.
fn short_name(stream: &Stream) -> String {
    let subject = stream.subject();
    match subject.within(&stream.name) {
        whole if whole == stream.name => whole.to_owned(),
        within => format!("{}/{within}", subject.id),
    }
}

fn events(input: &Stream, settings: &Outages) -> Stream {
    let Outages { silent_secs, stalled_secs } = settings;
    Stream {
        signal: Signal::Event,
        device: input.device.clone(),
        method: format!(
            "silent for more than {silent_secs} s and three usual intervals, or the same numbers for \
             {stalled_secs} s; of a return the duration is how long it was gone"
        ),
        doc: format!("When {} falls silent or gets stuck, and when it is back.", input.name),
        ..Stream::derived(input, "outages", Shape::Event)
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::data::Wave;
    use teampulse_core::sample::Turn;
    use teampulse_core::stream::Subject;

    use super::*;

    /// An ECG in waves of a quarter of a second, sampled at 100 Hz.
    struct Ecg {
        watch: Box<dyn Extractor>,
        out: Outputs,
    }

    impl Ecg {
        fn new() -> Ecg {
            let subject = Subject { about: About::Person, id: "p1".into() };
            let stream = Stream::raw("/humans/persons/p1/strap/ecg", subject, Shape::Wave);
            let stream = Stream { signal: Signal::Ecg, rate_hz: 100.0, ..stream };
            let stream = stream.with_channels(&[("ecg", "mV")]);
            let feature = Outages::default();
            assert!(feature.accepts(&stream));
            let (mut watch, mut out) = (feature.start(&stream), Outputs::new());
            watch.join(StreamId(0), &stream, &mut out);
            Ecg { watch, out }
        }

        /// Delivers it from one quarter of a second to another, half a second late.
        fn come(&mut self, quarters: std::ops::Range<i64>, value: impl Fn(i64) -> f64) {
            for quarter in quarters {
                let samples = (0..25).map(|k| value(quarter * 25 + k)).collect();
                let measured = Time::from_nanos(quarter * 250_000_000);
                let log_time = Time::from_nanos(quarter * 250_000_000 + 500_000_000);
                self.watch.tick(log_time, &mut self.out);
                let sample = Sample {
                    stream: StreamId(0),
                    measured,
                    log_time,
                    device_time: None,
                    source_time: None,
                    period_ns: 1e7,
                    index: quarter as u64,
                    turn: Turn::OnTime,
                    data: Data::Wave(Wave { period_ns: 1e7, channels: 1, samples }),
                };
                self.watch.push(&sample, &mut self.out);
            }
        }

        /// Delivers a single sample, measured when it arrives.
        fn arrive(&mut self, at_nanos: i64, value: f64) {
            let log_time = Time::from_nanos(at_nanos);
            let sample = Sample {
                stream: StreamId(0),
                measured: log_time,
                log_time,
                device_time: None,
                source_time: None,
                period_ns: 0.0,
                index: 0,
                turn: Turn::OnTime,
                data: Data::Sample(Arc::new([value])),
            };
            self.watch.push(&sample, &mut self.out);
        }

        fn pass(&mut self, to_secs: i32) {
            self.watch.tick(Time::from_stamp(to_secs, 0), &mut self.out);
        }

        /// The time [s], the kind and label, and the duration [s] of each event.
        fn reported(&self) -> Vec<(f64, String, f64)> {
            let events = self.out.samples().map(|(_, at, data)| {
                let Data::Event(event) = data else { panic!("no event") };
                (at.secs(), format!("{} {}", event.kind, event.label), event.duration_secs)
            });
            events.collect()
        }
    }

    fn beat(k: i64) -> f64 {
        (k as f64 / 10.0).sin()
    }

    #[test]
    fn a_sensor_that_dies_and_returns_is_reported_with_its_times() {
        let mut ecg = Ecg::new();
        ecg.come(0..40, beat);
        ecg.pass(15);
        assert!(ecg.reported().is_empty(), "silent for less than five seconds");
        ecg.pass(16);
        let events = ecg.reported();
        assert_eq!(events.len(), 1);
        assert_eq!((events[0].0, events[0].1.as_str()), (9.99, "fault p1/strap/ecg silent"));
        ecg.come(80..120, beat);
        let events = ecg.reported();
        assert_eq!(events.len(), 2);
        assert_eq!((events[1].0, events[1].1.as_str()), (20.0, "marker p1/strap/ecg is back"));
        assert!((events[1].2 - 10.01).abs() < 1e-9, "{events:?}");
    }

    #[test]
    fn no_sensor_is_silent_while_teampulse_did_not_run() {
        let mut ecg = Ecg::new();
        ecg.come(0..40, beat);
        ecg.watch.stood_still(Time::from_stamp(60, 0));
        ecg.pass(64);
        ecg.come(256..280, beat);
        ecg.pass(75);
        assert!(ecg.reported().is_empty(), "{:?}", ecg.reported());
        ecg.pass(76);
        assert_eq!(ecg.reported().len(), 1, "a silence after that is one, by its usual interval");
    }

    #[test]
    fn a_sensor_that_stalls_and_goes_on_is_reported_with_its_times() {
        let mut ecg = Ecg::new();
        ecg.come(0..40, beat);
        ecg.come(40..240, |_| 0.25);
        ecg.come(240..280, beat);
        let events = ecg.reported();
        let [(stalled, fault, _), (moves, marker, secs)] = events.as_slice() else {
            panic!("{events:?}")
        };
        assert_eq!((*stalled, fault.as_str()), (10.0, "fault p1/strap/ecg stands still"));
        assert_eq!(
            (*moves, marker.as_str(), *secs),
            (60.0, "marker p1/strap/ecg changes again", 50.0)
        );
    }

    #[test]
    fn a_stream_of_bursts_is_not_silent_between_them() {
        let mut ecg = Ecg::new();
        let burst = |ecg: &mut Ecg, secs: i32| {
            ecg.pass(secs);
            for k in 0..6 {
                let log_time = Time::from_nanos(i64::from(secs) * 1_000_000_000 + k);
                let sample = Sample {
                    stream: StreamId(0),
                    measured: log_time - std::time::Duration::from_secs(5 - k as u64),
                    log_time,
                    device_time: None,
                    source_time: None,
                    period_ns: 0.0,
                    index: 0,
                    turn: Turn::OnTime,
                    data: Data::Sample(Arc::new([k as f64])),
                };
                ecg.watch.push(&sample, &mut ecg.out);
            }
        };
        for secs in [10, 15, 20, 25] {
            burst(&mut ecg, secs);
        }
        ecg.pass(39);
        assert!(ecg.reported().is_empty(), "{:?}", ecg.reported());
        ecg.pass(41);
        assert_eq!(ecg.reported().len(), 1, "three usual intervals have passed");
    }

    #[test]
    fn a_fast_stream_that_dies_is_silent_after_the_set_time() {
        for hz in [60, 128, 1000, 2000] {
            let mut ecg = Ecg::new();
            for k in 0..4 * hz {
                // In runs of as many as share a millisecond.
                ecg.arrive(k * 1000 / hz * 1_000_000, k as f64);
            }
            ecg.pass(8);
            assert!(ecg.reported().is_empty(), "{hz} Hz: {:?}", ecg.reported());
            ecg.pass(10);
            assert_eq!(ecg.reported().len(), 1, "{hz} Hz: silent for six seconds");
        }
    }

    #[test]
    fn a_slow_stream_is_not_silent_between_its_samples() {
        let mut ecg = Ecg::new();
        for k in 0..20 {
            ecg.come(k * 16..k * 16 + 1, beat);
        }
        ecg.pass(83);
        assert!(ecg.reported().is_empty(), "{:?}", ecg.reported());
        ecg.pass(95);
        assert_eq!(ecg.reported().len(), 1);
    }

    #[test]
    fn robots_and_presses_are_left_alone() {
        let person = Subject { about: About::Person, id: "p1".into() };
        let stream = Stream::raw("/humans/persons/p1/keys/input", person, Shape::Sample);
        assert!(!Outages::default().accepts(&Stream { signal: Signal::Input, ..stream }));
        let robot = Stream::raw("/r1/battery", Subject::robot("r1"), Shape::Sample);
        assert!(!Outages::default().accepts(&robot));
    }
}
