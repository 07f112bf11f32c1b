//! The samples that follow a handshake.

use super::{FeedReply, Format, LslError, StreamInfo, Values};

/// The first byte of a sample: whether its stamp is one period after the previous one, or follows.
const DEDUCED: u8 = 1;
const STAMPED: u8 = 2;
/// The stamp of test patterns [s].
const PATTERN_SECS: f64 = 123_456.789;
const PATTERNS: [i64; 2] = [4, 2];
/// The largest total size of the texts in a sample [bytes].
const LONGEST_TEXTS: u64 = 4 << 20;

/// A sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// When the sample was taken, by the sender's clock [s].
    pub stamp_secs: f64,
    /// The values of the sample.
    pub values: Values,
}

/// Reads the samples of a stream from bytes that arrive in pieces. The test patterns at the start are checked.
#[derive(Clone, Debug)]
pub struct SampleReader {
    format: Format,
    channels: usize,
    period_secs: f64,
    reply: FeedReply,
    waiting: Vec<u8>,
    /// The number of bytes that must be present before parsing is worth another attempt.
    needed: usize,
    last_secs: f64,
    patterns: usize,
}

impl SampleReader {
    /// Creates a reader of the samples that follow this reply.
    pub fn new(stream: &StreamInfo, reply: FeedReply) -> SampleReader {
        SampleReader {
            format: stream.format,
            channels: stream.channel_count,
            period_secs: if stream.rate_hz > 0.0 { 1.0 / stream.rate_hz } else { 0.0 },
            reply,
            waiting: Vec::new(),
            needed: 0,
            last_secs: 0.0,
            patterns: 0,
        }
    }

    /// Adds bytes; returns the samples that they complete.
    pub fn push(&mut self, bytes: &[u8]) -> Result<Vec<Sample>, LslError> {
        self.waiting.extend(bytes);
        let mut samples = Vec::new();
        if self.waiting.len() < self.needed {
            return Ok(samples);
        }
        let waiting = std::mem::take(&mut self.waiting);
        let mut rest = waiting.as_slice();
        loop {
            let mut cursor = Bytes { rest, is_big_endian: self.reply.is_big_endian };
            match self.sample(&mut cursor) {
                Ok(sample) => {
                    rest = cursor.rest;
                    samples.extend(self.checked(sample)?);
                }
                Err(Stop::Needs(more)) => {
                    self.needed = rest.len() + more;
                    self.waiting = rest.to_vec();
                    return Ok(samples);
                }
                Err(Stop::Wrong(error)) => return Err(error),
            }
        }
    }

    /// Returns the sample, or `None` for a correct test pattern.
    fn checked(&mut self, sample: Sample) -> Result<Option<Sample>, LslError> {
        let Some(pattern) = PATTERNS.get(self.patterns) else {
            self.last_secs = sample.stamp_secs;
            return Ok(Some(sample));
        };
        let values = self.format.pattern(*pattern, self.channels);
        if sample != (Sample { stamp_secs: PATTERN_SECS, values }) {
            return Err(LslError::Pattern);
        }
        self.patterns += 1;
        Ok(None)
    }

    fn sample(&self, bytes: &mut Bytes<'_>) -> Result<Sample, Stop> {
        let stamp_secs = match bytes.byte()? {
            DEDUCED => self.last_secs + self.period_secs,
            STAMPED => f64::from_le_bytes(bytes.array()?),
            other => return Err(Stop::Wrong(LslError::Byte(other, "1 or 2, for a stamp"))),
        };
        let values = match self.format {
            Format::String => Values::Texts(self.texts(bytes)?),
            _ => Values::Numbers(self.numbers(bytes)?),
        };
        Ok(Sample { stamp_secs, values })
    }

    fn numbers(&self, bytes: &mut Bytes<'_>) -> Result<Vec<f64>, Stop> {
        let size = self.format.size();
        let all = bytes.take(size * self.channels)?;
        let number = |bytes: &[u8]| {
            let mut swapped = [0; 8];
            let swapped = swapped.get_mut(..size).unwrap_or_default();
            swapped.copy_from_slice(bytes);
            if self.reply.is_big_endian {
                swapped.reverse();
            }
            self.flushed(self.format.number(swapped).unwrap_or(f64::NAN))
        };
        Ok(all.chunks_exact(size).map(number).collect())
    }

    /// Replaces a subnormal number with zero if the sender requested that.
    fn flushed(&self, number: f64) -> f64 {
        let least = if self.format == Format::Float32 {
            f32::MIN_POSITIVE.into()
        } else {
            f64::MIN_POSITIVE
        };
        let is_subnormal = number != 0.0 && number.abs() < least;
        if self.reply.suppress_subnormals && self.format.is_float() && is_subnormal {
            0.0_f64.copysign(number)
        } else {
            number
        }
    }

    fn texts(&self, bytes: &mut Bytes<'_>) -> Result<Vec<String>, Stop> {
        let mut texts = Vec::new();
        let mut total: u64 = 0;
        for _ in 0..self.channels {
            let length = match bytes.byte()? {
                1 => bytes.byte()?.into(),
                2 => u16::from_le_bytes(bytes.array()?).into(),
                4 => u32::from_le_bytes(bytes.array()?).into(),
                8 => u64::from_le_bytes(bytes.array()?),
                other => return Err(Stop::Wrong(LslError::Byte(other, "the size of a length"))),
            };
            total = total.saturating_add(length);
            if total > LONGEST_TEXTS {
                return Err(Stop::Wrong(LslError::Long(total)));
            }
            texts.push(String::from_utf8_lossy(bytes.take(length as usize)?).into_owned());
        }
        Ok(texts)
    }
}

/// Why no sample could be read.
enum Stop {
    /// At least this many more bytes are needed.
    Needs(usize),
    Wrong(LslError),
}

/// Bytes that have not been read yet.
struct Bytes<'a> {
    rest: &'a [u8],
    is_big_endian: bool,
}

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Stop> {
        let Some((taken, rest)) = self.rest.split_at_checked(count) else {
            return Err(Stop::Needs(count - self.rest.len()));
        };
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Stop> {
        self.array().map(|[byte]| byte)
    }

    /// Returns the bytes of a number in little-endian order.
    fn array<const N: usize>(&mut self) -> Result<[u8; N], Stop> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        if self.is_big_endian {
            array.reverse();
        }
        Ok(array)
    }
}

/// Writes the samples of a stream, little-endian.
#[derive(Clone, Copy, Debug)]
pub struct SampleWriter {
    format: Format,
    channels: usize,
}

impl SampleWriter {
    /// Creates a writer for the samples of a stream.
    pub fn new(stream: &StreamInfo) -> SampleWriter {
        SampleWriter { format: stream.format, channels: stream.channel_count }
    }

    /// Creates a writer for samples with this format and number of channels.
    pub fn of(format: Format, channels: usize) -> SampleWriter {
        SampleWriter { format, channels }
    }

    /// Returns the test patterns at the start of a feed.
    pub fn patterns(self) -> Vec<u8> {
        let mut out = Vec::new();
        for pattern in PATTERNS {
            let values = self.format.pattern(pattern, self.channels);
            self.write(&Sample { stamp_secs: PATTERN_SECS, values }, &mut out);
        }
        out
    }

    /// Appends a sample; if its shape differs from the stream's, missing values are `NaN` or empty texts.
    pub fn write(self, sample: &Sample, out: &mut Vec<u8>) {
        out.push(STAMPED);
        out.extend(sample.stamp_secs.to_le_bytes());
        for channel in 0..self.channels {
            match (&sample.values, self.format) {
                (Values::Texts(texts), Format::String) => {
                    write_text(texts.get(channel).map_or("", String::as_str), out);
                }
                (Values::Numbers(_), Format::String) => write_text("", out),
                (Values::Numbers(numbers), format) => {
                    format.write(numbers.get(channel).copied().unwrap_or(f64::NAN), out);
                }
                (Values::Texts(_), format) => format.write(f64::NAN, out),
            }
        }
    }
}

fn write_text(text: &str, out: &mut Vec<u8>) {
    match (u8::try_from(text.len()), u32::try_from(text.len())) {
        (Ok(length), _) => out.extend([1, length]),
        (_, Ok(length)) => {
            out.push(4);
            out.extend(length.to_le_bytes());
        }
        _ => {
            out.push(8);
            out.extend((text.len() as u64).to_le_bytes());
        }
    }
    out.extend(text.as_bytes());
}
