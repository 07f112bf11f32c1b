//! Recorded noise of moving electrodes, and other records with the same noise added.

use std::error::Error;
use std::path::Path;

use crate::records::{RATE_HZ, Record, column};

/// Where the segments of other records begin [samples]: at 5 and at 15 minutes.
const BEGINS: [usize; 2] = [108_000, 324_000];
/// The distance around a beat within which its height is measured [samples]: 50 ms to each side.
const REACH: usize = 18;

/// Two minutes of noise, and the record that it came with.
pub struct Noise {
    samples: Vec<f64>,
    clean: Record,
    height: f64,
}

impl Noise {
    /// Reads two recordings that differ only in the height of the same noise; the noise and the clean signal are
    /// computed from them.
    pub fn read(folder: &Path) -> Result<Noise, Box<dyn Error>> {
        let beats = column(&folder.join("118e00_ann.csv"))?;
        let loud = column(&folder.join("118e00.csv"))?;
        let soft = column(&folder.join("118e06.csv"))?;
        let pairs = loud.iter().zip(&soft);
        let samples: Vec<f64> =
            pairs.map(|(loud, soft)| (loud - soft) / (1.0 - gain(6.0))).collect();
        let signal: Vec<f64> =
            loud.iter().zip(&samples).map(|(loud, noise)| loud - noise).collect();
        let height = height(&signal, &beats);
        Ok(Noise { samples, clean: Record { name: "118".into(), signal, beats }, height })
    }

    /// Returns the record that the noise came with, at this signal-to-noise ratio.
    pub fn own(&self, decibels: f64) -> Record {
        self.over(&self.clean, decibels)
    }

    /// Returns two minutes of each other record, with noise as high relative to its beats.
    pub fn others(&self, records: &[Record], decibels: f64) -> Vec<Record> {
        let others = records.iter().filter(|record| record.name != self.clean.name);
        let length = self.samples.len();
        let places = others.flat_map(|record| BEGINS.map(|begin| (record, begin)));
        let whole = places.filter(|(record, begin)| begin + length <= record.signal.len());
        let pieces = whole.map(|(record, begin)| piece(record, begin, length));
        pieces.map(|piece| self.over(&piece, decibels)).collect()
    }

    fn over(&self, record: &Record, decibels: f64) -> Record {
        let scale = gain(decibels) * height(&record.signal, &record.beats) / self.height;
        let pairs = record.signal.iter().zip(&self.samples);
        let signal = pairs.map(|(sample, noise)| sample + scale * noise).collect();
        Record { name: record.name.clone(), signal, beats: record.beats.clone() }
    }
}

fn piece(record: &Record, begin: usize, length: usize) -> Record {
    let beats = record.beats.iter().map(|beat| beat - begin as f64);
    let inside = beats.filter(|beat| (0.0..length as f64).contains(beat));
    Record {
        name: format!("{} from {:.0} s", record.name, begin as f64 / RATE_HZ),
        signal: record.signal[begin..begin + length].to_vec(),
        beats: inside.collect(),
    }
}

fn gain(decibels: f64) -> f64 {
    10f64.powf(-decibels / 20.0)
}

/// Returns the median over beats of the highest minus the lowest sample.
fn height(signal: &[f64], beats: &[f64]) -> f64 {
    let around = |&beat: &f64| {
        let beat = beat as usize;
        let around = signal.get(beat.checked_sub(REACH)?..=beat + REACH)?;
        let high = around.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some(high - around.iter().copied().fold(f64::INFINITY, f64::min))
    };
    let mut heights: Vec<f64> = beats.iter().filter_map(around).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let middle = heights.len() / 2;
    if heights.len().is_multiple_of(2) {
        heights[middle - 1].midpoint(heights[middle])
    } else {
        heights[middle]
    }
}
