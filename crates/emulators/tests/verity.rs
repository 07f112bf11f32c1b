//! The decoders of `teampulse-devices` against an emulated Polar Verity Sense and OH1: they read what was measured,
//! whatever fails.

#![expect(clippy::float_cmp, reason = "these are exact")]

use std::time::Duration;

use teampulse_devices::gatt::Request;
use teampulse_devices::polar::{Measurement, PolarSession, Selection};
use teampulse_devices::{Event, GattSession, Output, Reading, Session};
use teampulse_emulators::devices::{
    Notice, Peripheral, Verity, VerityFault, VerityIncident, VerityModel, VeritySettings, Wearer,
};

const STEP_SECS: f64 = 0.01;
/// The time between the wearer's beats.
const BEAT_SECS: f64 = 0.8;
/// The light per count, as for a person at rest: it changes little from sample to sample.
const LIGHT_OF_COUNT: f64 = 1e-3;
/// The counts at no light, and at full light.
const DARK: f64 = 430_000.0;
const LIGHT: f64 = 40_000.0;

/// A wearer with numbers instead of an arm: each sample encodes when it was taken.
struct Numbers;

impl Wearer for Numbers {
    fn light(&mut self, secs: f64) -> f64 {
        secs * LIGHT_OF_COUNT
    }

    fn acceleration_mg(&mut self, secs: f64) -> [f64; 3] {
        [secs * 10.0, -1000.0, 0.0]
    }

    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let beats = (0..10_000).map(|beat| f64::from(beat) * BEAT_SECS);
        beats.filter(|secs| *secs > after_secs && *secs <= until_secs).collect()
    }
}

/// A sensor and a session, joined by a link that loses nothing.
struct Link {
    sensor: Verity,
    session: PolarSession,
    outputs: Vec<Output<Request>>,
    secs: f64,
}

impl Link {
    fn new(settings: VeritySettings, measured: &[Measurement]) -> Self {
        let selections: Vec<Selection> = measured.iter().copied().map(Selection::of).collect();
        let (sensor, session) = (Verity::new(settings), PolarSession::new(&selections));
        let mut link = Self { sensor, session, outputs: Vec::new(), secs: 0.0 };
        link.connect();
        link
    }

    fn connect(&mut self) {
        self.session.start(self.now());
        self.carry();
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.secs)
    }

    /// Passes requests to the sensor and values back, until there is nothing left.
    fn carry(&mut self) {
        while let Some(output) = self.session.poll() {
            if let Output::Request(request) = &output {
                self.request(request);
            }
            self.outputs.push(output);
        }
    }

    fn request(&mut self, request: &Request) {
        let now = self.now();
        let (Request::Subscribe(of) | Request::Read(of) | Request::Write(of, _)) = request;
        let result = match request {
            Request::Subscribe(_) => self.sensor.subscribe(of.0),
            Request::Write(_, value) => self.sensor.write(of.0, value),
            Request::Read(_) => {
                self.sensor.read(of.0).map(|value| self.session.receive(*of, &value, now))
            }
        };
        if result.is_err() {
            self.session.fail(*of, now);
        }
    }

    fn until(mut self, secs: f64) -> Self {
        while self.secs < secs {
            self.secs += STEP_SECS;
            for sent in self.sensor.until(self.secs, &mut Numbers) {
                if let Notice::Value(from, value) = sent {
                    let from = teampulse_devices::gatt::Uuid(from);
                    self.session.receive(from, &value, self.now());
                    self.carry();
                }
            }
            self.session.tick(self.now());
            self.carry();
        }
        self
    }

    fn readings(&self, stream: &str) -> Vec<Reading> {
        let of_stream = |output: &Output<Request>| match output {
            Output::Reading(reading) if reading.stream == stream => Some(reading.clone()),
            _ => None,
        };
        self.outputs.iter().filter_map(of_stream).collect()
    }

    fn has_event(&self, is_it: impl Fn(&Event) -> bool) -> bool {
        self.outputs.iter().any(|output| matches!(output, Output::Event(event) if is_it(event)))
    }

    fn gaps(&self, of: &str) -> Vec<Option<u64>> {
        let gap = |output: &Output<Request>| match output {
            Output::Event(Event::Gap { stream, samples }) if *stream == of => Some(*samples),
            _ => None,
        };
        self.outputs.iter().filter_map(gap).collect()
    }

    /// When each sample of a stream was taken, according to its number and to its value \[s\].
    fn samples(&self, stream: &str, width: usize, secs_of: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let readings = self.readings(stream);
        let samples = readings.iter().flat_map(|reading| {
            let samples = reading.values.chunks(width).enumerate();
            samples.map(|(place, values)| (reading.index + place as u64, values[0]))
        });
        samples.map(|(number, value)| (number as f64, secs_of(value))).collect()
    }

    fn ppg(&self) -> Vec<(f64, f64)> {
        self.samples("ppg", 4, |counts| (counts - DARK) / LIGHT / LIGHT_OF_COUNT)
    }

    /// The longest time without PPG \[s\], by the measured values, including the time before the first sample.
    fn longest_gap_secs(&self) -> f64 {
        let taken = self.ppg().into_iter().map(|(_, secs)| secs);
        let taken: Vec<f64> = [0.0].into_iter().chain(taken).chain([self.secs]).collect();
        taken.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    }
}

/// Asserts that every sample was taken when its number implies at this rate, to within one count of the light.
fn assert_numbered(samples: &[(f64, f64)], rate_hz: f64, step_secs: f64) {
    let (first_number, first_secs) = samples[0];
    for (number, secs) in samples {
        let expected_secs = first_secs + (number - first_number) / rate_hz;
        assert!((secs - expected_secs).abs() <= step_secs, "{number}: {secs} {expected_secs}");
    }
}

fn with(at_secs: f64, fault: VerityFault) -> VeritySettings {
    VeritySettings {
        incidents: vec![VerityIncident { at_secs, fault }],
        ..VeritySettings::default()
    }
}

const PPG: &[Measurement] = &[Measurement::Ppg];
/// The time that one count of the light, and one mg of the acceleration, stand for \[s\].
const COUNT_SECS: f64 = 1.0 / LIGHT / LIGHT_OF_COUNT;
const MG_SECS: f64 = 0.1;

#[test]
fn every_sample_of_a_verity_sense_is_read_under_its_number() {
    let measured = [Measurement::Ppg, Measurement::Acceleration];
    let link = Link::new(VeritySettings::default(), &measured).until(60.0);
    let ppg = link.ppg();
    assert_numbered(&ppg, 55.0, COUNT_SECS);
    assert!(ppg.len() as f64 > 58.0 * 55.0, "{}", ppg.len());
    let acceleration = link.samples("acceleration", 3, |mg| mg / 10.0);
    assert_numbered(&acceleration, 52.0, MG_SECS);
    assert!(acceleration.len() as f64 > 57.0 * 52.0);
    let first = &link.readings("acceleration")[0].values;
    assert_eq!(first[1..3], [-1000.0, 0.0]);
    assert_eq!((link.gaps("ppg"), link.gaps("acceleration")), (vec![], vec![]));
}

#[test]
fn an_oh1_is_read_though_it_reports_130_hz_for_135() {
    let settings = VeritySettings { model: VerityModel::Oh1, ..VeritySettings::default() };
    let link = Link::new(settings, &[Measurement::Ppg, Measurement::Acceleration]).until(60.0);
    assert_numbered(&link.ppg(), 135.0, COUNT_SECS);
    assert_numbered(&link.samples("acceleration", 3, |mg| mg / 10.0), 50.0, MG_SECS);
    assert_eq!(link.gaps("ppg"), []);
    let period_ns = link.readings("ppg").last().and_then(|last| last.period_ns);
    assert!((period_ns.expect("is known") - 1e9 / 135.0).abs() < 1e3);
}

#[test]
fn a_ppg_of_55_hz_that_is_reported_as_135_hz_is_measured() {
    let settings = VeritySettings { reports_false_rate: true, ..VeritySettings::default() };
    let link = Link::new(settings, PPG).until(60.0);
    assert_numbered(&link.ppg(), 55.0, COUNT_SECS);
    assert_eq!(link.gaps("ppg"), []);
    let period_ns = link.readings("ppg").last().and_then(|last| last.period_ns);
    assert!((period_ns.expect("is known") - 1e9 / 55.0).abs() < 1e3);
}

#[test]
fn intervals_between_pulses_come_after_25_s_and_none_is_missing() {
    let link = Link::new(VeritySettings::default(), &[Measurement::PpInterval]).until(61.0);
    let read = link.readings("pp_interval");
    assert!(read.iter().all(|reading| reading.device_time_ns.is_none()), "it has no times");
    let pulses: Vec<[f64; 5]> =
        read.iter().flat_map(|reading| reading.values.as_chunks::<5>().0.to_vec()).collect();
    // Spans of 5 s, the first of which ends after 25 s, and the last after 60 s.
    assert_eq!((read.len(), pulses.len()), (8, 50));
    assert!(pulses.iter().all(|pulse| *pulse == [800.0, 6.0, 75.0, 0.0, 1.0]), "{pulses:?}");
    // Meanwhile the heart rate comes without intervals.
    assert!(link.readings("rr_interval").is_empty());
    assert_eq!(link.readings("heart_rate").last().map(|rate| rate.values[0]), Some(75.0));
}

#[test]
fn pulses_of_an_arm_that_moves_are_marked() {
    let link = Link::new(with(30.5, VerityFault::Moving), &[Measurement::PpInterval]).until(61.0);
    let read = link.readings("pp_interval");
    let moving = |reading: &Reading| reading.values[3];
    assert_eq!(read.iter().map(moving).collect::<Vec<_>>(), [0., 0., 1., 1., 1., 1., 1., 1.]);
}

#[test]
fn a_lost_frame_is_a_gap_and_every_other_sample_keeps_its_number() {
    let link = Link::new(with(20.0, VerityFault::LostFrame), PPG).until(40.0);
    assert_eq!(link.gaps("ppg"), [Some(42)]);
    assert_numbered(&link.ppg(), 55.0, COUNT_SECS);
}

#[test]
fn a_stream_that_the_device_stops_by_itself_is_started_again() {
    let link = Link::new(with(20.0, VerityFault::Stopped), PPG).until(40.0);
    assert!(link.has_event(|event| matches!(event, Event::Stalled { stream: "ppg", .. })));
    assert!(link.longest_gap_secs() < 5.0, "{}", link.longest_gap_secs());
    assert!(link.sensor.is_streaming());
}

#[test]
fn after_each_fault_the_ppg_is_back_within_five_seconds() {
    let faults = [
        (0.0, VerityFault::LostAnswer),
        (20.0, VerityFault::LostFrame),
        (20.0, VerityFault::CorruptByte(0)),
        (20.0, VerityFault::CorruptByte(9)),
        (20.0, VerityFault::CorruptByte(22)),
        (20.0, VerityFault::CorruptByte(23)),
        (20.0, VerityFault::Stopped),
        (20.0, VerityFault::Stall),
    ];
    for (at_secs, fault) in faults {
        let link = Link::new(with(at_secs, fault), PPG).until(60.0);
        let gap_secs = link.longest_gap_secs();
        eprintln!("Verity Sense {fault:?}: the PPG is back {gap_secs:.1} s after it (bar 5)");
        // An answer is waited for for 5 s before its command is repeated.
        let bar_secs = if fault == VerityFault::LostAnswer { 5.5 } else { 5.0 };
        assert!(gap_secs < bar_secs, "{fault:?}: {gap_secs}");
    }
}

#[test]
fn a_link_that_was_lost_costs_what_was_measured_meanwhile() {
    let mut link = Link::new(VeritySettings::default(), PPG).until(20.0);
    link.sensor.disconnect();
    link.sensor.until(30.0, &mut Numbers);
    link.secs = 30.0;
    link.connect(); // the stream is still on: it is stopped and started
    let link = link.until(50.0);
    let gap_secs = link.longest_gap_secs();
    assert!((10.0..13.0).contains(&gap_secs), "{gap_secs}");
    assert_eq!(link.gaps("ppg").len(), 1);
}

#[test]
fn a_sensor_that_is_taken_off_measures_noise_and_no_pulses() {
    let measured = [Measurement::Ppg, Measurement::PpInterval];
    let link = Link::new(with(31.0, VerityFault::Off), &measured).until(61.0);
    assert_eq!(link.readings("pp_interval").len(), 2);
    assert_eq!(link.readings("heart_rate").last().map(|rate| rate.values[0]), Some(0.0));
    let ppg = link.ppg();
    let is_noise = |(_, secs): &&(f64, f64)| !(0.0..=61.0).contains(secs);
    assert!(ppg.iter().filter(is_noise).count() > 1000);
    assert_eq!(link.gaps("ppg"), [], "a frame that noise makes too long is sent as several");
}

#[test]
fn a_clock_that_is_two_percent_fast_loses_nothing() {
    for clock_fast in [-0.02, 0.02] {
        let link = Link::new(VeritySettings { clock_fast, ..VeritySettings::default() }, PPG);
        let link = link.until(60.0);
        assert_eq!(link.gaps("ppg"), []);
        assert_numbered(&link.ppg(), 55.0 * (1.0 + clock_fast), COUNT_SECS);
    }
}

#[test]
fn it_is_found_by_its_name() {
    let name = |model| {
        let settings = VeritySettings { model, ..VeritySettings::default() };
        Verity::new(settings).advertisement().name
    };
    assert_eq!(name(VerityModel::VeritySense), "Polar Sense B1C2D3E4");
    assert_eq!(name(VerityModel::Oh1), "Polar OH1 B1C2D3E4");
}
