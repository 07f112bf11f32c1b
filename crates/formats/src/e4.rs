//! The zip that Empatica's service provides for a session of an E4.
//!
//! | file | lines |
//! |---|---|
//! | `ACC.csv` | start [s since 1970], rate 32 Hz, then x, y, z [1/64 g] |
//! | `BVP.csv` `EDA.csv` `TEMP.csv` | start, rate (64, 4, 4 Hz), then one value per line [1, µS, °C] |
//! | `HR.csv` | the same at 1 Hz: the mean heart rate of the last 10 s |
//! | `IBI.csv` | start and ` IBI`, then seconds after the start and the interval that ended there [s] |
//! | `tags.csv` | the time of each press of the button [s since 1970] |
//!
//! Source: `info.txt` in each such zip. Each file may be missing or empty, and may be in a folder. The heart rate
//! is a mean whose window is not documented, so it is read as an ordinary number and not used for alignment.

use std::borrow::Cow;
use std::io::{Cursor, Read};

use zip::ZipArchive;

use crate::error::FormatError;
use crate::recording::{Channel, Content, Mark, Quantity, Recording, Run, Signal, bounded, nanos};

/// The first bytes of a zip.
pub const MAGIC: &[u8] = b"PK\x03\x04";
/// The most bytes to which one of the files may unpack: `ACC.csv` grows by 30 MB a day.
const MOST_BYTES: u64 = 256 << 20;
/// The most entries of the archive that are examined.
const MOST_ENTRIES: usize = 1000;
/// The number of units of acceleration in 1 g.
const ACC_PER_G: f64 = 64.0;

/// An evenly sampled file: its name, quantity, channels, unit and scale.
struct Sampled(&'static str, Quantity, &'static [&'static str], &'static str, f64);

const SAMPLED: [Sampled; 5] = [
    Sampled("ACC", Quantity::Acceleration, &["x", "y", "z"], "g", 1.0 / ACC_PER_G),
    Sampled("BVP", Quantity::Ppg, &["bvp"], "1", 1.0),
    Sampled("EDA", Quantity::Eda, &["eda"], "uS", 1.0),
    Sampled("TEMP", Quantity::Temperature, &["temperature"], "degC", 1.0),
    Sampled("HR", Quantity::Other, &["heart_rate"], "1/min", 1.0),
];

/// Reads the zip of a session.
pub fn read(bytes: &[u8]) -> Result<Recording, FormatError> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| FormatError::Archive(error.to_string()))?;
    let mut recording =
        Recording { device: "empatica_e4".into(), is_dated: true, ..Recording::default() };
    for file in SAMPLED {
        if let Some(text) = unpacked(&mut archive, file.0)? {
            let signal = sampled(&file, &text)?;
            recording.notes.extend(signal.is_none().then(|| without_samples(file.0)));
            recording.signals.extend(signal);
        }
    }
    if let Some(text) = unpacked(&mut archive, "IBI")? {
        let signal = intervals(&text)?;
        recording.notes.extend(signal.is_none().then(|| without_samples("IBI")));
        recording.signals.extend(signal);
    }
    if let Some(text) = unpacked(&mut archive, "tags")? {
        recording.signals.extend(tags(&text)?);
    }
    if recording.signals.is_empty() {
        return Err(FormatError::Empty("file of an E4 with samples (ACC.csv, BVP.csv, …)"));
    }
    Ok(recording)
}

fn without_samples(name: &str) -> String {
    format!("{name}.csv has no samples")
}

/// Unpacks the text of the file with this name, in any folder of the archive; `None` if there is none.
fn unpacked(
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    stem: &str,
) -> Result<Option<String>, FormatError> {
    let is_meant = |name: &str| {
        let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
        file.strip_suffix(".csv").is_some_and(|found| found.eq_ignore_ascii_case(stem))
            && !name.starts_with("__MACOSX")
    };
    let mut names = archive.file_names().take(MOST_ENTRIES).filter_map(Result::ok);
    let name = names.find(|name| is_meant(name)).map(Cow::into_owned);
    drop(names);
    let Some(name) = name else { return Ok(None) };
    let broken = |error: String| FormatError::Archive(format!("{name}: {error}"));
    let file = archive.by_name(&name).map_err(|error| broken(error.to_string()))?;
    if file.encrypted() {
        return Err(FormatError::Unsupported("an encrypted zip".into()));
    }
    // The size that the archive states may be false, so reading is bounded.
    let mut text = Vec::new();
    let mut limited = file.take(MOST_BYTES + 1);
    limited.read_to_end(&mut text).map_err(|error| broken(error.to_string()))?;
    if text.len() as u64 > MOST_BYTES {
        return Err(FormatError::TooLarge);
    }
    let text = String::from_utf8(text);
    Ok(Some(text.map_err(|error| broken(error.to_string()))?))
}

/// Reads an evenly sampled file; `None` if it has no samples.
fn sampled(file: &Sampled, text: &str) -> Result<Option<Signal>, FormatError> {
    let Sampled(name, quantity, channels, unit, scale) = *file;
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let (Some(start), Some(rate)) = (lines.next(), lines.next()) else { return Ok(None) };
    let start_ns = first(start).and_then(nanos);
    let start_ns = start_ns.ok_or_else(|| {
        FormatError::malformed_text(format!("the start in {name}.csv"), start, "seconds since 1970")
    })?;
    let rate_hz = first(rate).filter(|hz| (0.01..=10_000.0).contains(hz));
    let rate_hz = rate_hz.ok_or_else(|| {
        FormatError::malformed_text(format!("the rate in {name}.csv"), rate, "a rate in Hz")
    })?;
    let mut samples = Vec::new();
    for line in lines {
        let before = samples.len();
        samples.extend(line.split(',').map_while(number).map(|value| value * scale));
        if samples.len() - before != channels.len() {
            return Err(FormatError::malformed_text(
                format!("a line of {name}.csv"),
                line,
                "the numbers of one sample",
            ));
        }
        bounded(samples.len())?;
    }
    let channels = channels.iter().map(|channel| Channel::new(*channel, unit)).collect();
    let run = Run { start_ns, period_ns: 1e9 / rate_hz, samples };
    let signal = Signal::even(&name.to_ascii_lowercase(), quantity, channels, rate_hz, vec![run]);
    Ok((!signal.is_empty()).then_some(signal))
}

/// Reads the intervals between beats; `None` if there are none.
fn intervals(text: &str) -> Result<Option<Signal>, FormatError> {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let Some(head) = lines.next() else { return Ok(None) };
    let start_ns = first(head).and_then(nanos).ok_or_else(|| {
        FormatError::malformed_text("the start in IBI.csv", head, "seconds since 1970")
    })?;
    let (mut at_ns, mut values) = (Vec::new(), Vec::new());
    for line in lines {
        let pair = line.split_once(',');
        let pair = pair.and_then(|(at, interval)| Some((number(at)?, number(interval)?)));
        let timed = pair
            .and_then(|(at, interval)| Some((start_ns.checked_add(nanos(at)?)?, interval * 1e3)));
        let (at, interval_ms) = timed.ok_or_else(|| {
            FormatError::malformed_text(
                "a line of IBI.csv",
                line,
                "a time and an interval in seconds",
            )
        })?;
        at_ns.push(at);
        values.push(interval_ms);
    }
    let content = Content::Uneven { at_ns, values };
    let channels = vec![Channel::new("interval", "ms")];
    let quantity = Quantity::Interval;
    let signal = Signal { name: "ibi".into(), quantity, channels, rate_hz: 0.0, content };
    Ok((!signal.is_empty()).then_some(signal))
}

/// Reads the presses of the button; `None` if there are none.
fn tags(text: &str) -> Result<Option<Signal>, FormatError> {
    let mark = |line: &str| {
        let at_ns = number(line).and_then(nanos);
        let at_ns = at_ns.ok_or_else(|| {
            FormatError::malformed_text("a line of tags.csv", line, "seconds since 1970")
        })?;
        Ok(Mark::new(at_ns, "tag"))
    };
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let marks = lines.map(mark).collect::<Result<Vec<Mark>, FormatError>>()?;
    Ok((!marks.is_empty()).then(|| Signal::marks("tags", marks)))
}

/// The first number of a line.
fn first(line: &str) -> Option<f64> {
    line.split(',').next().and_then(number)
}

/// A finite number.
fn number(cell: &str) -> Option<f64> {
    cell.trim().parse().ok().filter(|value: &f64| value.is_finite())
}
