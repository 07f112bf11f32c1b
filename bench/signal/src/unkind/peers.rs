//! The same signals for other programs, and the beats that these found.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use super::windows::{How, Window, rate_per_min};
use super::{Seeds, Unkind};

/// A window counts as measurable if at least this many programs measure it correctly.
const AGREEING: usize = 2;

/// Writes signals as little-endian numbers, and a table that describes them.
pub fn write(seeds: &str, count: &str, folder: &Path) -> Result<bool, Box<dyn Error>> {
    let (seeds, count): (Seeds, usize) = (seeds.parse()?, count.parse()?);
    std::fs::create_dir_all(folder)?;
    let mut table = String::from("number,ppg,rate_hz\n");
    for (number, made) in seeds.signals(count).enumerate() {
        let bytes: Vec<u8> = made.signal.iter().flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(folder.join(format!("{number}.f64")), bytes)?;
        writeln!(table, "{number},{},{}", u8::from(made.is_ppg), made.rate_hz)?;
    }
    std::fs::write(folder.join("signals.csv"), table)?;
    Ok(true)
}

#[derive(Default)]
struct Tally {
    right: usize,
    of: usize,
}

/// Beats [s] by the number of the signal and the name of the program.
pub struct Peers {
    beats: BTreeMap<usize, Vec<(String, Vec<f64>)>>,
    tallies: BTreeMap<(bool, String), Tally>,
}

impl Peers {
    /// Reads a table as written by `unkind_peers.py`: number, program and times [s], separated by commas.
    pub fn read(table: Option<&Path>) -> Result<Peers, Box<dyn Error>> {
        let mut beats: BTreeMap<usize, Vec<(String, Vec<f64>)>> = BTreeMap::new();
        let text = table.map(std::fs::read_to_string).transpose()?.unwrap_or_default();
        for line in text.lines() {
            let mut words = line.split(',');
            let number = words.next().unwrap_or_default().parse()?;
            let name = words.next().unwrap_or_default().to_owned();
            let times = words.filter(|word| !word.is_empty()).map(str::parse);
            beats.entry(number).or_default().push((name, times.collect::<Result<_, _>>()?));
        }
        Ok(Peers { beats, tallies: BTreeMap::new() })
    }

    /// Whether peers find the rate of a window; `None` without peers.
    pub fn can_measure(&mut self, made: &Unkind, number: usize, window: &Window) -> Option<bool> {
        let mut agreeing = 0;
        for (name, beats) in self.beats.get(&number)? {
            let end_secs = window.begin_secs + 30.0;
            let off = rate_per_min(beats, window.begin_secs, end_secs) - window.true_per_min;
            let is_right = window.true_per_min > 0.0 && off.abs() <= 0.1 * window.true_per_min;
            agreeing += usize::from(is_right);
            let tally = self.tallies.entry((made.is_ppg, name.clone())).or_default();
            tally.of += 1;
            tally.right += usize::from(is_right);
        }
        Some(agreeing >= AGREEING)
    }

    pub fn report(&self, how: How) {
        for ((is_ppg, name), Tally { right, of }) in
            self.tallies.iter().filter(|_| how == How::Whole)
        {
            let signal = if *is_ppg { "PPG" } else { "ECG" };
            let percent = 100.0 * *right as f64 / *of as f64;
            println!(
                "      unkind, {signal}: {name} is right in {percent:.1} % of {of} windows and flags none as unreliable"
            );
        }
    }
}
