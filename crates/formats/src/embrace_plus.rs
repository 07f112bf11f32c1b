//! A raw data file of Empatica's `EmbracePlus`: `1-1-ABC_1700000000.avro`, half an hour or less of one person.
//!
//! | field below `rawData` | contents |
//! |---|---|
//! | `eda` `temperature` `bvp` | `timestampStart` [µs since 1970], `samplingFrequency` [Hz], `values` [µS, °C, nW] |
//! | `accelerometer` | the same with `x`, `y`, `z`, and `imuParams` with the physical and the digital range |
//! | `systolicPeaks` | `peaksTimeNanos` [ns since 1970]: the systolic peaks of the pulse wave |
//! | `tags` | `tagsTimeMicros` [µs since 1970]: the presses of the button |
//!
//! Source: Empatica, `EmbracePlus` raw data, schema versions 6.4 and 6.5. The schema is in each file, and missing
//! fields are skipped. A signal that was not measured has a rate of 0.

use crate::avro::{self, Value};
use crate::error::FormatError;
use crate::recording::{Channel, Content, Mark, Quantity, Recording, Run, Signal};

/// The first bytes of an Avro container file.
pub const MAGIC: &[u8] = avro::MAGIC;

/// A sampled field: its name, quantity, channel and unit.
const SAMPLED: [(&str, Quantity, &str, &str); 3] = [
    ("bvp", Quantity::Ppg, "bvp", "nW"),
    ("eda", Quantity::Eda, "eda", "uS"),
    ("temperature", Quantity::Temperature, "temperature", "degC"),
];
/// The longest interval between two heartbeats [ns]: a longer one means that a beat was missed.
const LONGEST_INTERVAL_NS: i64 = 2_500_000_000;

/// Reads a raw data file.
pub fn read(bytes: &[u8]) -> Result<Recording, FormatError> {
    let mut recording =
        Recording { device: "embrace_plus".into(), is_dated: true, ..Recording::default() };
    for value in avro::read(bytes)? {
        let Some(raw) = value.at(&["rawData"]) else { continue };
        recording.notes.extend(left_out(raw));
        for (field, quantity, channel, unit) in SAMPLED {
            let signal = raw.at(&[field]).map(|part| sampled(part, field, quantity, channel, unit));
            recording.signals.extend(signal.transpose()?.flatten());
        }
        let acceleration = raw.at(&["accelerometer"]).map(acceleration);
        recording.signals.extend(acceleration.transpose()?.flatten());
        recording.signals.extend(intervals(raw));
        recording.signals.extend(tags(raw));
    }
    if recording.signals.is_empty() {
        return Err(FormatError::Empty("signals of an EmbracePlus (`rawData` with values)"));
    }
    Ok(recording)
}

/// Notes on signals whose samples have no valid rate, and so no times.
fn left_out(raw: &Value) -> impl Iterator<Item = String> {
    let fields = SAMPLED.iter().map(|(field, ..)| *field).chain(["accelerometer"]);
    fields.filter_map(|field| {
        let part = raw.at(&[field])?;
        let rate_hz = rate_hz(part);
        let samples = ["values", "x"].iter().find_map(|name| part.at(&[name])?.numbers());
        let count = samples.map_or(0, |samples| samples.len());
        (count > 0 && !is_rate(rate_hz)).then(|| {
            format!("{field} has a rate of {rate_hz} Hz: its {count} samples have no times and were left out")
        })
    })
}

fn rate_hz(part: &Value) -> f64 {
    part.at(&["samplingFrequency"]).and_then(Value::number).unwrap_or(0.0)
}

fn is_rate(rate_hz: f64) -> bool {
    rate_hz > 0.0 && rate_hz <= 1e5
}

/// The start [ns] and the rate [Hz] of a part; `None` if it was not measured.
fn timing(part: &Value, field: &str) -> Result<Option<(i64, f64)>, FormatError> {
    let rate_hz = rate_hz(part);
    if !is_rate(rate_hz) {
        return Ok(None);
    }
    let start = part.at(&["timestampStart"]).and_then(Value::integer);
    let start_ns = start.and_then(|micros| micros.checked_mul(1000));
    let start_ns = start_ns.ok_or_else(|| {
        FormatError::malformed(format!("the start of {field}"), "", "microseconds since 1970")
    })?;
    Ok(Some((start_ns, rate_hz)))
}

fn sampled(
    part: &Value,
    field: &str,
    quantity: Quantity,
    channel: &str,
    unit: &str,
) -> Result<Option<Signal>, FormatError> {
    let Some((start_ns, rate_hz)) = timing(part, field)? else { return Ok(None) };
    let samples = part.at(&["values"]).and_then(Value::numbers).unwrap_or_default();
    let run = Run { start_ns, period_ns: 1e9 / rate_hz, samples };
    let channels = vec![Channel::new(channel, unit)];
    let signal = Signal::even(field, quantity, channels, rate_hz, vec![run]);
    Ok((!signal.is_empty()).then_some(signal))
}

fn acceleration(part: &Value) -> Result<Option<Signal>, FormatError> {
    let Some((start_ns, rate_hz)) = timing(part, "accelerometer")? else { return Ok(None) };
    let axis = |name| part.at(&[name]).and_then(Value::numbers).unwrap_or_default();
    let (x, y, z) = (axis("x"), axis("y"), axis("z"));
    let of = |end| part.at(&["imuParams", end]).and_then(Value::number);
    let physical = of("physicalMax").zip(of("physicalMin")).map(|(most, least)| most - least);
    let digital = of("digitalMax").zip(of("digitalMin")).map(|(most, least)| most - least);
    let (scale, unit) = match physical.zip(digital) {
        Some((physical, digital)) if digital > 0.0 && physical > 0.0 => (physical / digital, "g"),
        _ => (1.0, ""),
    };
    let rows = x.iter().zip(&y).zip(&z);
    let samples = rows.flat_map(|((x, y), z)| [x * scale, y * scale, z * scale]).collect();
    let run = Run { start_ns, period_ns: 1e9 / rate_hz, samples };
    let channels = ["x", "y", "z"].map(|name| Channel::new(name, unit)).to_vec();
    let signal =
        Signal::even("accelerometer", Quantity::Acceleration, channels, rate_hz, vec![run]);
    Ok((!signal.is_empty()).then_some(signal))
}

/// The intervals between successive systolic peaks, except across a missed peak.
fn intervals(raw: &Value) -> Option<Signal> {
    let peaks = raw.at(&["systolicPeaks", "peaksTimeNanos"])?.integers()?;
    let pairs = peaks.windows(2).map(|pair| (pair[1], pair[1].saturating_sub(pair[0])));
    let pairs = pairs.filter(|(_, interval_ns)| (1..=LONGEST_INTERVAL_NS).contains(interval_ns));
    let (at_ns, values) =
        pairs.map(|(at_ns, interval_ns)| (at_ns, interval_ns as f64 / 1e6)).unzip();
    let content = Content::Uneven { at_ns, values };
    let channels = vec![Channel::new("interval", "ms")];
    let quantity = Quantity::Interval;
    let name = "systolic_peaks".to_owned();
    let signal = Signal { name, quantity, channels, rate_hz: 0.0, content };
    (!signal.is_empty()).then_some(signal)
}

fn tags(raw: &Value) -> Option<Signal> {
    let micros = raw.at(&["tags", "tagsTimeMicros"])?.integers()?;
    let mark = |micros: &i64| Some(Mark::new(micros.checked_mul(1000)?, "tag"));
    let marks: Vec<Mark> = micros.iter().filter_map(mark).collect();
    (!marks.is_empty()).then(|| Signal::marks("tags", marks))
}
