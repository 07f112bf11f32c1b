//! The decoders of `teampulse-devices` against an emulated Polar H10: they read what was measured, whatever fails.

#![expect(clippy::float_cmp, reason = "these are exact")]

use std::time::Duration;

use teampulse_devices::gatt::{Request, Uuid};
use teampulse_devices::polar::{Measurement, PolarSession, Selection};
use teampulse_devices::{Error, Event, GattSession, Output, Reading, Session};
use teampulse_emulators::devices::{
    AttError, Characteristic, Fault, H10, H10Settings, Incident, Peripheral, Sent, Wearer, assigned,
};

const RATE_HZ: f64 = 130.0;
const STEP_SECS: f64 = 0.01;

/// A wearer with numbers instead of a heart: each sample encodes when it was taken.
struct Numbers;

impl Wearer for Numbers {
    fn ecg_uv(&mut self, secs: f64) -> f64 {
        (secs * RATE_HZ).rem_euclid(16_000.0)
    }

    fn acceleration_mg(&mut self, secs: f64) -> [f64; 3] {
        [0.0, secs, 1000.0]
    }

    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let beats = (0..10_000).map(|beat| f64::from(beat) * 0.8);
        beats.filter(|secs| *secs > after_secs && *secs <= until_secs).collect()
    }
}

fn uuid(characteristic: Characteristic) -> Uuid {
    Uuid(characteristic.uuid())
}

fn characteristic(of: Uuid) -> Option<Characteristic> {
    Characteristic::of(of.0)
}

/// A strap and a session, joined by a link that loses nothing.
struct Link {
    strap: H10,
    session: PolarSession,
    outputs: Vec<Output<Request>>,
    secs: f64,
}

impl Link {
    fn new(settings: H10Settings) -> Self {
        let session = PolarSession::new(&[Selection::of(Measurement::Ecg)]);
        let mut link = Self { strap: H10::new(settings), session, outputs: Vec::new(), secs: 0.0 };
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

    /// Passes requests to the strap and values back, until there is nothing left.
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
        let Some(known) = characteristic(*of) else { return self.session.fail(*of, now) };
        let result = match request {
            Request::Subscribe(_) => self.strap.subscribe(known),
            Request::Write(_, value) => self.strap.write(known, value),
            Request::Read(_) => {
                self.strap.read(known).map(|value| self.session.receive(*of, &value, now))
            }
        };
        if result.is_err() {
            self.session.fail(*of, now);
        }
    }

    fn until(mut self, secs: f64) -> Self {
        while self.secs < secs {
            self.secs += STEP_SECS;
            for sent in self.strap.until(self.secs, &mut Numbers) {
                if let Sent::Value(_, from, value) = sent {
                    self.session.receive(uuid(from), &value, self.now());
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

    /// The gaps of the ECG.
    fn gaps(&self) -> Vec<Option<u64>> {
        let gap = |output: &Output<Request>| match output {
            Output::Event(Event::Gap { stream: "ecg", samples }) => Some(*samples),
            _ => None,
        };
        self.outputs.iter().filter_map(gap).collect()
    }

    /// Asserts that every sample has the number under which it was taken.
    fn assert_numbered(&self) {
        let readings = self.readings("ecg");
        let begin = readings[0].values[0];
        for reading in &readings {
            for (at, value) in (reading.index..).zip(&reading.values) {
                assert_eq!(*value, begin + at as f64);
            }
        }
    }
}

fn with(at_secs: f64, fault: Fault) -> H10Settings {
    H10Settings { incidents: vec![Incident { at_secs, fault }], ..H10Settings::default() }
}

#[test]
fn every_sample_is_read_under_its_number() {
    let link = Link::new(H10Settings::default()).until(60.0);
    link.assert_numbered();
    assert_eq!(link.gaps(), []);
    let samples: usize = link.readings("ecg").iter().map(|reading| reading.values.len()).sum();
    assert_eq!(samples / 73, (60.0 * RATE_HZ / 73.0) as usize);
}

#[test]
fn every_interval_between_beats_is_read() {
    let link = Link::new(H10Settings::default()).until(60.0);
    let intervals: Vec<f64> =
        link.readings("rr_interval").iter().flat_map(|r| r.values.clone()).collect();
    assert!(intervals.len() >= 72);
    assert!(intervals.iter().all(|interval| *interval == 819.0)); // 0.8 s of 1024
}

#[test]
fn a_lost_frame_is_a_gap_and_every_other_sample_keeps_its_number() {
    let link = Link::new(with(20.0, Fault::LostFrame)).until(40.0);
    assert_eq!(link.gaps(), [Some(73)]);
    link.assert_numbered();
}

#[test]
fn a_repeated_frame_is_read_once() {
    let link = Link::new(with(20.0, Fault::RepeatedFrame)).until(40.0);
    assert_eq!(link.gaps(), []);
    link.assert_numbered();
}

#[test]
fn a_corrupt_sample_harms_no_other() {
    let link = Link::new(with(20.0, Fault::CorruptByte(100))).until(40.0);
    assert_eq!(link.gaps(), []);
    let begin = link.readings("ecg")[0].values[0];
    let is_wrong = |(at, value): &(u64, f64)| *value != begin + *at as f64;
    let samples =
        link.readings("ecg").into_iter().flat_map(|reading| (reading.index..).zip(reading.values));
    assert_eq!(samples.filter(is_wrong).count(), 1);
}

#[test]
fn a_stream_that_stalls_is_started_again() {
    let link = Link::new(with(20.0, Fault::Stall)).until(60.0);
    let stalled = |output: &&Output<Request>| {
        matches!(output, Output::Event(Event::Stalled { stream: "ecg", .. }))
    };
    assert_eq!(link.outputs.iter().filter(stalled).count(), 1);
    let gaps = link.gaps();
    let lost = gaps[0].unwrap_or_default() as f64 / RATE_HZ;
    assert!(gaps.len() == 1 && (3.0..6.0).contains(&lost), "{gaps:?}");
    assert!(link.readings("ecg").last().is_some_and(|last| last.index as f64 > 58.0 * RATE_HZ));
}

#[test]
fn a_first_frame_that_takes_half_a_minute_is_waited_for() {
    let settings = H10Settings { start_delay_secs: 25.0, ..H10Settings::default() };
    let link = Link::new(settings).until(40.0);
    assert!(!link.readings("ecg").is_empty());
    assert!(!link.outputs.iter().any(|o| matches!(o, Output::Event(Event::Stalled { .. }))));
}

#[test]
fn an_answer_that_is_lost_is_asked_for_again() {
    let link = Link::new(with(0.0, Fault::LostAnswer)).until(20.0);
    link.assert_numbered();
}

#[test]
fn an_answer_that_is_late_costs_no_sample_of_the_stream() {
    let link = Link::new(with(0.0, Fault::LateAnswer(3.0))).until(30.0);
    link.assert_numbered();
}

#[test]
fn a_start_that_was_answered_and_not_carried_out_is_repeated() {
    let mut strap = H10::new(with(0.0, Fault::FalseAnswer));
    strap.until(0.0, &mut Numbers);
    strap.subscribe(Characteristic::Control).expect("it can be subscribed to");
    strap.write(Characteristic::Control, &[2, 0, 0, 1, 130, 0]).expect("a command");
    let answer = Sent::Value(0.02, Characteristic::Control, vec![0xf0, 2, 0, 0, 0]);
    assert_eq!(strap.until(0.2, &mut Numbers), [answer]);
    assert!(!strap.is_streaming());
    // The session notices when nothing comes.
    let link = Link::new(with(0.0, Fault::FalseAnswer)).until(60.0);
    let gap_secs = longest_gap_secs(&link);
    eprintln!("H10 false answer to its start: the ECG is there after {gap_secs:.1} s (bar 30)");
    assert!(gap_secs < 12.0, "{gap_secs}");
    assert_on_one_time_base(&link, 0);
}

#[test]
fn each_percent_of_the_battery_is_reported() {
    let settings = H10Settings { drain_percent_per_hour: 60.0, ..H10Settings::default() };
    let link = Link::new(settings).until(200.0);
    let levels: Vec<f64> = link.readings("battery").iter().map(|r| r.values[0]).collect();
    assert_eq!(levels, [87.0, 86.0, 85.0, 84.0]);
}

#[test]
fn an_h10_is_found_by_its_name_and_the_heart_rate_service() {
    let found = H10::new(H10Settings::default()).advertisement();
    assert_eq!(found.name, "Polar H10 A1B2C3D4");
    assert!(found.services.contains(&assigned(0x180d)));
}

#[test]
fn a_link_that_was_lost_costs_what_was_measured_meanwhile() {
    let mut link = Link::new(H10Settings::default()).until(20.0);
    link.strap.disconnect();
    link.strap.until(30.0, &mut Numbers);
    link.secs = 30.0;
    link.connect(); // the stream is still on: it is stopped and started
    let link = link.until(50.0);
    let gaps = link.gaps();
    let lost_secs = gaps[0].unwrap_or_default() as f64 / RATE_HZ;
    assert!(gaps.len() == 1 && (10.0..12.5).contains(&lost_secs), "{gaps:?}");
    assert!(link.strap.is_streaming());
}

/// The longest time without ECG \[s\], by the strap's clock, which has numbered its samples; the time before the first
/// sample does not count.
fn longest_gap_secs(link: &Link) -> f64 {
    let readings = link.readings("ecg");
    let bounds = readings.iter().filter_map(|r| Some((*r.values.first()?, *r.values.last()?)));
    let bounds: Vec<(f64, f64)> =
        [(0.0, 0.0)].into_iter().chain(bounds).chain([(link.secs * RATE_HZ, 0.0)]).collect();
    let gaps = bounds.windows(2).map(|pair| (pair[1].0 - pair[0].1) / RATE_HZ);
    gaps.fold(0.0, f64::max)
}

/// Asserts that each sample's time matches its number, by the strap's clock, except in a frame with a corrupted stamp.
fn assert_on_one_time_base(link: &Link, harmed: usize) {
    let readings = link.readings("ecg");
    let since = |reading: &Reading| {
        let device_secs = reading.device_time_ns.unwrap_or_default() as f64 / 1e9;
        device_secs - reading.values[0] / RATE_HZ
    };
    // Numbers are whole: a stream that begins again does so between two of them.
    let is_off = |reading: &&Reading| (since(reading) - since(&readings[0])).abs() > 1.0 / RATE_HZ;
    assert_eq!(readings.iter().filter(is_off).count(), harmed);
}

#[test]
fn after_each_fault_the_ecg_is_back_within_thirty_seconds_on_the_same_time_base() {
    let faults = [
        (0.0, Fault::LostAnswer),
        (0.0, Fault::LateAnswer(3.0)),
        (20.0, Fault::LostFrame),
        (20.0, Fault::RepeatedFrame),
        (20.0, Fault::CorruptByte(0)),
        (20.0, Fault::CorruptByte(1)),
        (20.0, Fault::CorruptByte(5)),
        (20.0, Fault::CorruptByte(9)),
        (20.0, Fault::Stall),
    ];
    for (at_secs, fault) in faults {
        let link = Link::new(with(at_secs, fault)).until(90.0);
        let gap_secs = longest_gap_secs(&link);
        eprintln!("H10 {fault:?}: the ECG is back {gap_secs:.1} s of the strap after it (bar 30)");
        assert!(gap_secs < 30.0, "{fault:?}");
        assert_on_one_time_base(&link, usize::from(fault == Fault::CorruptByte(5)));
    }
    // The strap streams on while nobody is connected: the start is answered with "already in state".
    let mut link = Link::new(H10Settings::default()).until(20.0);
    link.strap.disconnect();
    link.connect();
    let link = link.until(90.0);
    let gap_secs = longest_gap_secs(&link);
    eprintln!(
        "H10 link lost, then already in state: the ECG is back {gap_secs:.1} s after it (bar 30)"
    );
    assert!(gap_secs < 30.0);
    assert_on_one_time_base(&link, 0);
}

#[test]
fn a_clock_that_is_two_percent_fast_loses_nothing() {
    for clock_fast in [-0.05, -0.02, 0.02, 0.05] {
        let settings = H10Settings { clock_fast, ..H10Settings::default() };
        let link = Link::new(settings).until(60.0);
        assert_eq!(link.gaps(), []);
        // By its own clock it has exactly its rate.
        let last = link.readings("ecg").pop().and_then(|reading| reading.period_ns);
        assert!(last.is_some_and(|period_ns| (period_ns - 1e9 / RATE_HZ).abs() < 1.0));
    }
}

#[test]
fn a_clock_that_is_set_is_seen() {
    let link = Link::new(with(20.0, Fault::ClockSet(240_000_000_000_000_000))).until(40.0);
    let set = |output: &&Output<Request>| matches!(output, Output::Event(Event::ClockSet { .. }));
    assert_eq!(link.outputs.iter().filter(set).count(), 1);
    link.assert_numbered();
}

#[test]
fn a_strap_that_comes_off_sends_noise_and_no_beats() {
    let link = Link::new(with(20.0, Fault::StrapOff)).until(90.0);
    assert_eq!(link.gaps(), []);
    let last = |stream: &str| link.readings(stream).last().map(|reading| reading.index);
    assert!(last("ecg").is_some_and(|index| index as f64 > 88.0 * RATE_HZ));
    assert!(last("rr_interval").is_some_and(|index| index < 27));
}

#[test]
fn a_strap_that_comes_off_without_a_stream_ends_its_link() {
    let mut strap = H10::new(with(20.0, Fault::StrapOff));
    let sent = strap.until(100.0, &mut Numbers);
    assert_eq!(sent, [Sent::LinkLost(65.0)]);
}

#[test]
fn a_small_mtu_ends_the_session_with_its_reason() {
    let link = Link::new(H10Settings { mtu: 23, ..H10Settings::default() }).until(5.0);
    assert_eq!(link.outputs.last(), Some(&Output::Done(Err(Error::Refused("invalid MTU")))));
}

#[test]
fn a_session_that_stops_leaves_nothing_streaming() {
    let mut link = Link::new(H10Settings::default()).until(10.0);
    assert!(link.strap.is_streaming());
    link.session.stop(link.now());
    link.carry();
    let link = link.until(11.0);
    assert!(!link.strap.is_streaming());
    assert_eq!(link.outputs.last(), Some(&Output::Done(Ok(()))));
}

#[test]
fn a_command_before_indications_are_on_is_refused_by_the_link() {
    let mut strap = H10::new(H10Settings::default());
    assert_eq!(strap.write(Characteristic::Control, &[1, 0]), Err(AttError::NotSubscribed));
}

#[test]
fn what_is_sent_does_not_depend_on_how_often_it_is_asked() {
    let run = |steps: u32| {
        let mut strap = H10::new(with(3.0, Fault::StrapOff));
        for characteristic in
            [Characteristic::Control, Characteristic::Data, Characteristic::HeartRate]
        {
            strap.subscribe(characteristic).expect("it can be subscribed to");
        }
        let start = [2, 0, 0, 1, 130, 0, 1, 1, 14, 0];
        strap.write(Characteristic::Control, &start).expect("it is subscribed to");
        let times = (1..=steps).map(|step| 10.0 * f64::from(step) / f64::from(steps));
        times.flat_map(|secs| strap.until(secs, &mut Numbers)).collect::<Vec<_>>()
    };
    assert_eq!(run(1), run(7));
    assert_eq!(run(1), run(1000));
}
