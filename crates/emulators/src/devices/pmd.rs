//! Parts shared by all sensors with Polar's Measurement Data service.

/// The company number of Polar Electro (assigned numbers, 7.1).
pub(super) const POLAR: u16 = 0x006b;

/// The clock of a sensor that was never set, at power-on \[ns\] since 2000-01-01: 2019-01-01.
pub(super) const POWER_ON_NS: u64 = 599_616_000_000_000_000;

/// The MTU with which these sensors stream: a frame is one packet.
pub(super) const MTU: u16 = 232;

/// Status codes of answers.
pub(super) const SUCCESS: u8 = 0;
pub(super) const INVALID_COMMAND: u8 = 1;
pub(super) const INVALID_MEASUREMENT: u8 = 2;
pub(super) const INVALID_LENGTH: u8 = 4;
pub(super) const INVALID_PARAMETER: u8 = 5;
pub(super) const ALREADY_IN_STATE: u8 = 6;
pub(super) const INVALID_MTU: u8 = 10;

/// Kinds of settings.
pub(super) const RATE: u8 = 0;
pub(super) const RESOLUTION: u8 = 1;
pub(super) const RANGE: u8 = 2;
pub(super) const CHANNELS: u8 = 4;
pub(super) const FACTOR: u8 = 5;

/// Returns the answer to a command, with parameters or with the status of a refusal.
pub(super) fn answer(command: &[u8], result: Result<Vec<u8>, u8>) -> Vec<u8> {
    let mut answer = vec![0xf0];
    answer.extend(command.iter().chain(&[0, 0]).take(2));
    match result {
        Ok(parameters) => {
            answer.extend([SUCCESS, 0]);
            answer.extend(parameters);
        }
        Err(status) => answer.push(status),
    }
    answer
}

/// Returns the status that refuses a setting that is not offered.
pub(super) const fn refusal(setting: u8) -> u8 {
    match setting {
        RESOLUTION => 7,
        RATE => 8,
        CHANNELS => 11,
        _ => 9,
    }
}
