//! The header of an EDF or BDF file.

use super::{BDF_MAGIC, cursor};
use crate::cursor::Cursor;
use crate::date::StatedDate;
use crate::error::FormatError;
use crate::recording::Quantity;

/// The most signals in a file.
const MOST_SIGNALS: usize = 4096;

/// The header of a file.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) bytes: usize,
    /// When the recording began.
    pub(super) date: Option<StatedDate>,
    /// The number of records; `None` if the file was not closed.
    pub(super) records: Option<usize>,
    pub(super) record_secs: f64,
    pub(super) sample_bytes: usize,
    /// Whether each record states its own start (EDF+ or BDF+).
    pub(super) is_plus: bool,
    pub(super) signals: Vec<EdfSignal>,
}

/// A signal as described in the header.
#[derive(Clone, Debug, Default)]
pub(super) struct EdfSignal {
    pub(super) label: String,
    pub(super) unit: String,
    physical: (f64, f64),
    digital: (f64, f64),
    /// The number of samples per record.
    pub(super) samples: usize,
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Header, FormatError> {
        let mut file = cursor(bytes);
        let is_bdf = file.take(8)? == BDF_MAGIC;
        file.take(80 + 80)?;
        let date = StatedDate::of_edf(&text(&mut file, 8)?, &text(&mut file, 8)?);
        let header_bytes = whole(&mut file, 8, "the length of its header")?;
        let kind = text(&mut file, 44)?;
        let records = number(&mut file, 8, "its number of records")?;
        let record_secs = number(&mut file, 8, "the duration of its records")?;
        let count = whole(&mut file, 4, "its number of signals")?;
        if count > MOST_SIGNALS || header_bytes != 256 * (count + 1) {
            let found = format!("{header_bytes} bytes for {count} signals");
            return Err(FormatError::malformed(
                "its header",
                &found,
                "256 bytes, and 256 for each signal",
            ));
        }
        if !(0.0..=1e6).contains(&record_secs) {
            let found = record_secs.to_string();
            return Err(FormatError::malformed("the duration of its records", &found, "seconds"));
        }
        let signals = signals(&mut file, count)?;
        let header = Header {
            bytes: header_bytes,
            date,
            records: (records >= 0.0).then_some(records as usize),
            record_secs,
            sample_bytes: if is_bdf { 3 } else { 2 },
            is_plus: kind.starts_with("EDF+") || kind.starts_with("BDF+"),
            signals,
        };
        if header.record_bytes() == 0 {
            return Err(FormatError::Empty("signal with samples"));
        }
        Ok(header)
    }

    /// Notes on signals whose samples all become the same number.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        let signals = self.signals.iter().filter(|signal| !signal.is_annotations());
        let flat = signals.filter(|signal| signal.physical.0.total_cmp(&signal.physical.1).is_eq());
        flat.map(|EdfSignal { label, physical: (only, _), .. }| {
            format!(
                "the physical minimum and maximum of {label} are equal: all its samples are {only}"
            )
        })
    }

    pub(super) fn samples_a_record(&self) -> usize {
        self.signals.iter().map(|signal| signal.samples).sum()
    }

    pub(super) fn record_bytes(&self) -> usize {
        self.samples_a_record() * self.sample_bytes
    }

    /// The offset of each signal in a record [bytes].
    pub(super) fn starts(&self) -> impl Iterator<Item = usize> {
        self.signals.iter().scan(0, |at, signal| {
            let start = *at;
            *at += signal.samples * self.sample_bytes;
            Some(start)
        })
    }
}

/// Reads the signals, whose fields are stored one after the other: first all labels, then all transducers, …
fn signals(file: &mut Cursor<'_>, count: usize) -> Result<Vec<EdfSignal>, FormatError> {
    let mut signals = vec![EdfSignal::default(); count];
    for signal in &mut signals {
        signal.label = text(file, 16)?;
    }
    file.take(80 * count)?;
    for signal in &mut signals {
        signal.unit = text(file, 8)?;
    }
    for signal in &mut signals {
        signal.physical.0 = number(file, 8, "a physical minimum")?;
    }
    for signal in &mut signals {
        signal.physical.1 = number(file, 8, "a physical maximum")?;
    }
    for signal in &mut signals {
        signal.digital.0 = number(file, 8, "a digital minimum")?;
    }
    for signal in &mut signals {
        signal.digital.1 = number(file, 8, "a digital maximum")?;
    }
    file.take(80 * count)?;
    for signal in &mut signals {
        signal.samples = whole(file, 8, "a number of samples")?;
    }
    file.take(32 * count)?;
    match signals
        .iter()
        .find(|signal| signal.digital.0 >= signal.digital.1 && !signal.is_annotations())
    {
        Some(wrong) => Err(FormatError::malformed(
            "the digital range",
            &wrong.label,
            "a minimum below the maximum",
        )),
        None => Ok(signals),
    }
}

impl EdfSignal {
    pub(super) fn is_annotations(&self) -> bool {
        matches!(&*self.label, "EDF Annotations" | "BDF Annotations")
    }

    /// Converts a digital value to the signal's unit.
    pub(super) fn physical(&self, digital: i32) -> f64 {
        let ((least, most), (from, to)) = (self.physical, self.digital);
        least + (f64::from(digital) - from) * (most - least) / (to - from)
    }

    /// The measured quantity, from the first word of the label: the words listed in EDF+ and others in common use.
    pub(super) fn quantity(&self) -> Quantity {
        let label = self.label.to_ascii_lowercase();
        let mut words = label.split(|each: char| !each.is_ascii_alphanumeric());
        match words.next().unwrap_or_default() {
            "ecg" | "ekg" => Quantity::Ecg,
            "eeg" => Quantity::Eeg,
            "emg" => Quantity::Emg,
            "resp" | "respiration" | "breathing" => Quantity::Respiration,
            "ppg" | "bvp" | "pleth" | "plethysmogram" => Quantity::Ppg,
            "eda" | "gsr" | "scl" | "sc" => Quantity::Eda,
            "temp" | "temperature" => Quantity::Temperature,
            "acc" | "accelerometer" | "acceleration" => Quantity::Acceleration,
            _ => Quantity::Other,
        }
    }
}

fn text(file: &mut Cursor<'_>, bytes: usize) -> Result<String, FormatError> {
    Ok(String::from_utf8_lossy(file.take(bytes)?).trim().to_owned())
}

fn number(file: &mut Cursor<'_>, bytes: usize, what: &'static str) -> Result<f64, FormatError> {
    let text = text(file, bytes)?;
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| FormatError::malformed(what, &text, "a number"))
}

fn whole(file: &mut Cursor<'_>, bytes: usize, what: &'static str) -> Result<usize, FormatError> {
    let text = text(file, bytes)?;
    text.parse().map_err(|_not_whole| FormatError::malformed(what, &text, "a whole number"))
}
