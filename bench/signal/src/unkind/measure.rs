//! Figures for hard signals, by kind.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use super::belt::belts;
use super::breath::walks;
use super::peers::Peers;
use super::reliability::Reliability;
use super::skin::skins;
use super::windows::{How, Window, windows};
use super::{Seeds, Unkind, foreign};

/// The quality above which a wrong rate looks trustworthy.
const TRUSTED: f64 = 0.8;
/// The tolerance for a found beat [s].
const FOUND_SECS: f64 = 0.15;
/// The smallest number of windows in a tenth from which its reliability is judged.
const LEAST_WINDOWS: usize = 200;

/// The results for the windows of a kind.
#[derive(Default)]
struct Outcome {
    windows: usize,
    /// Windows above the trusted quality whose rate is wrong.
    confidently_wrong: usize,
    /// Windows above the trusted quality whose rate is right.
    trusted_right: usize,
    /// Windows that a correct detector can measure, and those that were measured correctly.
    fair: usize,
    right: usize,
    /// The longest time after a glitch until beats were found again [s].
    lost_secs: f64,
}

fn is_confidently_wrong(window: &Window) -> bool {
    window.has_value && window.quality > TRUSTED && !window.is_right
}

impl Outcome {
    fn add(&mut self, window: &Window, is_fair: bool) {
        self.windows += 1;
        self.confidently_wrong += usize::from(is_confidently_wrong(window));
        let is_trusted = window.has_value && window.quality > TRUSTED;
        self.trusted_right += usize::from(is_trusted && window.is_right);
        self.fair += usize::from(is_fair);
        self.right += usize::from(is_fair && window.has_value && window.is_right);
    }
}

/// The results for all windows of one analysis.
#[derive(Default)]
struct Outcomes {
    kinds: BTreeMap<&'static str, Outcome>,
    ecg: Reliability,
    ppg: Reliability,
}

/// Prints the figures with their bars for this many signals; returns whether all bars were met. `peers` is a table of
/// the beats that other programs found, as `unkind_peers.py` writes it.
pub fn measure(seeds: &str, count: &str, peers: Option<&Path>) -> Result<bool, Box<dyn Error>> {
    let (seeds, count): (Seeds, usize) = (seeds.parse()?, count.parse()?);
    let mut met = true;
    for how in [How::Whole, How::Causal] {
        let mut others = Peers::read(peers)?;
        let Outcomes { kinds, ecg, ppg } = outcomes(seeds.signals(count), how, &mut others)?;
        met &= report(how, &kinds);
        met &= diagram(how, "ECG", &ecg) & diagram(how, "PPG", &ppg);
        others.report(how);
    }
    met &= beside_others(seeds, count / 5)?;
    Ok(met & walks(seeds, 100)? & belts(seeds, 100)? & skins(seeds, 100)?)
}

/// Prints the figures for ECGs with foreign components, such as a second heart.
fn beside_others(seeds: Seeds, count: usize) -> Result<bool, Box<dyn Error>> {
    let mut met = true;
    for how in [How::Whole, How::Causal] {
        let outcomes = outcomes(seeds.foreign(count), how, &mut Peers::read(None)?)?;
        met &= report_foreign(how, &outcomes);
    }
    Ok(met)
}

/// Analyses signals, and prints each window that is confidently wrong.
fn outcomes(
    signals: impl Iterator<Item = Unkind>,
    how: How,
    others: &mut Peers,
) -> Result<Outcomes, Box<dyn Error>> {
    let mut outcomes = Outcomes::default();
    for (number, made) in signals.enumerate() {
        let (windows, found_secs) = windows(&made, how)?;
        let outcome = outcomes.kinds.entry(made.kind).or_default();
        for window in &windows {
            let is_fair = others.can_measure(&made, number, window).unwrap_or(made.is_fair);
            outcome.add(window, is_fair);
            if made.is_ppg {
                outcomes.ppg.add(window);
            } else {
                outcomes.ecg.add(window);
            }
            if is_confidently_wrong(window) {
                let Window { rate_per_min, true_per_min, begin_secs, quality, .. } = window;
                println!(
                    "      unkind, {how:?}, {}, signal {number} from {begin_secs} s: {rate_per_min:.1} per minute instead of {true_per_min:.1}, quality {quality:.2}",
                    made.kind
                );
            }
        }
        outcome.lost_secs = outcome.lost_secs.max(lost_secs(&made, &found_secs));
    }
    Ok(outcomes)
}

/// Prints the results for windows with foreign components.
fn report_foreign(how: How, outcomes: &Outcomes) -> bool {
    let mut met = true;
    for (kind, _, most_wrong) in foreign::KINDS {
        let Some(outcome) = outcomes.kinds.get(kind) else { continue };
        let Outcome { windows, confidently_wrong, trusted_right, .. } = *outcome;
        let text = format!(
            "{kind}: {confidently_wrong} of {windows} windows above quality {TRUSTED} and more than 10 % off, {trusted_right} above it and right"
        );
        match most_wrong {
            Some(share) => {
                let passed = confidently_wrong as f64 <= share * windows as f64;
                met &= line(passed, how, &format!("{text} (bar {} %)", 100.0 * share));
            }
            None => println!("      unkind, {how:?}: {text}"),
        }
    }
    met
}

fn report(how: How, kinds: &BTreeMap<&str, Outcome>) -> bool {
    let mut all = Outcome::default();
    for (kind, outcome) in kinds {
        let Outcome { windows, confidently_wrong, fair, right, lost_secs, .. } = *outcome;
        let percent = 100.0 * right as f64 / fair.max(1) as f64;
        println!(
            "      unkind, {how:?}, {kind}: {confidently_wrong} of {windows} windows confidently wrong, {percent:.0} % of {fair} right, beats lost for {lost_secs:.1} s"
        );
        all.windows += windows;
        all.confidently_wrong += confidently_wrong;
        all.fair += fair;
        all.right += right;
        if !kind.starts_with("ppg") && (kind.contains("rail") || kind.contains("steps")) {
            all.lost_secs = all.lost_secs.max(lost_secs);
        }
    }
    let right = 100.0 * all.right as f64 / all.fair.max(1) as f64;
    let lines = [
        (
            all.confidently_wrong * 10_000 <= all.windows,
            format!(
                "{} of {} windows above quality {TRUSTED} and more than 10 % off (bar 1 in 10000)",
                all.confidently_wrong, all.windows
            ),
        ),
        (
            right >= 90.0,
            format!(
                "{right:.1} % of {} windows that can be measured are measured right (bar 90 %)",
                all.fair
            ),
        ),
        (
            all.lost_secs <= 5.0,
            format!("beats lost for {:.1} s after a glitch (bar 5 s)", all.lost_secs),
        ),
    ];
    lines.iter().fold(true, |met, (passed, text)| line(*passed, how, text) && met)
}

fn diagram(how: How, signal: &str, reliability: &Reliability) -> bool {
    let mut met = true;
    for (quality, right, count) in reliability.tenths() {
        let off = right - quality;
        let text = format!(
            "{signal}, quality {quality:.2}: {:.1} % of {count} windows right (bar 5 points)",
            100.0 * right
        );
        met &= line(off.abs() <= 0.05 || count < LEAST_WINDOWS, how, &text);
    }
    met
}

fn line(passed: bool, how: How, text: &str) -> bool {
    println!("{}  unkind, {how:?}: {text}", if passed { "pass" } else { "FAIL" });
    passed
}

/// Returns the longest time for which beats after a glitch were not found [s].
fn lost_secs(made: &Unkind, found_secs: &[f64]) -> f64 {
    let hit = |at: f64| found_secs.iter().any(|found| (found - at).abs() <= FOUND_SECS);
    let lost = |&(_, end): &(f64, f64)| {
        let after = made.beats_secs.iter().copied().filter(|&at| at > end);
        let missed = after.clone().take_while(|&at| !hit(at)).last();
        missed.map_or(0.0, |last| last - end)
    };
    made.glitches_secs.iter().map(lost).fold(0.0, f64::max)
}
