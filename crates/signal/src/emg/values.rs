//! The values of a span, and their recipes.

use super::analysis::Settings;
use super::channel::{Activity, Cell};
use super::faults::quality;
use super::frames::Features;
use super::store::Store;
use crate::analysis::{LEAST_COVERAGE, Measured, Reason, Span, Value};
use crate::slope::least_squares;

/// The smallest [quality] for which muscle activity is reported: below it, three quarters of the power came
/// from elsewhere, or most samples were clipped.
const LEAST_QUALITY: f64 = 0.25;
/// The shortest trend of the median frequency [s], and its fewest frames: two seconds of contraction.
const LEAST_TREND_SECS: f64 = 10.0;
const LEAST_TREND_FRAMES: usize = 15;

const FRAMES: &str = "mean over 0.25 s frames, 0.125 s apart";
/// The values of each channel: name, unit (`u` is the signal's), and recipe.
const OF_CHANNEL: [(&str, &str, &str); 18] = [
    ("EMG_RMS", "u", "root of the mean square over 0.25 s frames, 0.125 s apart"),
    ("EMG_MAV", "u", "mean absolute value"),
    ("EMG_IEMG", "u·s", "integral of the absolute value over a frame"),
    ("EMG_VAR", "u²", "sum of squares / (n − 1)"),
    ("EMG_WL", "u", "sum of absolute steps in a frame"),
    ("EMG_ZC", "1", "changes of sign in a frame"),
    ("EMG_SSC", "1", "turns in a frame"),
    (
        "EMG_MNF",
        "Hz",
        "mean frequency of the periodogram (Hann, mean removed) of frames within bursts, excluding rest \
         (of all frames while the channel has had no burst)",
    ),
    (
        "EMG_MDF",
        "Hz",
        "median frequency of the periodogram (Hann, mean removed) of frames within bursts, excluding rest \
         (of all frames while the channel has had no burst)",
    ),
    (
        "EMG_MDF_Slope",
        "Hz/min",
        "least-squares line through the median frequencies of frames within bursts, excluding rest \
         (of all frames while the channel has had no burst: a contraction without rest)",
    ),
    ("EMG_Amplitude_Mean", "u", "mean of the envelope (rectified, Butterworth 2 low-pass 6 Hz)"),
    ("EMG_MVC", "%", "100 · mean of the envelope / that of the maximal voluntary contraction"),
    ("EMG_Activation_N", "1", "bursts that begin in the window"),
    (
        "EMG_SQI",
        "1",
        "(1 − flat − clipped) · √((1 − mains or tones) · (1 − outside the band)); tones: share of the power of frames in three bins, with or without harmonics, or samples, from 0 at a half to 1 at all",
    ),
    ("EMG_Mains", "1", "share of 50 or 60 Hz in the power of the band, averaged over 1 s"),
    ("EMG_Outside", "1", "share of the power outside the band"),
    ("EMG_Flat", "1", "share of samples at which the signal has been constant for more than 0.2 s"),
    ("EMG_Clipped", "1", "share of samples clipped at an end of the range"),
];
/// The values that are means over frames.
const MEANS: std::ops::Range<usize> = 1..9;
const BURSTS: usize = 12;
/// The values from here on describe faults.
const SHARES: usize = 13;

/// All values in order: those of each channel, then those of pairs.
pub(super) fn values(settings: &Settings, band: &str) -> Vec<Value> {
    let of_channel = settings.channels.iter().flat_map(|channel| {
        let value = move |(index, &(name, unit, recipe)): (usize, &(&str, &str, &str))| {
            let recipe = match index {
                BURSTS => format!("{recipe}: {}; {band}", settings.bursts.recipe()),
                _ if MEANS.contains(&index) => format!("{recipe}; {FRAMES}; {band}"),
                SHARES.. => recipe.to_owned(),
                _ => format!("{recipe}; {band}"),
            };
            let unit = unit_of(unit, &settings.unit);
            Value::of_channel(name, &channel.name, unit, recipe)
        };
        OF_CHANNEL.iter().enumerate().map(value)
    });
    let of_pair = settings.antagonists.iter().map(|&[one, other]| {
        let [one, other] = [one, other].map(|index| settings.channels[index].name.as_str());
        let recipe = "mean of lower / higher · (lower + higher) of envelopes / MVC (Rudolph 2000)";
        let recipe = format!("{recipe}; {band}");
        Value::of_channel("EMG_CCI", &format!("{one}+{other}"), "1", recipe)
    });
    of_channel.chain(of_pair).collect()
}

/// The unit of a value of a signal in this unit; the unit of a plain number has no powers and is left out of products.
fn unit_of(unit: &str, signal: &str) -> String {
    match (unit, signal) {
        ("u²", "1") => "1".to_owned(),
        ("u·s", "1") => "s".to_owned(),
        _ => unit.replace('u', signal),
    }
}

pub(super) fn measure(settings: &Settings, store: &Store, span: Span) -> Measured {
    let expected = (span.secs() * store.rate_hz()).max(1.0);
    let channels = 0..settings.channels.len();
    let sums: Vec<Cell> = channels.map(|index| store.sums(span, index)).collect();
    let coverages: Vec<f64> =
        sums.iter().map(|sums| (sums.faults.usable / expected).min(1.0)).collect();
    let qualities: Vec<f64> = sums.iter().map(|sums| quality(&sums.faults)).collect();
    let covered = || (0..sums.len()).filter(|&index| coverages[index] >= LEAST_COVERAGE);
    let mut values = Vec::with_capacity(OF_CHANNEL.len() * sums.len() + settings.antagonists.len());
    for (index, sums) in sums.iter().enumerate() {
        let channel = Of { settings, store, span, index, sums };
        if coverages[index] < LEAST_COVERAGE {
            values.extend([Err(Reason::Gap); OF_CHANNEL.len()]);
        } else {
            channel.values(qualities[index] >= LEAST_QUALITY, &mut values);
        }
    }
    for (index, &[one, other]) in settings.antagonists.iter().enumerate() {
        let least = |of: &[f64]| of[one].min(of[other]);
        let has_mvc = [one, other].iter().all(|&k| settings.channels[k].mvc.is_some());
        values.push(match (has_mvc, store.contraction(span, index)) {
            (false, _) => Err(Reason::Missing),
            _ if least(&coverages) < LEAST_COVERAGE => Err(Reason::Gap),
            _ if least(&qualities) < LEAST_QUALITY => Err(Reason::Quality),
            (true, index) => index.ok_or(Reason::Gap).and_then(Reason::unless_finite),
        });
    }
    let coverage = coverages.iter().copied().fold(0.0, f64::max);
    let count = covered().count().max(1) as f64;
    let quality = covered().map(|index| qualities[index]).sum::<f64>().max(0.0) / count;
    Measured { coverage, quality, values }
}

/// A channel in a span.
struct Of<'a> {
    settings: &'a Settings,
    store: &'a Store,
    span: Span,
    index: usize,
    sums: &'a Cell,
}

impl Of<'_> {
    fn values(&self, is_good: bool, values: &mut Vec<Result<f64, Reason>>) {
        let begin = values.len();
        values.extend(self.of_frames());
        values.push(self.fatigue());
        let envelope = self.sums.envelope / self.sums.faults.usable;
        values.push(Reason::unless_finite(envelope));
        let mvc = self.settings.channels[self.index].mvc.ok_or(Reason::Missing);
        values.push(mvc.and_then(|mvc| Reason::unless_finite(100.0 * envelope / mvc)));
        values.push(Ok(self.store.bursts(self.span, self.index) as f64));
        if !is_good {
            values[begin..].fill(Err(Reason::Quality));
        }
        let faults = &self.sums.faults;
        values.extend([
            Ok(quality(faults)),
            Ok(faults.mains_share()),
            Ok(faults.outside_share()),
            Ok(faults.flat_share()),
            Ok(faults.clipped_share()),
        ]);
    }

    fn frames(&self) -> impl Iterator<Item = (i64, &Cell)> {
        self.store.frames_in(self.span, self.index)
    }

    fn of_frames(&self) -> [Result<f64, Reason>; 9] {
        let mut mean = Mean::default();
        let mut frames = 0;
        for (_, cell) in self.frames() {
            frames += 1;
            if let Some(features) = &cell.features {
                mean.add(features);
            }
        }
        for features in self.contracting().filter_map(|(_, cell)| cell.features.as_ref()) {
            mean.add_frequencies(features);
        }
        match (frames, mean.amplitudes) {
            (0, _) => [Err(Reason::Short); 9],
            (_, 0.0) => [Err(Reason::Gap); 9],
            _ => mean.values(self.contracting().next().is_some()),
        }
    }

    /// The frames in which the muscle contracts; all of them while it has had no burst, when rest and a
    /// contraction without rest look the same.
    fn contracting(&self) -> impl Iterator<Item = (i64, &Cell)> {
        let rests = self.frames().any(|(_, cell)| cell.activity != Activity::Unknown);
        let contracts = move |cell: &Cell| !rests || cell.activity == Activity::Contraction;
        self.frames().filter(move |(_, cell)| contracts(cell))
    }

    fn fatigue(&self) -> Result<f64, Reason> {
        let minutes = |at_ns: i64| at_ns.saturating_sub(self.span.begin_ns) as f64 / 60e9;
        let frames = self.contracting();
        let known =
            frames.filter_map(|(at_ns, cell)| Some((minutes(at_ns), cell.features?.mdf_hz)));
        let (x, y): (Vec<f64>, Vec<f64>) = known.filter(|(_, mdf_hz)| mdf_hz.is_finite()).unzip();
        let length = x.last().zip(x.first()).map_or(0.0, |(last, first)| last - first);
        if length * 60.0 < LEAST_TREND_SECS - 1.0 || x.len() < LEAST_TREND_FRAMES {
            return Err(Reason::Short);
        }
        let line = least_squares(&x, &y).ok_or(Reason::Undefined)?;
        Reason::unless_finite(line.slope.value)
    }
}

/// The sums of features of frames.
#[derive(Default)]
struct Mean {
    sums: [f64; 7],
    amplitudes: f64,
    frequencies: [f64; 2],
    with_frequency: f64,
}

impl Mean {
    fn add(&mut self, of: &Features) {
        let parts = [of.rms * of.rms, of.mav, of.iemg, of.var, of.wl, of.zc, of.ssc];
        self.sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        self.amplitudes += 1.0;
    }

    fn add_frequencies(&mut self, of: &Features) {
        if of.mnf_hz.is_finite() && of.mdf_hz.is_finite() {
            self.frequencies[0] += of.mnf_hz;
            self.frequencies[1] += of.mdf_hz;
            self.with_frequency += 1.0;
        }
    }

    fn values(&self, contracts: bool) -> [Result<f64, Reason>; 9] {
        let mut values = [Err(Reason::Undefined); 9];
        let means = self.sums.iter().map(|sum| sum / self.amplitudes);
        let frequencies = self.frequencies.iter().map(|sum| sum / self.with_frequency);
        for (value, mean) in values.iter_mut().zip(means.chain(frequencies)) {
            *value = Reason::unless_finite(mean);
        }
        values[0] = values[0].map(f64::sqrt);
        if !contracts {
            values[7..].fill(Err(Reason::Nothing));
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_without_a_unit_adds_none_to_its_values() {
        let units = |signal| ["u", "u²", "u·s", "1/s"].map(|unit| unit_of(unit, signal));
        assert_eq!(units("1"), ["1", "1", "s", "1/s"]);
        assert_eq!(units("mV"), ["mV", "mV²", "mV·s", "1/s"]);
    }
}
