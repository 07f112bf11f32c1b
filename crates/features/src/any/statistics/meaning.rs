//! For which raw signals the mean is meaningless, and why.

use teampulse_core::stream::{About, Signal, Stream};

/// A sentence on the meaning of a stream's statistics; `None` where that is obvious.
pub(super) fn caution(stream: &Stream) -> Option<&'static str> {
    let is_person = stream.about == About::Person;
    Some(match stream.signal {
        Signal::Ecg => "The mean of a raw ECG is the offset of its electrodes, not the heart.",
        Signal::Ppg => {
            "The mean of a raw PPG is the light that comes through skin and sensor, not the pulse."
        }
        Signal::Eeg => "The mean of a raw EEG is the offset of its electrodes, not the brain.",
        Signal::Emg => {
            "The mean of a raw EMG is the offset of its amplifier, not the muscle, whose effort shows in sd."
        }
        Signal::Respiration => {
            "The mean of a raw breathing signal is the fit of the sensor, not the breathing."
        }
        Signal::Audio => "The mean of raw sound is the offset of its amplifier, not the loudness.",
        Signal::Acceleration if is_person => {
            "The mean of a raw acceleration is mostly gravity, and so posture; movement shows in sd."
        }
        Signal::Odometry => {
            "The mean of an orientation means nothing where angles wrap or quaternions are averaged field \
             by field, and that of a position need not be a place where the robot was."
        }
        Signal::Battery | Signal::Diagnostics => {
            "The mean of a number that encodes a state, such as a status or a level, means nothing."
        }
        _ => return None,
    })
}
