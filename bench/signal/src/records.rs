//! Recorded ECGs with beats marked by experts.

use std::error::Error;
use std::path::Path;

/// Rate of the MIT-BIH databases [Hz].
pub const RATE_HZ: f64 = 360.0;

/// A recording with its beats [samples].
pub struct Record {
    pub name: String,
    pub signal: Vec<f64>,
    pub beats: Vec<f64>,
}

/// Reads the records in a folder in WFDB's format 212 (channel 0 [mV]), with beats in `*.beats.csv`, as far as the
/// signal extends.
pub fn mitdb(folder: &Path) -> Result<Vec<Record>, Box<dyn Error>> {
    let mut names: Vec<String> = std::fs::read_dir(folder)?
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.strip_suffix(".dat").map(Into::into))
        .collect();
    names.sort_unstable();
    names.into_iter().map(|name| mitdb_record(folder, name)).collect()
}

fn mitdb_record(folder: &Path, name: String) -> Result<Record, Box<dyn Error>> {
    let bytes = std::fs::read(folder.join(format!("{name}.dat")))?;
    let signal: Vec<f64> =
        bytes.chunks_exact(3).map(|pair| first_of_pair(pair[0], pair[1])).collect();
    let table = std::fs::read_to_string(folder.join(format!("{name}.beats.csv")))?;
    let beats = table.lines().skip(1).filter_map(|line| line.split(',').next()?.parse().ok());
    let beats = beats.filter(|&beat: &f64| beat < signal.len() as f64).collect();
    Ok(Record { name, signal, beats })
}

fn first_of_pair(low: u8, high: u8) -> f64 {
    let bits = i32::from(low) | (i32::from(high & 0x0f) << 8);
    let value = if bits < 2048 { bits } else { bits - 4096 };
    f64::from(value - 1024) / 200.0
}

/// Reads a column of numbers.
pub fn column(path: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    Ok(text.lines().filter_map(|line| line.trim().parse().ok()).collect())
}
