//! Wearables that this computer reads itself, over their own protocols (`teampulse-devices`).

mod link;
mod worn;
pub mod empatica_e4;

/// The kinds of sources that are a device which a person wears; their streams have the kind as their device.
pub const KINDS: [&str; 1] = [empatica_e4::DEVICE];
