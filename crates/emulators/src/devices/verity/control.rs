use super::VerityModel;
use crate::devices::pmd::{
    CHANNELS, FACTOR, INVALID_COMMAND, INVALID_LENGTH, INVALID_MEASUREMENT, INVALID_PARAMETER,
    RANGE, RATE, RESOLUTION, refusal,
};

/// A measurement of the control point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Ppg = 1,
    Acceleration = 2,
    Intervals = 3,
}

/// The emulated features: PPG, acceleration and intervals between pulses, which an OH1 reports (issue 213).
pub(super) const FEATURES: [u8; 17] = [0x0f, 0x0e, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

/// The factor of PPG in the answer to a start: 1, as an IEEE 754 number (issue 226).
const PPG_STARTED: [u8; 6] = [FACTOR, 1, 0x00, 0x00, 0x80, 0x3f];

/// A parsed command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    Settings(Kind),
    Start(Kind),
    Stop(Kind),
}

/// The offered settings: the kind of each, and its single value.
type Offer = [(u8, u16)];

impl Kind {
    fn of(code: u8) -> Option<Self> {
        [Self::Ppg, Self::Acceleration, Self::Intervals]
            .into_iter()
            .find(|kind| *kind as u8 == code)
    }

    const fn offer(self, model: VerityModel, reports_false_rate: bool) -> &'static Offer {
        use VerityModel::{Oh1, VeritySense};
        match (self, model) {
            (Self::Ppg, VeritySense) if reports_false_rate => {
                &[(RATE, 135), (RESOLUTION, 22), (CHANNELS, 4)]
            }
            (Self::Ppg, VeritySense) => &[(RATE, 55), (RESOLUTION, 22), (CHANNELS, 4)],
            (Self::Acceleration, VeritySense) => {
                &[(RATE, 52), (RESOLUTION, 16), (RANGE, 8), (CHANNELS, 3)]
            }
            (Self::Ppg, Oh1) => &[(RATE, 130), (RESOLUTION, 22)],
            (Self::Acceleration, Oh1) => &[(RATE, 50), (RESOLUTION, 16), (RANGE, 8)],
            (Self::Intervals, _) => &[],
        }
    }

    /// Returns the bytes of the offer in an answer.
    pub fn offered(self, model: VerityModel, reports_false_rate: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (setting, value) in self.offer(model, reports_false_rate) {
            bytes.extend([*setting, 1]);
            bytes.extend(value.to_le_bytes().into_iter().take(width(*setting)));
        }
        bytes
    }

    /// Returns the parameters of the answer to a start: a Verity Sense has none for acceleration (issue 331).
    pub fn started(self, model: VerityModel) -> Vec<u8> {
        let has_factor = self == Self::Ppg && model == VerityModel::VeritySense;
        if has_factor { PPG_STARTED.to_vec() } else { Vec::new() }
    }
}

/// Returns the size of a setting's value [bytes].
const fn width(setting: u8) -> usize {
    if setting == CHANNELS { 1 } else { 2 }
}

/// Parses a command; returns the status of the refusal if it is invalid.
pub(super) fn parse(
    command: &[u8],
    model: VerityModel,
    reports_false_rate: bool,
) -> Result<Asked, u8> {
    let &[code, measurement, ref settings @ ..] = command else { return Err(INVALID_LENGTH) };
    let kind = Kind::of(measurement).ok_or(INVALID_MEASUREMENT)?;
    match code {
        1 => Ok(Asked::Settings(kind)),
        2 => {
            let offer = kind.offer(model, reports_false_rate);
            accept(offer, settings).map(|()| Asked::Start(kind))
        }
        3 => Ok(Asked::Stop(kind)),
        _ => Err(INVALID_COMMAND),
    }
}

/// Checks that a start has a rate if one is offered, and that each of its settings has the offered value.
fn accept(offer: &Offer, mut settings: &[u8]) -> Result<(), u8> {
    let mut has_rate = offer.is_empty();
    while !settings.is_empty() {
        let [setting, count, values @ ..] = settings else { return Err(INVALID_LENGTH) };
        let Some((value, rest)) = values.split_at_checked(width(*setting)) else {
            return Err(INVALID_LENGTH);
        };
        let offered = offer.iter().find(|(offered, _)| offered == setting);
        let Some((_, offered)) = offered else { return Err(INVALID_PARAMETER) };
        if *count != 1 || !offered.to_le_bytes().starts_with(value) {
            return Err(refusal(*setting));
        }
        has_rate |= *setting == RATE;
        settings = rest;
    }
    if has_rate { Ok(()) } else { Err(INVALID_PARAMETER) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSE: VerityModel = VerityModel::VeritySense;

    #[test]
    fn settings_are_those_that_a_real_sensor_sent() {
        // Issue 226: of a firmware before 2.1.0.
        let ppg = [0x00, 0x01, 0x87, 0x00, 0x01, 0x01, 0x16, 0x00, 0x04, 0x01, 0x04];
        assert_eq!(Kind::Ppg.offered(SENSE, true), ppg);
        let start = [[0x02, 0x01].as_slice(), &ppg].concat();
        assert_eq!(parse(&start, SENSE, true), Ok(Asked::Start(Kind::Ppg)));
        assert_eq!(parse(&start, SENSE, false), Err(8), "its rate is 55 Hz");
    }

    #[test]
    fn a_start_that_real_sensors_took_is_taken() {
        // Issues 331 and 249.
        let acceleration = [2, 2, 0, 1, 0x34, 0, 1, 1, 0x10, 0, 2, 1, 8, 0, 4, 1, 3];
        assert_eq!(parse(&acceleration, SENSE, false), Ok(Asked::Start(Kind::Acceleration)));
        assert_eq!(parse(&[2, 3], SENSE, false), Ok(Asked::Start(Kind::Intervals)));
    }

    #[test]
    fn what_is_not_offered_is_refused() {
        assert_eq!(parse(&[2, 0], SENSE, false), Err(INVALID_MEASUREMENT));
        assert_eq!(parse(&[2, 1], SENSE, false), Err(INVALID_PARAMETER));
        assert_eq!(parse(&[2, 1, 0, 1, 55], SENSE, false), Err(INVALID_LENGTH));
        assert_eq!(parse(&[2, 1, 0, 1, 55, 0, 4, 1, 3], SENSE, false), Err(11));
        assert_eq!(parse(&[9, 1], SENSE, false), Err(INVALID_COMMAND));
        assert_eq!(parse(&[2], SENSE, false), Err(INVALID_LENGTH));
    }
}
