use crate::devices::pmd::{
    INVALID_COMMAND, INVALID_LENGTH, INVALID_MEASUREMENT, INVALID_PARAMETER, RANGE, RATE,
    RESOLUTION, refusal,
};

/// A measurement of the control point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Ecg,
    Acceleration,
}

/// The features of an H10: ECG and acceleration.
pub(super) const FEATURES: [u8; 17] = [0x0f, 0x05, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

/// The offered settings: the kind of each, and its 16-bit values.
type Offer = &'static [(u8, &'static [u16])];
const ECG: Offer = &[(RATE, &[130]), (RESOLUTION, &[14])];
const ACCELERATION: Offer =
    &[(RATE, &[25, 50, 100, 200]), (RESOLUTION, &[16]), (RANGE, &[2, 4, 8])];

/// A parsed command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    Settings(Kind),
    Start(Kind, u16),
    Stop(Kind),
}

impl Kind {
    const fn offer(self) -> Offer {
        match self {
            Self::Ecg => ECG,
            Self::Acceleration => ACCELERATION,
        }
    }

    /// Returns the bytes of the offer in an answer.
    pub fn offered(self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (setting, values) in self.offer() {
            bytes.extend([*setting, values.len() as u8]);
            bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        bytes
    }
}

/// Parses a command; returns the status of the refusal if it is invalid.
pub(super) fn parse(command: &[u8]) -> Result<Asked, u8> {
    let &[code, measurement, ref settings @ ..] = command else { return Err(INVALID_LENGTH) };
    let kind = match measurement {
        0 => Kind::Ecg,
        2 => Kind::Acceleration,
        _ => return Err(INVALID_MEASUREMENT),
    };
    match code {
        1 => Ok(Asked::Settings(kind)),
        2 => rate(kind, settings).map(|rate_hz| Asked::Start(kind, rate_hz)),
        3 => Ok(Asked::Stop(kind)),
        _ => Err(INVALID_COMMAND),
    }
}

/// Returns the rate among the settings of a start, each of which must have one of the offered values.
fn rate(kind: Kind, settings: &[u8]) -> Result<u16, u8> {
    let (settings, []) = settings.as_chunks::<4>() else { return Err(INVALID_LENGTH) };
    let mut rate_hz = None;
    for [setting, count, low, high] in settings {
        let value = u16::from_le_bytes([*low, *high]);
        let offered = kind.offer().iter().find(|(offered, _)| offered == setting);
        let Some((_, values)) = offered else { return Err(INVALID_PARAMETER) };
        if *count != 1 || !values.contains(&value) {
            return Err(refusal(*setting));
        }
        if *setting == RATE {
            rate_hz = Some(value);
        }
    }
    rate_hz.ok_or(INVALID_PARAMETER)
}
