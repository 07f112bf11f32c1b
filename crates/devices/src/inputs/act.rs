use std::fmt;

use super::Kind;

/// The identity of a key or button: kept only to match a release with its press, and never shown.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Which(u32);

impl Which {
    /// Returns the identity of the key or button with a code.
    pub fn of(code: u32) -> Which {
        Which(code)
    }
}

impl fmt::Debug for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Which")
    }
}

/// Something that a person did at an input device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act {
    /// A key went down or up.
    Key {
        /// The identity of the key.
        which: Which,
        /// Whether it went down.
        is_down: bool,
        /// Whether the key is Backspace or Delete.
        corrects: bool,
    },
    /// A button of a mouse went down.
    Click(Which),
    /// A mouse moved by this many counts.
    Move(f64),
    /// A wheel turned by this many steps.
    Wheel(f64),
    /// A button of a gamepad went down.
    Control,
    /// An axis of a stick has this deflection, from -1 to 1.
    Stick(u8, f64),
    /// Events of a device were lost: which keys are down is unknown.
    Lost(Kind),
}

impl Act {
    /// The kind of device on which the action happened.
    pub fn kind(&self) -> Kind {
        match self {
            Act::Key { .. } => Kind::Keyboard,
            Act::Click(_) | Act::Move(_) | Act::Wheel(_) => Kind::Mouse,
            Act::Control | Act::Stick(..) => Kind::Gamepad,
            Act::Lost(kind) => *kind,
        }
    }
}
