//! Writes the frames and values of voices in files of samples, which `voices.py` compares with the truth and with
//! peers.

use std::error::Error;
use std::fs;
use std::path::Path;

use serde_json::json;
use teampulse_signal::analysis::Recording;
use teampulse_signal::voice::analysis::whole;
use teampulse_signal::voice::{Framer, Settings};

/// Writes `X.frames` beside each `X.f64` of a folder (samples at a rate [Hz], as 64-bit numbers): the time [s] and the
/// numbers of each frame. Prints the values of each file as JSON, one line per file.
pub fn write(folder: &Path, rate_hz: &str) -> Result<bool, Box<dyn Error>> {
    let rate_hz: f64 = rate_hz.parse()?;
    let mut files: Vec<_> = fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    files.sort_by_key(fs::DirEntry::file_name);
    for file in files.iter().map(fs::DirEntry::path) {
        if file.extension().is_none_or(|extension| extension != "f64") {
            continue;
        }
        let bytes = fs::read(&file)?;
        let samples = bytes
            .chunks_exact(8)
            .map(|number| f64::from_le_bytes(number.try_into().expect("a chunk of 8 has 8")));
        let samples: Vec<f64> = samples.collect();
        fs::write(file.with_extension("frames"), frames(&samples, rate_hz)?)?;
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        println!("{}", json!({ "file": name, "values": values(samples, rate_hz)? }));
    }
    Ok(true)
}

fn frames(samples: &[f64], rate_hz: f64) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut framer = Framer::new(&Settings::default(), rate_hz)?;
    let mut bytes = Vec::new();
    for (number, sample) in samples.iter().enumerate() {
        let at_ns = (number as f64 / rate_hz * 1e9).round() as i64;
        if let Some(frame) = framer.push(at_ns, *sample) {
            bytes.extend((frame.at_ns as f64 / 1e9).to_le_bytes());
            bytes.extend(frame.numbers().iter().flat_map(|number| number.to_le_bytes()));
        }
    }
    Ok(bytes)
}

fn values(samples: Vec<f64>, rate_hz: f64) -> Result<serde_json::Value, Box<dyn Error>> {
    let recording = Recording { rate_hz, begin_ns: 0, channels: &[samples] };
    let voice = whole(&Settings::default(), &recording)?;
    let measured = voice.windows.measure(recording.span());
    let values = voice.windows.values().iter().zip(&measured.values);
    let values = values.map(|(value, measured)| (value.name.to_string(), json!(measured.ok())));
    Ok(serde_json::Value::Object(values.collect()))
}
