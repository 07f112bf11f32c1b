//! The decoders of `teampulse-devices` against an emulated Empatica E4: they read what was measured, whatever fails.

#![expect(clippy::float_cmp, reason = "these are exact")]

use std::time::Duration;

use teampulse_devices::empatica_e4::{E4Session, E4Settings};
use teampulse_devices::{ByteSession, Event, Output, Reading, Session};
use teampulse_emulators::devices::{E4Fault, E4Incident, E4Server, Wearer};

/// Light that encodes when it was measured, and a beat every 0.8 s.
struct Numbers;

impl Wearer for Numbers {
    fn light(&mut self, secs: f64) -> f64 {
        secs * 64.0
    }

    fn conductance_us(&mut self, secs: f64) -> f64 {
        secs
    }

    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let beats = (0..1000).map(|beat| f64::from(beat) * 0.8);
        beats.filter(|secs| *secs > after_secs && *secs <= until_secs).collect()
    }
}

/// The outputs of a session with a server over a period, over a link that cuts bytes anywhere.
fn read(mut server: E4Server, secs: u64) -> Vec<Output<Vec<u8>>> {
    let mut session = E4Session::new(E4Settings::default());
    session.start(Duration::ZERO);
    let mut outputs = Vec::new();
    for now_ms in (0..secs * 1000).step_by(50) {
        while let Some(output) = session.poll() {
            if let Output::Request(request) = &output {
                server.receive(request);
            }
            outputs.push(output);
        }
        let now = Duration::from_millis(now_ms);
        let bytes = server.until(now.as_secs_f64(), &mut Numbers);
        bytes.chunks(13).for_each(|piece| session.receive(piece, now));
        session.tick(now);
    }
    outputs
}

fn with(incidents: &[(f64, E4Fault)]) -> E4Server {
    let incidents =
        incidents.iter().map(|(at_secs, fault)| E4Incident { at_secs: *at_secs, fault: *fault });
    E4Server::new(incidents.collect())
}

fn readings(outputs: &[Output<Vec<u8>>], stream: &str) -> Vec<Reading> {
    let of_stream = |output: &Output<Vec<u8>>| match output {
        Output::Reading(reading) if reading.stream == stream => Some(reading.clone()),
        _ => None,
    };
    outputs.iter().filter_map(of_stream).collect()
}

fn gaps(outputs: &[Output<Vec<u8>>], of: &str) -> Vec<Option<u64>> {
    let gap = |output: &Output<Vec<u8>>| match output {
        Output::Event(Event::Gap { stream, samples }) if *stream == of => Some(*samples),
        _ => None,
    };
    outputs.iter().filter_map(gap).collect()
}

/// Asserts that every sample has the number under which it was taken.
fn assert_numbered(outputs: &[Output<Vec<u8>>]) {
    let light = readings(outputs, "ppg");
    let begin = light[0].values[0];
    for reading in &light {
        assert_eq!(reading.values[0], begin + reading.index as f64);
    }
}

#[test]
fn what_was_worn_is_read_with_decimal_points_and_commas() {
    for server in [E4Server::default(), E4Server::default().with_decimal_comma()] {
        let outputs = read(server, 30);
        assert_numbered(&outputs);
        assert_eq!(gaps(&outputs, "ppg"), []);
        assert!(readings(&outputs, "ppg").len() > 29 * 64);
        let second = readings(&outputs, "acceleration").pop().map(|reading| reading.values);
        assert_eq!(second, Some(vec![0.0, 0.0, 64.0]));
        let interval =
            readings(&outputs, "ibi").pop().map_or(f64::NAN, |reading| reading.values[0]);
        assert!((interval - 0.8).abs() < 1e-9);
    }
}

#[test]
fn a_lost_radio_link_is_a_gap_of_its_length() {
    let outputs = read(with(&[(10.0, E4Fault::LinkLost), (17.0, E4Fault::LinkBack)]), 30);
    assert_numbered(&outputs);
    let gaps = gaps(&outputs, "ppg");
    assert!(matches!(gaps[..], [Some(446..=449)]), "{gaps:?}");
}

#[test]
fn a_server_that_stalls_is_subscribed_to_again() {
    let outputs = read(with(&[(10.0, E4Fault::Stall)]), 30);
    assert_numbered(&outputs);
    let lost = gaps(&outputs, "ppg")[0].unwrap_or_default();
    assert!((4 * 64..5 * 64).contains(&lost), "{lost}");
}

#[test]
fn after_each_fault_samples_are_back_within_five_seconds_of_the_device() {
    // A radio link comes back when the wristband is near again.
    let link = [(10.0, E4Fault::LinkLost), (17.0, E4Fault::LinkBack)];
    for (what, incidents, away_secs) in
        [("link lost", &link[..], 7.0), ("stall", &[(10.0, E4Fault::Stall)], 0.0)]
    {
        let outputs = read(with(incidents), 30);
        let lost = gaps(&outputs, "ppg")[0].unwrap_or_default() as f64 / 64.0;
        let gap_secs = lost - away_secs;
        eprintln!("E4 {what}: samples are back {gap_secs:.2} s of the device after it (bar 5)");
        assert!(gap_secs < 5.0, "{what}");
        assert_numbered(&outputs);
    }
}

#[test]
fn a_press_is_a_marker() {
    let outputs = read(with(&[(10.25, E4Fault::Press)]), 12);
    let marker = Event::Marker { name: "tag", device_time_ns: Some(1_460_377_860_250_000_000) };
    assert!(outputs.contains(&Output::Event(marker)));
}
