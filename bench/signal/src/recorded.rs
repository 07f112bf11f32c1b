//! The quality of recorded ECGs, unchanged and with recorded noise.

use std::error::Error;
use std::path::Path;

use crate::noise::Noise;
use crate::records::{RATE_HZ, Record, mitdb};
use crate::unkind::{How, Unkind, Window, windows};

/// The length of segments [s], as for synthetic signals.
const PIECE_SECS: f64 = 120.0;
/// The quality above which a wrong rate looks trustworthy.
const TRUSTED: f64 = 0.8;
/// The signal-to-noise ratios [dB].
const DECIBELS: [f64; 6] = [24.0, 18.0, 12.0, 6.0, 0.0, -6.0];

#[derive(Default)]
struct Count {
    all: usize,
    trusted: usize,
    wrong: usize,
}

/// Prints how many windows of 30 s are above the trusted quality, and how many of these are wrong.
///
/// Settings are chosen on records with even numbers, and judged on those with odd ones.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let records = mitdb(&data.join("ecg_mitdb"))?;
    let noise = Noise::read(&data.join("ecg_noise"))?;
    let mut met = report("as they are", &records)?;
    for decibels in DECIBELS {
        let noisy = noise.others(&records, decibels);
        met &= report(&format!("in noise of {decibels} dB"), &noisy)?;
    }
    Ok(met)
}

fn report(what: &str, records: &[Record]) -> Result<bool, Box<dyn Error>> {
    let mut counts = [Count::default(), Count::default()];
    for record in records {
        let number: usize = record.name.get(..3).unwrap_or_default().parse()?;
        for window in of_record(record)? {
            let count = &mut counts[number % 2];
            let is_trusted = window.has_value && window.quality > TRUSTED;
            count.all += 1;
            count.trusted += usize::from(is_trusted);
            count.wrong += usize::from(is_trusted && !window.is_right);
        }
    }
    let [even, odd] = &counts;
    let wrong = even.wrong + odd.wrong;
    println!(
        "{}  recorded ECGs {what}: {} of {} windows of odd records, {} of {} of even ones are above quality {TRUSTED}, {wrong} of them wrong (bar 0)",
        if wrong == 0 { "pass" } else { "FAIL" },
        odd.trusted,
        odd.all,
        even.trusted,
        even.all
    );
    Ok(wrong == 0)
}

/// Returns the windows of a record in segments, causal and for whole segments.
fn of_record(record: &Record) -> Result<Vec<Window>, Box<dyn Error>> {
    let length = (PIECE_SECS * RATE_HZ) as usize;
    let mut all = Vec::new();
    for (number, samples) in record.signal.chunks_exact(length).enumerate() {
        let begin = (number * length) as f64;
        let at_secs = |beat: &f64| (beat - begin) / RATE_HZ;
        let beats_secs = record.beats.iter().map(at_secs);
        let inside = beats_secs.filter(|at| (0.0..PIECE_SECS).contains(at)).collect();
        let piece = Unkind::recorded(RATE_HZ, samples.to_vec(), inside);
        for how in [How::Whole, How::Causal] {
            all.extend(windows(&piece, how)?.0);
        }
    }
    Ok(all)
}
