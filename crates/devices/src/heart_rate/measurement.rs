use crate::DecodeError;
use crate::cursor::Cursor;

/// One step of an RR interval \[ms\].
pub const RR_INTERVAL_MS: f64 = 1000.0 / 1024.0;

/// A notification of the Heart Rate Measurement characteristic.
///
/// ```
/// use teampulse_devices::heart_rate::{HeartRateMeasurement, RR_INTERVAL_MS};
///
/// let beat = HeartRateMeasurement::decode(&[0x10, 0x49, 0x34, 0x03])?;
/// assert_eq!(beat.heart_rate_bpm, 73);
/// assert_eq!(f64::from(beat.rr_intervals[0]) * RR_INTERVAL_MS, 800.78125);
/// # Ok::<(), teampulse_devices::DecodeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeartRateMeasurement {
    /// Heart rate \[1/min\].
    pub heart_rate_bpm: u16,
    /// Whether the sensor touches the skin; `None` if the strap does not measure it.
    pub contact: Option<bool>,
    /// Energy expended since the last reset \[kJ\]; `None` in most notifications.
    pub energy_kj: Option<u16>,
    /// Times between beats \[1/1024 s\], oldest first.
    pub rr_intervals: Vec<u16>,
}

impl HeartRateMeasurement {
    /// Decodes the value of the characteristic. An odd byte at the end is ignored.
    pub fn decode(value: &[u8]) -> Result<Self, DecodeError> {
        let mut fields = Cursor::new("a heart rate measurement", value);
        let flags = fields.u8()?;
        let has = |bit: u8| flags & 1 << bit != 0;
        let heart_rate_bpm = if has(0) { fields.u16()? } else { u16::from(fields.u8()?) };
        let energy_kj = if has(3) { Some(fields.u16()?) } else { None };
        let intervals = if has(4) { fields.rest() } else { &[] };
        Ok(Self {
            heart_rate_bpm,
            contact: has(2).then(|| has(1)),
            energy_kj,
            rr_intervals: intervals.as_chunks().0.iter().map(|x| u16::from_le_bytes(*x)).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heart_rate_has_eight_or_sixteen_bits() {
        let decode = |value: &[u8]| HeartRateMeasurement::decode(value).map(|m| m.heart_rate_bpm);
        assert_eq!(decode(&[0, 73]), Ok(73));
        assert_eq!(decode(&[1, 0x2c, 0x01]), Ok(300));
        let expected = "a heart rate measurement has 2 bytes, expected at least 3";
        assert_eq!(decode(&[1, 0x2c]).unwrap_err().to_string(), expected);
    }

    #[test]
    fn every_interval_of_a_notification_is_read() {
        let measurement =
            HeartRateMeasurement::decode(&[0x10, 0x49, 0x34, 0x03, 0x32, 0x03]).unwrap();
        assert_eq!(measurement.rr_intervals, [820, 818]);
        let nine: Vec<u8> = [0x10, 60].into_iter().chain((0..18).map(|k| k / 2)).collect();
        assert_eq!(HeartRateMeasurement::decode(&nine).unwrap().rr_intervals.len(), 9);
    }

    #[test]
    fn energy_stands_before_the_intervals() {
        let measurement = HeartRateMeasurement::decode(&[0x18, 60, 5, 1, 0, 4]).unwrap();
        assert_eq!((measurement.energy_kj, measurement.rr_intervals), (Some(261), vec![1024]));
    }

    #[test]
    fn contact_is_unknown_where_it_is_not_measured() {
        let contact = |flags| HeartRateMeasurement::decode(&[flags, 60]).unwrap().contact;
        assert_eq!([0, 2, 4, 6].map(contact), [None, None, Some(false), Some(true)]);
    }
}
