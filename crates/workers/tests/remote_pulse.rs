//! A pulse in drawn faces, as JPEG: from pixels to a rate.

use std::f64::consts::TAU;

use jpeg_encoder::{ColorType, Encoder};
use teampulse_signal::analysis::{Measured, Span};
use teampulse_signal::view;
use teampulse_vision::frame::Frames;
use teampulse_vision::picture::Picture;

const SIZE: (u16, u16) = (240, 180);
const FPS: f64 = 20.0;
const SECS: f64 = 32.0;
/// The amplitude of a pulse in green [share], and of the noise of a sensor [of 255].
const PULSE: f64 = 0.006;
const NOISE: f64 = 4.0;

/// A face in front of a wall, whose head sways; `pulse` is the blood of the moment, from -1 to 1.
fn drawn(frame: u32, tone: [f64; 3], pulse: f64) -> Vec<u8> {
    let t = f64::from(frame) / FPS;
    let centre = (120.0 + 4.0 * (TAU * 0.23 * t).sin(), 90.0 + 2.0 * (TAU * 0.31 * t).cos());
    let light = 1.0 + 0.02 * (TAU * 0.02 * t).sin();
    let skin = [0.33, 1.0, 0.6].map(|part| light * (1.0 - PULSE * part * pulse));
    let mut random = 0x9e37_79b9_u32.wrapping_mul(frame + 1);
    let mut rgb = Vec::with_capacity(usize::from(SIZE.0) * usize::from(SIZE.1) * 3);
    for row in 0..SIZE.1 {
        for column in 0..SIZE.0 {
            let (x, y) = (f64::from(column) - centre.0, f64::from(row) - centre.1);
            let is_face = (x / 40.0).powi(2) + (y / 55.0).powi(2) < 1.0;
            // A face is round: darker at its edge.
            let round = 1.0 - 0.2 * ((x / 40.0).powi(2) + (y / 55.0).powi(2));
            let wall = 0.4 + 0.1 * f64::from(column % 40 < 20);
            for part in 0..3 {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = NOISE * (f64::from(random >> 8) / f64::from(1 << 24) - 0.5) * 2.0;
                let colour = if is_face { tone[part] * round * skin[part] } else { wall * light };
                rgb.push((255.0 * colour + noise).clamp(0.0, 255.0) as u8);
            }
        }
    }
    let mut file = Vec::new();
    Encoder::new(&mut file, 90)
        .encode(&rgb, SIZE.0, SIZE.1, ColorType::Rgb)
        .expect("it is a picture");
    file
}

/// What is seen of a face in the last 30 s, with a pulse [1/min] or none.
fn seen(tone: [f64; 3], rate: Option<f64>) -> Measured {
    let mut frames = Frames::default();
    let mut analysis = view::analysis::causal(&view::CHANNELS.map(str::to_owned));
    for frame in 0..(SECS * FPS) as u32 {
        let t = f64::from(frame) / FPS;
        let pulse = rate.map_or(0.0, |rate| (TAU * rate / 60.0 * t).sin());
        let picture = Picture::from_jpeg(&drawn(frame, tone, pulse)).expect("it is a JPEG");
        let seen = frames.push(&picture, t);
        let [red, green, blue] = seen.colour;
        let presence = f64::from(u8::from(seen.is_present));
        let numbers = [seen.brightness, seen.moving, presence, seen.skin, red, green, blue];
        analysis.push((t * 1e9) as i64, &numbers);
    }
    analysis.measure(Span { begin_ns: 1_500_000_000, end_ns: (SECS * 1e9) as i64 })
}

fn check(tone: [f64; 3], rate: f64) {
    let measured = seen(tone, Some(rate));
    let found = measured.values[0].expect("there is a pulse");
    eprintln!(
        "a drawn face with {rate}/min: {found:.2}/min (bar 2/min), quality {:.2}, {:.0} % present",
        measured.quality,
        100.0 * measured.values[3].unwrap_or(f64::NAN)
    );
    assert!((found - rate).abs() < 2.0 && measured.quality > 0.5, "{measured:?}");
    assert!(measured.values[3].expect("it is known") > 0.9, "{measured:?}");
}

#[test]
fn a_light_face_has_a_slow_pulse() {
    check([0.86, 0.66, 0.56], 62.0);
}

#[test]
fn a_tanned_face_has_a_usual_pulse() {
    check([0.68, 0.47, 0.37], 97.0);
}

#[test]
fn a_dark_face_has_a_fast_pulse() {
    check([0.42, 0.27, 0.2], 134.0);
}

#[test]
fn a_face_without_a_pulse_has_none() {
    let measured = seen([0.68, 0.47, 0.37], None);
    eprintln!(
        "a drawn face without a pulse: {:?}, quality {:.2}",
        measured.values[0], measured.quality
    );
    assert!(measured.values[0].is_err() && measured.quality < 0.3, "{measured:?}");
}
