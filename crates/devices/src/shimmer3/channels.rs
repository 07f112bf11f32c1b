use crate::cursor::{signed, unsigned};

/// A channel of a packet, by its ID in the inquiry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PacketChannel {
    pub stream: &'static str,
    pub name: &'static str,
    pub bytes: usize,
    format: Format,
    pub unit: &'static str,
    pub scale: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Unsigned,
    Signed,
    BigEndianUnsigned,
    BigEndianSigned,
}

/// The size of one step of the 12-bit ADC [mV].
const ADC_MV: f64 = 3000.0 / 4095.0;

/// The size of one step of the battery voltage behind its divider [V].
pub(super) const BATTERY_V: f64 = 3.0 / 4095.0 * 1.988;

impl PacketChannel {
    /// Returns the channel with this ID; `None` if it is not documented, so that the packet length is unknown, too.
    pub fn of(id: u8) -> Option<Self> {
        use Format::{BigEndianSigned, BigEndianUnsigned, Signed, Unsigned};
        let of = |stream, name, bytes, format| Self {
            stream,
            name,
            bytes,
            format,
            unit: "",
            scale: 1.0,
        };
        let axis = |of: u8| {
            if of == 0 {
                "x"
            } else if of == 1 {
                "y"
            } else {
                "z"
            }
        };
        let adc = |stream| Self { unit: "mV", scale: ADC_MV, ..of(stream, "voltage", 2, Unsigned) };
        Some(match id {
            0x00..=0x02 => of("acceleration_low_noise", axis(id), 2, Unsigned),
            0x03 => Self { unit: "V", scale: BATTERY_V, ..of("battery", "voltage", 2, Unsigned) },
            0x04..=0x06 => of("acceleration_wide_range", axis(id - 4), 2, Signed),
            0x07..=0x09 => of("magnetometer", axis(id - 7), 2, Signed),
            0x0a..=0x0c => of("gyroscope", axis(id - 10), 2, BigEndianSigned),
            0x0d => adc("adc_external_7"),
            0x0e => adc("adc_external_6"),
            0x0f => adc("adc_external_15"),
            0x10 => adc("adc_internal_1"),
            0x11 => adc("adc_internal_12"),
            0x12 => adc("ppg"),
            0x13 => adc("adc_internal_14"),
            0x1a => of("temperature_raw", "temperature", 2, BigEndianUnsigned),
            0x1b => of("pressure_raw", "pressure", 3, BigEndianUnsigned),
            0x1c => of("eda", "raw", 2, Unsigned),
            0x1d | 0x20 => of("exg_status", "status", 1, Unsigned),
            0x1e | 0x1f => of("exg_1", axis(id - 0x1e), 3, BigEndianSigned),
            0x21 | 0x22 => of("exg_2", axis(id - 0x21), 3, BigEndianSigned),
            0x23 | 0x24 => of("exg_1", axis(id - 0x23), 2, BigEndianSigned),
            0x25 | 0x26 => of("exg_2", axis(id - 0x25), 2, BigEndianSigned),
            0x27 => adc("strain_high"),
            0x28 => adc("strain_low"),
            _ => return None,
        })
    }

    /// Decodes the channel's value from its bytes in the packet.
    pub fn decode(&self, bytes: &[u8]) -> f64 {
        let mut reversed: Vec<u8> = bytes.to_vec();
        reversed.reverse();
        match self.format {
            Format::Unsigned => unsigned(bytes).into(),
            Format::Signed => signed(bytes).into(),
            Format::BigEndianUnsigned => unsigned(&reversed).into(),
            Format::BigEndianSigned => signed(&reversed).into(),
        }
    }
}
