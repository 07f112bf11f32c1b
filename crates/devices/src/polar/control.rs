use super::{Measurement, SettingsList};
use crate::DecodeError;
use crate::cursor::Cursor;

/// Commands written to the control point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Requests the settings that the device offers for a measurement.
    Settings(Measurement),
    /// Starts a measurement with one value of each setting.
    Start(Measurement, SettingsList),
    /// Stops a measurement.
    Stop(Measurement),
}

impl Command {
    /// Returns the bytes to write.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = vec![self.code(), self.measurement() as u8];
        if let Self::Start(_, settings) = self {
            bytes.extend(settings.encode());
        }
        bytes
    }

    /// The measurement that the command is about.
    pub const fn measurement(&self) -> Measurement {
        match self {
            Self::Settings(measurement) | Self::Start(measurement, _) | Self::Stop(measurement) => {
                *measurement
            }
        }
    }

    pub(super) const fn code(&self) -> u8 {
        match self {
            Self::Settings(_) => 1,
            Self::Start(..) => 2,
            Self::Stop(_) => 3,
        }
    }
}

/// Messages of the control point: read from it, or sent as indications.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ControlMessage {
    /// What the device can measure. Every read of the control point returns this.
    Features(Features),
    /// The answer to a command.
    Response(Response),
    /// The device stopped these measurements by itself.
    Stopped(Vec<Measurement>),
}

impl ControlMessage {
    /// Decodes the value of the characteristic.
    pub fn decode(value: &[u8]) -> Result<Self, DecodeError> {
        let mut fields = Cursor::new("a control point message", value);
        match fields.u8()? {
            0x0f => fields.u8().map(|bits| Self::Features(Features(bits))),
            0xf0 => Response::decode(value).map(Self::Response),
            0x01 => {
                let codes = fields.rest().iter();
                Ok(Self::Stopped(codes.filter_map(|code| Measurement::from_code(*code)).collect()))
            }
            got => Err(DecodeError::Unknown { what: "a control point message", got: got.into() }),
        }
    }
}

/// The measurements that a device has: bit n is set for the measurement with code n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features(pub u8);

impl Features {
    /// Whether the device can make this measurement.
    pub const fn has(self, measurement: Measurement) -> bool {
        self.0 & 1 << measurement as u8 != 0
    }
}

/// The answer to a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Response {
    /// The code of the command: 1 settings, 2 start, 3 stop.
    pub command: u8,
    /// The code of the measurement.
    pub measurement: u8,
    /// Whether the command was carried out.
    pub status: Status,
    /// Whether parameters continue in another answer.
    pub more: bool,
    /// The settings, to be decoded once no more follow.
    pub parameters: Vec<u8>,
}

impl Response {
    fn decode(value: &[u8]) -> Result<Self, DecodeError> {
        let mut fields = Cursor::new("an answer of the control point", value);
        let [_, command, measurement, status] = fields.array()?;
        let status = Status(status);
        let more = status == Status::SUCCESS && fields.u8().is_ok_and(|more| more != 0);
        let parameters =
            if status == Status::SUCCESS { fields.rest().to_vec() } else { Vec::new() };
        Ok(Self { command, measurement, status, more, parameters })
    }
}

/// The status of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Status(pub u8);

impl Status {
    /// The command was carried out.
    pub const SUCCESS: Self = Self(0);
    /// The measurement is on already, or was off.
    pub const ALREADY_IN_STATE: Self = Self(6);
    /// The packets of the link are too small.
    pub const INVALID_MTU: Self = Self(10);
    /// The device is in its charger.
    pub const IN_CHARGER: Self = Self(13);

    /// The status in the words of the specification.
    pub const fn text(self) -> &'static str {
        match self.0 {
            0 => "success",
            1 => "invalid command",
            2 => "invalid measurement",
            3 => "not supported",
            4 => "invalid length",
            5 => "invalid parameter",
            6 => "already in state",
            7 => "invalid resolution",
            8 => "invalid sample rate",
            9 => "invalid range",
            10 => "invalid MTU",
            11 => "invalid number of channels",
            12 => "invalid state",
            13 => "device in charger",
            14 => "disk full",
            _ => "unknown status",
        }
    }
}
