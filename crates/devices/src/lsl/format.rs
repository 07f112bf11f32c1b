//! The formats of values, and the test patterns at the start of a feed.

/// The format of a stream's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 32-bit floats.
    Float32,
    /// 64-bit floats.
    Double64,
    /// Texts.
    String,
    /// 32-bit integers.
    Int32,
    /// 16-bit integers.
    Int16,
    /// 8-bit integers.
    Int8,
    /// 64-bit integers; those beyond 2⁵³ are rounded.
    Int64,
}

/// The values of a sample, one for each channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Texts.
    Texts(Vec<String>),
}

impl Format {
    const WORDS: [(Format, &'static str); 7] = [
        (Format::Float32, "float32"),
        (Format::Double64, "double64"),
        (Format::String, "string"),
        (Format::Int32, "int32"),
        (Format::Int16, "int16"),
        (Format::Int8, "int8"),
        (Format::Int64, "int64"),
    ];

    /// Returns the format with this name; `None` for any other text.
    pub fn from_word(word: &str) -> Option<Format> {
        Self::WORDS.iter().find(|(_, known)| *known == word).map(|(format, _)| *format)
    }

    /// The name of the format.
    pub fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(format, _)| *format == self).map_or("", |(_, word)| word)
    }

    /// The size of a number [bytes]; 0 for texts, whose size varies.
    pub fn size(self) -> usize {
        match self {
            Format::Float32 | Format::Int32 => 4,
            Format::Double64 | Format::Int64 => 8,
            Format::Int16 => 2,
            Format::Int8 => 1,
            Format::String => 0,
        }
    }

    /// Whether values are floating-point numbers.
    pub fn is_float(self) -> bool {
        matches!(self, Format::Float32 | Format::Double64)
    }

    /// Decodes a little-endian number.
    pub(super) fn number(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Format::Float32 => f32::from_le_bytes(bytes.try_into().ok()?).into(),
            Format::Double64 => f64::from_le_bytes(bytes.try_into().ok()?),
            Format::Int32 => i32::from_le_bytes(bytes.try_into().ok()?).into(),
            Format::Int16 => i16::from_le_bytes(bytes.try_into().ok()?).into(),
            Format::Int8 => i8::from_le_bytes(bytes.try_into().ok()?).into(),
            Format::Int64 => i64::from_le_bytes(bytes.try_into().ok()?) as f64,
            Format::String => return None,
        })
    }

    /// Appends a number in little-endian order; one outside the range of an integer format is clamped to the nearest
    /// value in range.
    pub(super) fn write(self, number: f64, out: &mut Vec<u8>) {
        match self {
            Format::Float32 => out.extend((number as f32).to_le_bytes()),
            Format::Double64 => out.extend(number.to_le_bytes()),
            Format::Int32 => out.extend((number.round() as i32).to_le_bytes()),
            Format::Int16 => out.extend((number.round() as i16).to_le_bytes()),
            Format::Int8 => out.extend((number.round() as i8).to_le_bytes()),
            Format::Int64 => out.extend((number.round() as i64).to_le_bytes()),
            Format::String => {}
        }
    }

    /// Returns the values of test pattern number 4 or 2: they rise by one, with alternating signs.
    pub(super) fn pattern(self, number: i64, channels: usize) -> Values {
        let (offset, most) = match self {
            Format::Float32 => (0, i64::MAX),
            Format::Double64 => (16_777_217, i64::MAX),
            Format::Int32 => (65_537, i32::MAX.into()),
            Format::Int16 => (257, i16::MAX.into()),
            Format::Int8 => (1, i8::MAX.into()),
            Format::Int64 => (2_147_483_649, i64::MAX),
            Format::String => return texts(channels),
        };
        let value = |channel: usize| {
            let value = (channel as i64 + number + offset) % most;
            if channel.is_multiple_of(2) { value as f64 } else { -(value as f64) }
        };
        Values::Numbers((0..channels).map(value).collect())
    }
}

fn texts(channels: usize) -> Values {
    let text = |channel: usize| {
        let value = channel as i64 + 10;
        (if channel.is_multiple_of(2) { value } else { -value }).to_string()
    };
    Values::Texts((0..channels).map(text).collect())
}
