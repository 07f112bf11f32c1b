use crate::DecodeError;
use crate::cursor::{Cursor, unsigned};

/// The kind of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum SettingKind {
    /// The sampling rate \[Hz\].
    Rate = 0,
    /// The number of bits of a value.
    Resolution = 1,
    /// The range in the measurement's unit: ±8 g.
    Range = 2,
    /// The range in thousandths of the measurement's unit.
    RangeMilli = 3,
    /// The number of channels of a sample.
    Channels = 4,
    /// The factor for values, as the bits of an IEEE 754 number; only in answers.
    Factor = 5,
    /// A key for recordings in the device.
    Security = 6,
}

impl SettingKind {
    fn from_code(code: u8) -> Option<Self> {
        use SettingKind::{Channels, Factor, Range, RangeMilli, Rate, Resolution, Security};
        [Rate, Resolution, Range, RangeMilli, Channels, Factor, Security]
            .get(usize::from(code))
            .copied()
    }

    const fn bytes(self) -> usize {
        match self {
            Self::Rate | Self::Resolution | Self::Range => 2,
            Self::RangeMilli | Self::Factor => 4,
            Self::Channels => 1,
            Self::Security => 16,
        }
    }
}

/// Settings with one or more values each: as offered, requested or answered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsList(pub Vec<(SettingKind, Vec<u32>)>);

impl SettingsList {
    /// Decodes a sequence of kind, count and values. Only the first four bytes of a key are kept.
    pub fn decode(parameters: &[u8]) -> Result<Self, DecodeError> {
        let mut settings = Vec::new();
        let mut rest = parameters;
        while !rest.is_empty() {
            let mut header = Cursor::new("a setting", rest);
            let (code, count) = (header.u8()?, usize::from(header.u8()?));
            let unknown = DecodeError::Unknown { what: "the kind of a setting", got: code.into() };
            let kind = SettingKind::from_code(code).ok_or(unknown)?;
            let bytes = count * kind.bytes();
            let Some((values, after)) = header.rest().split_at_checked(bytes) else {
                let (what, got) = ("the values of a setting", header.rest().len());
                return Err(DecodeError::Truncated { what, expected: bytes, got });
            };
            settings.push((kind, values.chunks(kind.bytes()).map(unsigned).collect()));
            rest = after;
        }
        Ok(Self(settings))
    }

    /// Returns the bytes for a request. A factor or a key is never sent.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (kind, values) in &self.0 {
            if matches!(kind, SettingKind::Factor | SettingKind::Security) {
                continue;
            }
            let values = values.get(..values.len().min(255)).unwrap_or_default();
            bytes.extend([*kind as u8, values.len() as u8]);
            bytes.extend(
                values.iter().flat_map(|value| value.to_le_bytes().into_iter().take(kind.bytes())),
            );
        }
        bytes
    }

    /// Returns the values of a kind.
    pub fn values(&self, kind: SettingKind) -> &[u32] {
        let found = self.0.iter().find(|(of, _)| *of == kind);
        found.map_or(&[], |(_, values)| values)
    }

    /// Returns the factor for values; `None` if the device stated none.
    pub fn factor(&self) -> Option<f64> {
        let bits = self.values(SettingKind::Factor).first()?;
        Some(f64::from(f32::from_bits(*bits))).filter(|factor| factor.is_finite() && *factor > 0.0)
    }
}
