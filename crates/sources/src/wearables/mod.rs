//! Wearables that this computer reads itself, over their own protocols (`teampulse-devices`).

mod link;
mod worn;
mod beats;
pub mod bluetooth;
pub mod empatica_e4;
pub mod heart_rate;

/// The kinds of sources that are a device which a person wears.
pub const KINDS: [&str; 2] = [empatica_e4::DEVICE, "heart_rate"];

/// The kind of source that reads a device, by the device of its streams.
pub fn kind_of(device: &str) -> Option<&'static str> {
    match device {
        empatica_e4::DEVICE => Some(empatica_e4::DEVICE),
        heart_rate::DEVICE => Some("heart_rate"),
        _ => None,
    }
}
