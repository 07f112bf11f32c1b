//! Wearables that this computer reads itself, over their own protocols (`teampulse-devices`).

mod link;
mod worn;
pub mod empatica_e4;
