//! The voice in sounds whose pitch, pauses, jitter and syllables are known.

use std::f64::consts::TAU;

use teampulse_signal::analysis::{Measured, Reason, Recording, Span};
use teampulse_signal::voice::analysis::{causal, of_frames, whole, whole_of_frames};
use teampulse_signal::voice::{CHANNELS, Frame, Framer, Settings};

const RATE_HZ: f64 = 16_000.0;

/// Pulses of a voice: their periods vary by `jitter` to and fro, their amplitudes by `shimmer`.
fn voice(secs: f64, pitch_hz: f64, jitter: f64, shimmer: f64) -> Vec<f64> {
    let mut samples = vec![0.0; (secs * RATE_HZ) as usize];
    let (mut at_secs, mut sign) = (0.005, 1.0);
    while at_secs < secs - 0.03 {
        let amplitude = 0.4 * (1.0 + sign * shimmer / 2.0);
        let begin = (at_secs * RATE_HZ).ceil() as usize;
        for (number, sample) in samples.iter_mut().enumerate().skip(begin).take(400) {
            let since = number as f64 / RATE_HZ - at_secs;
            *sample += amplitude * (-since * 400.0).exp() * (TAU * 600.0 * since).sin();
        }
        at_secs += (1.0 + sign * jitter / 2.0) / pitch_hz;
        sign = -sign;
    }
    samples
}

/// Noise of a room, 60 dB below full scale.
fn noise(count: usize) -> impl Iterator<Item = f64> {
    (0..count as u64).map(|k| ((k * k % 977 * 31 % 1009) as f64 / 1009.0 - 0.5) * 0.003)
}

/// A second of voice and a second of pause, in turn.
fn talk(secs: usize) -> Vec<f64> {
    let voice = voice(1.0, 140.0, 0.0, 0.0);
    let count = voice.len();
    let pause = |k: usize| if k / count % 2 == 1 { 0.0 } else { voice[k % count] };
    noise(secs * count).enumerate().map(|(k, noise)| noise + pause(k)).collect()
}

fn time_ns(sample: usize) -> i64 {
    (sample as f64 / RATE_HZ * 1e9).round() as i64
}

fn frames(samples: &[f64]) -> Vec<Frame> {
    let mut framer = Framer::new(&Settings::default(), RATE_HZ).expect("a usual rate");
    let samples = samples.iter().enumerate();
    samples.filter_map(|(k, sample)| framer.push(time_ns(k), *sample)).collect()
}

fn measured(samples: Vec<f64>) -> impl Fn(&str) -> Result<f64, Reason> {
    let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels: &[samples] };
    let voice = whole(&Settings::default(), &recording).expect("a usual rate");
    let Measured { values, .. } = voice.windows.measure(recording.span());
    move |name| {
        let place = voice.windows.values().iter().position(|value| value.name == name);
        values[place.expect("a value of this name")]
    }
}

#[test]
fn talk_and_pauses_are_what_they_are() {
    let value = measured(talk(12));
    assert!((value("VOICE_Pitch_Median").unwrap() / 140.0 - 1.0).abs() < 0.002);
    assert!((value("VOICE_Activity").unwrap() - 0.5).abs() < 0.03);
    assert!((value("VOICE_Pause_Mean").unwrap() - 1.0).abs() < 0.05);
    assert!((value("VOICE_Pauses").unwrap() - 5.0 / 11.0 * 60.0).abs() < 1.0);
    assert!((value("VOICE_Speaking_Rate").unwrap() - 6.0 / 11.0).abs() < 0.1);
    assert!(value("VOICE_Level").unwrap() - value("VOICE_Noise").unwrap() > 25.0);
}

#[test]
fn a_room_where_nobody_speaks_has_a_floor_and_no_pitch() {
    let value = measured(noise(160_000).collect());
    assert_eq!(value("VOICE_Activity"), Ok(0.0));
    for of_speech in ["VOICE_Level", "VOICE_Pitch_Median", "VOICE_Pause_Mean", "VOICE_Jitter"] {
        assert_eq!(value(of_speech), Err(Reason::Nothing), "{of_speech}");
    }
    assert!((value("VOICE_Noise").unwrap() + 61.0).abs() < 1.0);
}

#[test]
fn a_hum_is_no_voice_and_one_that_lives_is() {
    let quality = |samples: Vec<f64>| {
        let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels: &[samples] };
        let voice = whole(&Settings::default(), &recording).expect("a usual rate");
        let Measured { quality, values, .. } = voice.windows.measure(recording.span());
        (quality, values[5])
    };
    let turns = |pitch_hz: f64, trill: f64| {
        let pitch_hz = move |k: usize| pitch_hz * (1.0 + trill * (k as f64 / RATE_HZ * TAU).sin());
        (0..160_000).scan(0.0, move |turns, k| {
            *turns += pitch_hz(k) / RATE_HZ;
            Some(*turns)
        })
    };
    let buzz = |turns: f64| (1..8).map(|n| 0.02 * (TAU * f64::from(n) * turns).sin()).sum::<f64>();
    let (hum, reason) = quality(turns(120.0, 0.0).map(buzz).collect());
    assert!(hum < 0.2 && reason == Err(Reason::Quality), "{hum} {reason:?}");
    let (voice, pitch_hz) = quality(turns(120.0, 0.1).map(buzz).collect());
    assert!(voice > 0.9 && pitch_hz.is_ok(), "{voice} {pitch_hz:?}");
}

#[test]
fn jitter_and_shimmer_are_those_of_the_pulses() {
    for (jitter, shimmer) in [(0.0, 0.0), (0.01, 0.05), (0.02, 0.1)] {
        let value = measured(voice(5.0, 120.0, jitter, shimmer));
        let (jitters, shimmers) = (value("VOICE_Jitter"), value("VOICE_Shimmer"));
        assert!((jitters.unwrap() - jitter).abs() < 0.002, "{jitters:?} of {jitter}");
        assert!((shimmers.unwrap() - shimmer).abs() < 0.01, "{shimmers:?} of {shimmer}");
    }
}

#[test]
fn each_swell_of_a_voice_is_a_syllable() {
    let swell = |k: usize| 0.55 - 0.45 * (TAU * 4.0 * k as f64 / RATE_HZ).cos();
    let voice = voice(10.0, 180.0, 0.0, 0.0);
    let value = measured(voice.iter().enumerate().map(|(k, sample)| swell(k) * sample).collect());
    assert!((value("VOICE_Speaking_Rate").unwrap() - 4.0).abs() < 0.15);
}

#[test]
fn missing_samples_are_unknown_and_nothing_else_is() {
    let mut samples = talk(6);
    samples[40_000..48_000].fill(f64::NAN);
    samples[70_000] = f64::INFINITY;
    let frames = frames(&samples);
    let unknown = frames.iter().filter(|frame| !frame.is_known()).count();
    assert!((55..=63).contains(&unknown), "{unknown}");
    assert!(frames.iter().all(|frame| frame.is_known() || frame.pitch_hz.is_nan()));
}

#[test]
fn no_samples_of_any_size_do_harm() {
    for size in [1e-320, 1e-100, 1.0, 1e9, 1e99] {
        let samples: Vec<f64> = talk(2).iter().map(|sample| sample * size).collect();
        for frame in frames(&samples) {
            assert!(frame.pitch_hz.is_nan() || (60.0..520.0).contains(&frame.pitch_hz));
        }
    }
    assert!(frames(&vec![0.7; 32_000]).iter().all(|frame| !frame.is_speech()));
}

#[test]
fn samples_as_they_come_the_whole_and_frames_agree() {
    let samples = talk(12);
    let span = Span { begin_ns: 1_000_000_000, end_ns: 11_000_000_000 };
    let mut running = causal(&Settings::default(), RATE_HZ).unwrap();
    for (k, sample) in samples.iter().enumerate() {
        running.push(time_ns(k), &[*sample]);
        if k % 9973 == 0 {
            std::hint::black_box(running.measure(span));
            running.forget(span.begin_ns);
        }
    }
    let mut framed = of_frames();
    let frames = frames(&samples);
    for frame in &frames {
        framed.push(frame.at_ns, &frame.numbers());
    }
    let column = |index: usize| frames.iter().map(|frame| frame.numbers()[index]).collect();
    let columns: Vec<Vec<f64>> = (0..CHANNELS.len()).map(column).collect();
    let begin_ns = frames[0].at_ns;
    let of_columns = Recording { rate_hz: 100.0, begin_ns, channels: &columns };
    let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels: &[samples] };
    let expected = running.measure(span);
    assert!(expected.coverage > 0.999);
    let of_whole = whole(&Settings::default(), &recording).unwrap();
    assert_eq!(of_whole.windows.measure(span), expected);
    assert_eq!(framed.measure(span), expected);
    assert_eq!(whole_of_frames(&of_columns).windows.measure(span), expected);
}
