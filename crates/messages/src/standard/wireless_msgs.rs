//! `wireless_msgs`: the radio link of Clearpath's robots.

use super::message;

/// The state of a wireless link. It has no stamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Connection {
    /// Bit rate [Mbit/s].
    pub bitrate: f32,
    /// Power of the sender [dBm].
    pub txpower: i16,
    /// Link quality as the driver writes it: `57/70`.
    pub link_quality_raw: String,
    /// Link quality [0..1].
    pub link_quality: f32,
    /// Received power [dBm].
    pub signal_level: i16,
    /// Power of the noise [dBm].
    pub noise_level: i16,
    /// Name of the network.
    pub essid: String,
    /// Address of the access point.
    pub bssid: String,
    /// Frequency of the channel, in the unit of the driver: [GHz] from `iwconfig`.
    pub frequency: f64,
}

message!(
    Connection {
        bitrate,
        txpower,
        link_quality_raw,
        link_quality,
        signal_level,
        noise_level,
        essid,
        bssid,
        frequency,
    } = "wireless_msgs/msg/Connection"
);
