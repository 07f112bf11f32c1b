//! The signals that streams measure.

use crate::words::words;

words! {
    /// The signal that a stream measures: a closed list. A feature runs on every stream whose
    /// signal it accepts.
    Signal {
        /// Electrocardiogram.
        Ecg = "ecg",
        /// Photoplethysmogram (pulse wave).
        Ppg = "ppg",
        /// Electrodermal activity (skin conductance).
        Eda = "eda",
        /// Electromyogram.
        Emg = "emg",
        /// Electroencephalogram.
        Eeg = "eeg",
        /// Breathing.
        Respiration = "respiration",
        /// Temperature of a person or a device.
        Temperature = "temperature",
        /// Acceleration.
        Acceleration = "acceleration",
        /// Intervals between beats.
        Interval = "interval",
        /// Camera images.
        Image = "image",
        /// Numbers from camera images: brightness, movement, skin colour.
        Video = "video",
        /// Points of a face in pictures.
        Face = "face",
        /// Points of a body in pictures.
        Body = "body",
        /// Estimates of facial expressions.
        Expression = "expression",
        /// Sound.
        Audio = "audio",
        /// Keyboard, mouse and other input of a person.
        Input = "input",
        /// Numbers about a person's use of keyboard, mouse or gamepad in each second.
        Activity = "activity",
        /// State of a battery.
        Battery = "battery",
        /// Quality of a radio link.
        Link = "link",
        /// Pose and speed of a robot.
        Odometry = "odometry",
        /// Diagnostics of a robot.
        Diagnostics = "diagnostics",
        /// Events.
        Event = "event",
        /// Anything else.
        Other = "other",
    }
}
