use super::crc;

/// A command and the reply that ends it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub command: Vec<u8>,
    pub reply: Reply,
    /// Whether older firmware may leave the command unanswered.
    pub optional: bool,
}

/// The reply after the acknowledgement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    Nothing,
    Checksum,
    Hardware,
    Firmware,
    Battery,
    Calibration,
    Inquiry,
}

impl Step {
    pub fn new(command: impl Into<Vec<u8>>, reply: Reply) -> Self {
        Self { command: command.into(), reply, optional: false }
    }

    pub fn optional(command: impl Into<Vec<u8>>, reply: Reply) -> Self {
        Self { optional: true, ..Self::new(command, reply) }
    }
}

/// The state of parsing the bytes after a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Parsed {
    /// The step is done: the contents after the reply's header, and the total number of bytes.
    Done(Vec<u8>, usize),
    Refused(usize),
    /// Bytes that are not part of the reply.
    Skip {
        bytes: usize,
        noise: bool,
    },
    NotYet,
}

impl Reply {
    /// Parses a reply from its acknowledgement on; `wide` for a `Shimmer3R`.
    pub fn parse(self, bytes: &[u8], wide: bool) -> Parsed {
        let status = if wide { 4 } else { 3 };
        match bytes {
            [] | [0x8a] => Parsed::NotYet,
            [0x8a, 0x71, ..] if bytes.len() < status => Parsed::NotYet,
            [0x8a, 0x71, ..] => Parsed::Skip { bytes: status, noise: false },
            [0xfe, ..] => Parsed::Refused(1),
            [0xff, rest @ ..] => self.parse_body(rest, wide),
            _ => Parsed::Skip { bytes: 1, noise: true },
        }
    }

    fn parse_body(self, bytes: &[u8], wide: bool) -> Parsed {
        let header: &[u8] = match self {
            Self::Nothing => return Parsed::Done(Vec::new(), 1),
            Self::Checksum => {
                let sum = crc::crc(&[0xff]).to_le_bytes();
                return match bytes {
                    [low, high, ..] if [*low, *high] == sum => Parsed::Done(Vec::new(), 3),
                    [_, _, ..] => Parsed::Refused(1),
                    _ => Parsed::NotYet,
                };
            }
            Self::Hardware => &[0x25],
            Self::Firmware => &[0x2f],
            Self::Battery => &[0x8a, 0x94],
            Self::Calibration => &[0x2d],
            Self::Inquiry => &[0x02],
        };
        if bytes.len() < header.len() {
            return Parsed::NotYet;
        }
        let Some(body) = bytes.strip_prefix(header) else {
            return Parsed::Skip { bytes: 1, noise: true };
        };
        let length = match self {
            Self::Hardware => 1,
            Self::Firmware => 6,
            Self::Battery => 3,
            Self::Calibration => 84,
            _ => match inquiry_length(body, wide) {
                Some(length) => length,
                None => return Parsed::NotYet,
            },
        };
        match body.get(..length) {
            Some(body) => Parsed::Done(body.to_vec(), 1 + header.len() + length),
            None => Parsed::NotYet,
        }
    }
}

/// The size of the header of an inquiry: interval (2), configuration (4; 7 for a `Shimmer3R`), number of channels,
/// buffer size.
pub(super) const fn inquiry_header(wide: bool) -> usize {
    if wide { 11 } else { 8 }
}

fn inquiry_length(body: &[u8], wide: bool) -> Option<usize> {
    let header = inquiry_header(wide);
    body.get(header - 2).map(|channels| header + usize::from(*channels))
}
