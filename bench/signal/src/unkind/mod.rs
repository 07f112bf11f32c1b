//! Signals as hard as real ones, but with known truth, to see whether a number is ever confidently wrong.

mod random;
mod noise;
mod heart;
mod ecg;
mod foreign;
mod ppg;
mod breath;
mod belt;
mod skin;
mod windows;
mod reliability;
mod measure;
mod peers;
mod variability;

use std::str::FromStr;

use random::Random;

pub use measure::measure;
pub use peers::write;
pub use variability::measure as measure_variability;
pub use windows::{How, Window, windows};

/// Makes a signal of a kind.
pub type Make = fn(&mut Random, &'static str) -> Unkind;

/// A signal whose truth is known.
pub struct Unkind {
    pub kind: &'static str,
    pub is_ppg: bool,
    pub rate_hz: f64,
    pub signal: Vec<f64>,
    pub beats_secs: Vec<f64>,
    /// The spans in which something hid the heart [s].
    pub glitches_secs: Vec<(f64, f64)>,
    /// Whether a correct detector can find the rate.
    pub is_fair: bool,
}

impl Unkind {
    fn new(kind: &'static str, rate_hz: f64, signal: Vec<f64>, beats_secs: Vec<f64>) -> Unkind {
        let is_fair = !beats_secs.is_empty();
        let glitches_secs = Vec::new();
        Unkind { kind, is_ppg: false, rate_hz, signal, beats_secs, glitches_secs, is_fair }
    }

    /// Wraps a recorded ECG.
    pub fn recorded(rate_hz: f64, signal: Vec<f64>, beats_secs: Vec<f64>) -> Unkind {
        Unkind::new("recorded", rate_hz, signal, beats_secs)
    }

    /// Changes the samples of a span.
    fn over(&mut self, begin_secs: f64, secs: f64, change: impl FnMut(&mut f64)) {
        let place = |secs: f64| ((secs * self.rate_hz).max(0.0) as usize).min(self.signal.len());
        let (begin, end) = (place(begin_secs), place(begin_secs + secs));
        self.signal[begin..end.max(begin)].iter_mut().for_each(change);
    }
}

/// Signals for choosing settings, or for judging what was chosen: no seed is in both.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Seeds {
    Choosing,
    Judging,
    /// Seeds from this one on, for an independent judgement.
    From(u64),
}

impl FromStr for Seeds {
    type Err = String;

    fn from_str(word: &str) -> Result<Seeds, String> {
        match word {
            "choosing" => Ok(Seeds::Choosing),
            "judging" => Ok(Seeds::Judging),
            other => match other.parse() {
                Ok(first) => Ok(Seeds::From(first)),
                Err(_) => {
                    Err(format!("`{other}` is neither `choosing`, `judging` nor a first seed"))
                }
            },
        }
    }
}

impl Seeds {
    fn first(self) -> u64 {
        match self {
            Seeds::Choosing => 1,
            Seeds::Judging => 1_000_000_007,
            Seeds::From(first) => first,
        }
    }

    /// Makes signals of each kind in turn.
    pub fn signals(self, count: usize) -> impl Iterator<Item = Unkind> {
        let kinds: Vec<(&'static str, Make)> = ecg::KINDS.into_iter().chain(ppg::KINDS).collect();
        of_kinds(kinds, self.first(), count)
    }

    /// Makes signals of each kind with foreign components, in turn.
    pub fn foreign(self, count: usize) -> impl Iterator<Item = Unkind> {
        let kinds = foreign::KINDS.map(|(kind, make, _)| (kind, make)).to_vec();
        of_kinds(kinds, self.first() + 900_000, count)
    }
}

fn of_kinds(
    kinds: Vec<(&'static str, Make)>,
    first: u64,
    count: usize,
) -> impl Iterator<Item = Unkind> {
    (0..count).map(move |number| {
        let (kind, make) = kinds[number % kinds.len()];
        make(&mut Random::new(first + number as u64), kind)
    })
}
