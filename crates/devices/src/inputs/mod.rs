//! Keyboards, mice and gamepads: how much a person uses them each second, but not which keys.
//!
//! Events go in, summaries of whole seconds come out. The times between presses can reveal a text, and so can the times
//! of single presses; so a summary holds counts, means over at least [`LEAST_GROUP`] times, and idle time in whole
//! seconds. The identity of a key is needed to match its release with its press. It is [never shown](Which), and is
//! forgotten with the release.
//!
//! | kind | channel | unit | |
//! |---|---|---|---|
//! | keyboard | `presses` | 1 | keys pressed, without repeats of keys that are held |
//! | | `corrections` | 1 | of these, Backspace and Delete |
//! | | `holds`, `hold_mean`, `hold_sd` | 1, ms, ms | number, mean and population SD of the times from press to release |
//! | | `intervals`, `interval_mean`, `interval_sd` | 1, ms, ms | the same of the times from press to press, up to [`PAUSE_SECS`] |
//! | | `idle` | s | whole seconds since the last event |
//! | mouse | `path` | 1 | the length of its path in counts of the sensor |
//! | | `clicks`, `double_clicks` | 1 | buttons pressed; the same again within [`DOUBLE_SECS`] |
//! | | `wheel` | 1 | steps, in either direction |
//! | | `moving` | s | time in which it moved |
//! | | `idle` | s | as above |
//! | gamepad | `presses` | 1 | buttons pressed |
//! | | `deflection` | 1 | mean over time of the deflection of the stick that is deflected most, from 0 to 1 |
//! | | `moving` | s | time in which a stick was deflected by more than [`DEAD_ZONE`] |
//! | | `idle` | s | as above |
//!
//! Quirks: a held key repeats, on Linux as a separate value, on X11 as presses without releases. Releases can be lost
//! (a keyboard is unplugged, the kernel's queue overflows), so that a key seems to be held forever.

mod act;
mod seconds;
mod spread;
mod keyboard;
mod mouse;
mod gamepad;
pub mod evdev;

pub use act::{Act, Which};
pub use gamepad::DEAD_ZONE;
pub use keyboard::PAUSE_SECS;
pub use mouse::DOUBLE_SECS;
pub use seconds::{Seconds, Summary};
pub use spread::LEAST_GROUP;

/// A kind of input device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A keyboard.
    Keyboard,
    /// A mouse, touchpad or other pointer.
    Mouse,
    /// A gamepad or joystick.
    Gamepad,
}

impl Kind {
    /// All kinds of input device.
    pub const ALL: [Kind; 3] = [Kind::Keyboard, Kind::Mouse, Kind::Gamepad];

    /// The name of the kind, as part of a topic.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Keyboard => "keyboard",
            Kind::Mouse => "mouse",
            Kind::Gamepad => "gamepad",
        }
    }

    /// The channels of the kind's summaries, with their units.
    pub fn channels(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Kind::Keyboard => &keyboard::CHANNELS,
            Kind::Mouse => &mouse::CHANNELS,
            Kind::Gamepad => &gamepad::CHANNELS,
        }
    }
}

#[cfg(test)]
mod tests;
