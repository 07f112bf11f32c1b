use teampulse_core::data::Wave;
use teampulse_core::stream::{About, Origin, StreamId, Subject};
use teampulse_signal::analysis::Make;
use teampulse_signal::{ecg, voice};

use super::*;
use crate::analysed::built;
use teampulse_core::data::EventKind;
use teampulse_core::sample::Turn;

#[test]
fn an_event_of_one_channel_of_several_is_labelled_with_it() {
    let naming = Happening {
        kind: "burst",
        leaf: "bursts",
        word: EventKind::Burst,
        value: "peak",
        duration: "",
    };
    let channels = ["flexor", "extensor"].map(|name| Channel::new(name, "uV"));
    let label = |details: &[(&'static str, f64)]| {
        let details = details.to_vec();
        let event = analysis::Event { kind: "burst", sample: 0.0, at_ns: 0, details };
        let Data::Event(event) = happened(&naming, &event, &channels) else { panic!() };
        event.label.clone()
    };
    assert_eq!(label(&[("channel", 1.0), ("peak", 3.0)]), "extensor");
    assert_eq!(label(&[("peak", 3.0)]), "burst");
}

const RATE_HZ: f64 = 130.0;
/// The clock of the strap is a little fast.
const PERIOD_NS: f64 = 1e9 / RATE_HZ * 1.000_05;

fn ecg() -> Stream {
    let subject = Subject { about: About::Person, id: "p1".into() };
    let stream = Stream::raw("/humans/persons/p1/polar_h10/ecg", subject, Shape::Wave);
    let stream = Stream { signal: Signal::Ecg, rate_hz: RATE_HZ, ..stream };
    stream.with_channels(&[("ecg", "mV")])
}

/// A bump slightly more than every 100 samples, with broad ones between them.
fn voltages() -> Vec<f64> {
    let bump = |k: usize, at: f64, width: f64| {
        let from = (k % 101) as f64 - at;
        (-(from / width).powi(2) / 2.0).exp()
    };
    (0..7800).map(|k| bump(k, 40.0, 1.5) + 0.2 * bump(k, 75.0, 6.0)).collect()
}

/// The output for samples in waves of these lengths, some of them lost.
fn reported(lengths: &[usize]) -> (Vec<Stream>, Vec<(OutputId, Time, String)>) {
    let feature = built(Signal::Ecg, Some(vec![10.0]));
    let stream = ecg();
    assert!(feature.accepts(&stream));
    let (mut extractor, mut out) = (feature.start(&stream), Outputs::new());
    extractor.join(StreamId(0), &stream, &mut out);
    let (voltages, mut begin) = (voltages(), 0);
    for length in lengths.iter().cycle() {
        let end = (begin + length).min(voltages.len());
        if begin == end {
            break;
        }
        let ns = (begin as f64 * PERIOD_NS).round() as i64;
        extractor.push(&wave(ns, &voltages[begin..end]), &mut out);
        begin = end;
    }
    let samples = out.samples().map(|(id, at, data)| (id, at, format!("{data:?}")));
    (out.streams().to_vec(), samples.collect())
}

fn wave(at_ns: i64, samples: &[f64]) -> Sample {
    let at = Time::from_nanos(1_700_000_000_000_000_000 + at_ns);
    let samples = samples.into();
    Sample {
        stream: StreamId(0),
        measured: at,
        log_time: at,
        device_time: None,
        source_time: None,
        period_ns: PERIOD_NS,
        index: 0,
        turn: Turn::OnTime,
        data: Data::Wave(Wave { period_ns: 1e9 / RATE_HZ, channels: 1, samples }),
    }
}

#[test]
fn beats_and_windows_come_out_with_their_names_and_units() {
    let (streams, samples) = reported(&[73]);
    let names: Vec<&str> = streams.iter().map(|stream| stream.name.as_str()).collect();
    let ecg = "/humans/persons/p1/polar_h10/ecg";
    assert_eq!(names, [format!("{ecg}/heart/w10"), format!("{ecg}/beats")]);
    let place = streams[0].place_of("ECG_Rate_Mean").unwrap();
    assert_eq!(streams[0].channels[place].unit, "1/min");
    let beats = samples.iter().filter(|(.., data)| data.contains("Beat")).count();
    assert!((75..=77).contains(&beats), "{beats} of 77");
    let windows = samples.iter().filter(|(.., data)| data.contains("window_secs: 10.0"));
    // Each second of a minute, but for the end of the last.
    assert_eq!(windows.count(), 59);
}

#[test]
fn the_recipe_of_every_value_is_kept() {
    let streams = reported(&[73]).0;
    assert!(streams[0].method.contains("HRV_DFA_alpha2: "));
    assert_eq!(streams[0].clone().cleaned().method, streams[0].method);
}

#[test]
fn waves_of_any_length_give_the_same() {
    let whole = reported(&[73]).1;
    // Where a wave begins, its time is rounded: no more than that may differ.
    for lengths in [&[7800][..], &[1], &[5, 200, 33]] {
        let other = reported(lengths).1;
        assert_eq!(whole.len(), other.len());
        for (one, other) in whole.iter().zip(&other) {
            assert_eq!(one.0, other.0);
            assert!((one.1.nanos() - other.1.nanos()).abs() <= 2);
        }
    }
}

#[test]
fn live_results_equal_those_of_the_analysis_afterwards() {
    let make: Make =
        Box::new(|rate_hz| ecg::analysis::causal(&ecg::analysis::Settings::default(), rate_hz));
    let mut live = Live::new(make, RATE_HZ, 1, &[10_000_000_000], HOP_NS).unwrap();
    let mut expected = Vec::new();
    for (sample, voltage) in voltages().into_iter().enumerate() {
        let wave_begin = (sample / 73 * 73) as f64;
        let from_begin = ((sample % 73) as f64 * PERIOD_NS).round() as i64;
        let at_ns = 1_700_000_000_000_000_000 + (wave_begin * PERIOD_NS).round() as i64;
        live.push(at_ns + from_begin, &[voltage], &mut |output| {
            if let LiveOutput::Window(_, span, measured) = output {
                expected.push(format!("{:?}", feature(span.secs(), &measured)));
            }
        });
    }
    let windows = reported(&[73]).1.into_iter().map(|(.., data)| data);
    let windows: Vec<String> = windows.filter(|data| data.contains("window_secs")).collect();
    assert!(windows == expected);
}

/// The values for half a minute of intervals of 800 ms in a unit, with the number of units in a
/// millisecond.
fn windows_of_intervals(unit: &str, of_ms: f64) -> (Vec<Stream>, Vec<(Time, Data)>) {
    let feature = built(Signal::Interval, Some(vec![10.0]));
    let subject = Subject { about: About::Person, id: "p1".into() };
    let stream = Stream::raw("/humans/persons/p1/polar_h10/rr", subject, Shape::Sample);
    let stream = Stream { signal: Signal::Interval, ..stream }.with_channels(&[("rr", unit)]);
    let (mut extractor, mut out) = (feature.start(&stream), Outputs::new());
    extractor.join(StreamId(0), &stream, &mut out);
    for k in 1..40 {
        let data = Data::Sample([800.0 * of_ms].into());
        extractor.push(&Sample { data, ..wave(800_000_000 * k, &[]) }, &mut out);
    }
    let samples = out.samples().map(|(_, at, data)| (at, data.clone())).collect();
    (out.streams().to_vec(), samples)
}

#[test]
fn intervals_in_any_unit_of_time_are_reported_in_milliseconds() {
    let milliseconds = windows_of_intervals("ms", 1.0);
    assert!(milliseconds.1.iter().any(|(_, data)| {
        matches!(data, Data::Event(event) if (event.value - 800.0).abs() < 1e-9)
    }));
    // Without a declared unit they are in that of the feature.
    for (unit, of_ms) in [("s", 1e-3), ("us", 1e3), ("s/1024", 1.024), ("", 1.0)] {
        let found = windows_of_intervals(unit, of_ms);
        assert_eq!(format!("{:?}", found.1), format!("{:?}", milliseconds.1), "{unit}");
    }
}

#[test]
fn a_unit_that_can_not_be_converted_is_refused_and_reported_once() {
    let (streams, samples) = windows_of_intervals("1/min", 1.0);
    let names: Vec<&str> = streams.iter().map(|stream| stream.name.as_str()).collect();
    assert_eq!(names, ["/humans/persons/p1/polar_h10/rr/intervals/refused"]);
    let [(_, Data::Event(fault))] = &samples[..] else { panic!("{samples:?}") };
    assert_eq!(fault.kind, EventKind::Fault);
    assert_eq!(fault.label, "intervals: 1/min can't be converted to ms");
}

#[test]
fn a_robot_s_or_a_derived_signal_is_ignored() {
    let feature = built(Signal::Ecg, None);
    assert!(!feature.accepts(&Stream { about: About::Robot, ..ecg() }));
    assert!(!feature.accepts(&Stream { origin: Origin::Derived, ..ecg() }));
    assert!(!feature.accepts(&Stream { rate_hz: 0.0, ..ecg() }));
    assert!(!feature.accepts(&Stream { signal: Signal::Ppg, ..ecg() }));
}

#[test]
fn a_rate_at_which_nothing_can_be_reported_gives_no_stream() {
    let feature = built(Signal::Ecg, None);
    let stream = Stream { rate_hz: 1.0, ..ecg() };
    let (mut extractor, mut out) = (feature.start(&stream), Outputs::new());
    extractor.join(StreamId(0), &stream, &mut out);
    extractor.push(&wave(0, &[1.0; 10]), &mut out);
    assert!(out.streams().is_empty() && out.samples().next().is_none());
}

/// The pitch [Hz] and the activity in each window of ten seconds of an audio stream, each row of which is a sample.
fn pitches(channels: &[(&str, &str)], rate_hz: f64, rows: &[Vec<f64>]) -> Vec<[f64; 2]> {
    let feature = built(Signal::Audio, Some(vec![10.0]));
    let subject = Subject { about: About::Person, id: "p1".into() };
    let stream = Stream::raw("/humans/persons/p1/headset/audio", subject, Shape::Wave);
    let stream = Stream { signal: Signal::Audio, rate_hz, ..stream }.with_channels(channels);
    assert!(feature.accepts(&stream));
    let (mut extractor, mut out) = (feature.start(&stream), Outputs::new());
    extractor.join(StreamId(0), &stream, &mut out);
    for (number, chunk) in rows.chunks(100).enumerate() {
        let begin_ns = (number as f64 * 100.0 / rate_hz * 1e9) as i64;
        let run = Wave {
            period_ns: 1e9 / rate_hz,
            channels: channels.len() as u32,
            samples: chunk.concat().into(),
        };
        let period_ns = 1e9 / rate_hz;
        let here = wave(begin_ns, &[]);
        let sample = Sample { data: Data::Wave(run), period_ns, ..here };
        extractor.push(&sample, &mut out);
    }
    let names = &out.streams()[0].channels;
    let place = |name: &str| names.iter().position(|channel| channel.name == name).unwrap();
    let wanted = ["VOICE_Pitch_Median", "VOICE_Activity"].map(place);
    let of_window = |data: &Data| match data {
        Data::Feature(window) => Some(wanted.map(|place| window.values[place])),
        _ => None,
    };
    out.samples().filter_map(|(_, _, data)| of_window(data)).collect()
}

#[test]
fn a_voice_is_the_same_from_samples_and_from_their_frames() {
    let rate_hz = 8000.0;
    let sample = |k: usize| {
        let secs = k as f64 / rate_hz;
        let buzz = |n: i32| (std::f64::consts::TAU * 200.0 * f64::from(n) * secs).sin();
        if secs % 2.0 < 1.0 { 0.02 * (1..9).map(buzz).sum::<f64>() } else { 0.0 }
    };
    let samples: Vec<Vec<f64>> = (0..160_000).map(|k| vec![sample(k)]).collect();
    let mut framer = voice::Framer::new(&voice::Settings::default(), rate_hz).unwrap();
    let frames = samples.iter().filter_map(|sample| framer.push(0, sample[0]));
    let frames: Vec<Vec<f64>> = frames.map(|frame| frame.numbers().to_vec()).collect();
    let of_samples = pitches(&[("audio", "1")], rate_hz, &samples);
    let of_frames = pitches(&voice::CHANNELS, 100.0, &frames);
    // The last 0.2 s of a window are not yet known when it is reported.
    for [pitch_hz, activity] in of_samples[9..].iter().chain(&of_frames[9..]) {
        assert!((pitch_hz - 200.0).abs() < 0.5 && (activity - 0.5).abs() < 0.05, "{activity}");
    }
    assert!(of_samples.len() == 19 && of_frames.len() == 19);
}
