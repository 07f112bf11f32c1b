/// Commands written to the command characteristic.
///
/// ```
/// use teampulse_devices::myo::{Command, Vibration};
///
/// assert_eq!(Command::Vibrate(Vibration::Short).encode(), [3, 1, 1]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Selects the data to send: EMG, IMU with taps, poses.
    SetMode {
        /// The EMG data to send.
        emg: EmgMode,
        /// Whether to send IMU data and taps.
        imu: bool,
        /// Whether to send recognised poses.
        poses: bool,
    },
    /// Makes the armband vibrate.
    Vibrate(Vibration),
    /// Sets whether to stay awake without movement.
    StayAwake(bool),
    /// Switches the armband off until it is charged.
    DeepSleep,
}

/// The EMG data to send.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum EmgMode {
    /// No EMG.
    Off = 0,
    /// EMG with mains hum filtered out.
    Filtered = 2,
    /// EMG as measured.
    #[default]
    Raw = 3,
}

/// How long to vibrate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Vibration {
    /// A short vibration.
    Short = 1,
    /// A medium vibration.
    Medium = 2,
    /// A long vibration.
    Long = 3,
}

impl Command {
    /// Returns the bytes to write: command, length, payload.
    pub fn encode(self) -> Vec<u8> {
        match self {
            Self::SetMode { emg, imu, poses } => {
                let imu = if imu { 3 } else { 0 }; // data and taps
                vec![0x01, 3, emg as u8, imu, u8::from(poses)]
            }
            Self::Vibrate(vibration) => vec![0x03, 1, vibration as u8],
            Self::DeepSleep => vec![0x04, 0],
            Self::StayAwake(awake) => vec![0x09, 1, u8::from(awake)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `dl-myo` sends them, and with the sizes of `myohw.h`.
    #[test]
    fn commands_are_those_of_the_header() {
        let mode = Command::SetMode { emg: EmgMode::Raw, imu: true, poses: true };
        assert_eq!(mode.encode(), [1, 3, 3, 3, 1]);
        assert_eq!(Command::StayAwake(true).encode(), [9, 1, 1]);
        assert_eq!(Command::DeepSleep.encode(), [4, 0]);
    }
}
