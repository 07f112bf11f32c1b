//! The events of Linux input devices (`linux/input-event-codes.h`, Documentation/input/event-codes.rst).

use std::collections::BTreeMap;

use super::{Act, Kind, Which};

const EV_SYN: u16 = 0;
const EV_KEY: u16 = 1;
const EV_REL: u16 = 2;
const EV_ABS: u16 = 3;
const SYN_REPORT: u16 = 0;
const SYN_DROPPED: u16 = 3;
/// `KEY_BACKSPACE` and `KEY_DELETE`.
const CORRECTIONS: [u16; 2] = [14, 111];
/// `KEY_Q` and `KEY_SPACE`, which power buttons and remote controls lack.
const OF_KEYBOARDS: [u16; 2] = [16, 57];
const FIRST_BUTTON: u16 = 0x100;
/// `BTN_LEFT` up to `BTN_TASK`.
const MOUSE_BUTTONS: std::ops::RangeInclusive<u16> = 0x110..=0x117;
const BTN_LEFT: u16 = 0x110;
const BTN_TOUCH: u16 = 0x14a;
/// `BTN_TRIGGER` up to `BTN_THUMBR`, and the four buttons of a D-pad.
const CONTROLS: std::ops::RangeInclusive<u16> = 0x120..=0x13f;
const DIRECTIONS: std::ops::RangeInclusive<u16> = 0x220..=0x223;
/// `BTN_TRIGGER` and `BTN_SOUTH`, one of which every joystick and gamepad has.
const OF_GAMEPADS: [u16; 2] = [0x120, 0x130];
const REL_X: u16 = 0;
const REL_Y: u16 = 1;
const REL_HWHEEL: u16 = 6;
const REL_WHEEL: u16 = 8;
/// `ABS_X` and `ABS_Y`.
const POSITION: [u16; 2] = [0, 1];
/// `ABS_X` up to `ABS_RZ`: sticks and triggers.
const STICKS: std::ops::RangeInclusive<u16> = 0..=5;
/// `ABS_Z` and `ABS_RZ`, which are the triggers of most gamepads.
const TRIGGERS: [u16; 2] = [2, 5];
/// `ABS_HAT0X` up to `ABS_HAT3Y`: the direction pad of some gamepads.
const HATS: std::ops::RangeInclusive<u16> = 16..=23;

/// What a device can do.
#[derive(Clone, Debug, Default)]
pub struct Abilities {
    /// The codes of the keys and buttons.
    pub keys: Vec<u16>,
    /// The codes of the relative axes.
    pub relative: Vec<u16>,
    /// The codes of the absolute axes, each with its minimum and maximum.
    pub absolute: Vec<(u16, i32, i32)>,
}

impl Abilities {
    /// The kinds of input device that this is: a wireless receiver may combine several.
    pub fn kinds(&self) -> Vec<Kind> {
        let has = |code: &u16| self.keys.contains(code);
        let is_keyboard = OF_KEYBOARDS.iter().all(has);
        let is_gamepad = OF_GAMEPADS.iter().any(has);
        let has_position = self.absolute.iter().any(|(code, ..)| POSITION.contains(code));
        let points = self.relative.contains(&REL_X) || (has_position && !is_gamepad);
        let is_mouse = points && (has(&BTN_LEFT) || has(&BTN_TOUCH));
        let is = |kind: &Kind| match kind {
            Kind::Keyboard => is_keyboard,
            Kind::Mouse => is_mouse,
            Kind::Gamepad => is_gamepad,
        };
        Kind::ALL.into_iter().filter(is).collect()
    }
}

/// Interprets the events of a device.
#[derive(Clone, Debug)]
pub struct Translator {
    kinds: Vec<Kind>,
    /// The minimum and maximum of each axis.
    ranges: BTreeMap<u16, (i32, i32)>,
    /// The movement since the last report.
    moved: [f64; 2],
    /// The last position of a pointer with absolute axes.
    position: [Option<i32>; 2],
}

impl Translator {
    /// Creates a translator for a device with these abilities, limited to `kinds`.
    pub fn new(abilities: &Abilities, kinds: &[Kind]) -> Translator {
        let is_wanted = |kind: &Kind| kinds.contains(kind);
        let kinds = abilities.kinds().into_iter().filter(is_wanted).collect();
        let range = |&(code, least, most): &(u16, i32, i32)| (code, (least, most));
        let ranges = abilities.absolute.iter().map(range).collect();
        Translator { kinds, ranges, moved: [0.0; 2], position: [None; 2] }
    }

    /// The kinds of devices whose actions are reported.
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// Returns the actions that an event represents, if any.
    pub fn take(&mut self, kind: u16, code: u16, value: i32) -> Vec<Act> {
        let acts = match kind {
            EV_SYN if code == SYN_DROPPED => self.lose(),
            EV_SYN if code == SYN_REPORT => self.report().into_iter().collect(),
            EV_KEY => self.key(code, value).into_iter().collect(),
            EV_REL => self.relative(code, value).into_iter().collect(),
            EV_ABS => self.absolute(code, value).into_iter().collect(),
            _ => Vec::new(),
        };
        acts.into_iter().filter(|act: &Act| self.kinds.contains(&act.kind())).collect()
    }

    fn lose(&mut self) -> Vec<Act> {
        (self.moved, self.position) = ([0.0; 2], [None; 2]);
        self.kinds.iter().map(|kind| Act::Lost(*kind)).collect()
    }

    fn report(&mut self) -> Option<Act> {
        let [x, y] = std::mem::take(&mut self.moved);
        (x != 0.0 || y != 0.0).then(|| Act::Move(x.hypot(y)))
    }

    fn key(&mut self, code: u16, value: i32) -> Option<Act> {
        // The value 2 is a repeat.
        let is_down = match value {
            0 => false,
            1 => true,
            _ => return None,
        };
        match code {
            BTN_TOUCH => {
                self.position = [None; 2];
                None
            }
            _ if MOUSE_BUTTONS.contains(&code) => {
                is_down.then(|| Act::Click(Which::of(code.into())))
            }
            _ if CONTROLS.contains(&code) || DIRECTIONS.contains(&code) => {
                is_down.then_some(Act::Control)
            }
            _ if code < FIRST_BUTTON => {
                let corrects = CORRECTIONS.contains(&code);
                Some(Act::Key { which: Which::of(code.into()), is_down, corrects })
            }
            _ => None,
        }
    }

    fn relative(&mut self, code: u16, value: i32) -> Option<Act> {
        match code {
            REL_X => self.moved[0] += f64::from(value),
            REL_Y => self.moved[1] += f64::from(value),
            REL_WHEEL | REL_HWHEEL => return Some(Act::Wheel(f64::from(value))),
            _ => {}
        }
        None
    }

    fn absolute(&mut self, code: u16, value: i32) -> Option<Act> {
        if self.kinds.contains(&Kind::Gamepad) {
            return self.stick(code, value);
        }
        let place = POSITION.iter().position(|each| *each == code)?;
        let before = self.position[place].replace(value);
        self.moved[place] += before.map_or(0.0, |before| f64::from(value) - f64::from(before));
        None
    }

    fn stick(&self, code: u16, value: i32) -> Option<Act> {
        if HATS.contains(&code) {
            return (value != 0).then_some(Act::Control);
        }
        let (least, most) = *self.ranges.get(&code).filter(|_| STICKS.contains(&code))?;
        let (least, most) = (f64::from(least), f64::from(most));
        if most <= least {
            return None;
        }
        let share = (f64::from(value) - least) / (most - least);
        // A trigger rests at its minimum, a stick in the middle.
        let is_trigger = least >= 0.0 && TRIGGERS.contains(&code);
        let deflection = if is_trigger { share } else { 2.0 * share - 1.0 };
        Some(Act::Stick(u8::try_from(code).ok()?, deflection.clamp(-1.0, 1.0)))
    }
}
