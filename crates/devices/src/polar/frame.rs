use super::delta::decompress;
use super::layout::{Layout, Measurement};
use crate::cursor::{Cursor, signed};
use crate::{Channel, DecodeError};

/// Seconds from the Unix epoch to the epoch of Polar devices, 2000-01-01 UTC.
pub const EPOCH_UNIX_SECS: i64 = 946_684_800;

/// A notification of the data characteristic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What was measured.
    pub measurement: Measurement,
    /// The device's clock at the **last** sample, in nanoseconds since [`EPOCH_UNIX_SECS`].
    pub timestamp_ns: u64,
    /// Whether the payload holds differences.
    pub compressed: bool,
    /// Frame type, which together with `compressed` determines the sample format.
    pub kind: u8,
    /// The samples.
    pub payload: &'a [u8],
}

/// The samples of a frame, before any factor is applied.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// The channels of a sample, with the scale for a factor of 1.
    pub channels: Vec<Channel>,
    /// The values, sample by sample, each with all channels.
    pub values: Vec<f64>,
}

impl<'a> Frame<'a> {
    /// Decodes the header of a notification; the samples are not decoded.
    pub fn decode(value: &'a [u8]) -> Result<Self, DecodeError> {
        let mut fields = Cursor::new("a PMD frame", value);
        let code = fields.u8()?;
        let unknown = DecodeError::Unknown { what: "the measurement", got: code.into() };
        let measurement = Measurement::from_code(code).ok_or(unknown)?;
        let timestamp_ns = fields.u64()?;
        let kind = fields.u8()?;
        let (compressed, kind) = (kind & 0x80 != 0, kind & 0x7f);
        Ok(Self { measurement, timestamp_ns, compressed, kind, payload: fields.rest() })
    }

    /// Decodes the samples; for pulse intervals, use [`PpInterval::decode_all`].
    ///
    /// ```
    /// use teampulse_devices::polar::Frame;
    ///
    /// // Two samples of an ECG, stamped 2 s after the epoch.
    /// let value = [0, 0x00, 0x94, 0x35, 0x77, 0, 0, 0, 0, 0, 0x02, 0x80, 0xff, 0x02, 0x80, 0x00];
    /// let frame = Frame::decode(&value)?;
    /// assert_eq!(frame.timestamp_ns, 2_000_000_000);
    /// assert_eq!(frame.samples()?.values, [-32766.0, 32770.0]);
    /// # Ok::<(), teampulse_devices::DecodeError>(())
    /// ```
    pub fn samples(&self) -> Result<Samples, DecodeError> {
        let layout = self.layout()?;
        let numbers = if self.compressed {
            decompress(self.payload, &layout)?
        } else {
            let whole = self.payload.len() / layout.sample_bytes() * layout.sample_bytes();
            let number = layout.sample_bytes() / layout.channels.len();
            self.payload.chunks(number).take(whole / number).map(signed).collect()
        };
        let value = |number: i32| {
            if layout.floating { f32::from_bits(number as u32).into() } else { f64::from(number) }
        };
        let channels = layout.channels_with_factor(1.0);
        Ok(Samples { channels, values: numbers.into_iter().map(value).collect() })
    }

    pub(super) fn layout(&self) -> Result<Layout, DecodeError> {
        let got = u32::from(self.kind) | if self.compressed { 0x80 } else { 0 };
        let unknown = DecodeError::Unknown { what: "the frame type", got };
        Layout::of(self.measurement, self.compressed, self.kind).ok_or(unknown)
    }
}

/// A pulse-to-pulse interval of an optical sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PpInterval {
    /// Heart rate \[1/min\]; 0 while it is unknown.
    pub heart_rate_bpm: u8,
    /// The interval \[ms\].
    pub interval_ms: u16,
    /// The sensor's estimate of its error \[ms\].
    pub error_ms: u16,
    /// Whether the arm moved: don't use the interval then.
    pub moving: bool,
    /// Whether the sensor touches the skin; `None` if it can't determine that. Unreliable on Verity Sense and OH1.
    pub contact: Option<bool>,
}

impl PpInterval {
    /// Decodes the payload of a frame of [`Measurement::PpInterval`]; an incomplete interval at the end is ignored.
    pub fn decode_all(payload: &[u8]) -> Vec<Self> {
        payload.as_chunks().0.iter().copied().map(Self::decode).collect()
    }

    fn decode(bytes: [u8; 6]) -> Self {
        let [heart_rate, interval @ .., error_low, error_high, flags] = bytes;
        Self {
            heart_rate_bpm: heart_rate,
            interval_ms: u16::from_le_bytes(interval),
            error_ms: u16::from_le_bytes([error_low, error_high]),
            moving: flags & 1 != 0,
            contact: (flags & 4 != 0).then_some(flags & 2 != 0),
        }
    }
}
