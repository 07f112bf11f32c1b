//! `wireless_msgs`: the radio link of Clearpath's robots.

use super::message;

/// The state of a wireless link, without a stamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Connection {
    /// Bit rate [Mbit/s].
    pub bitrate: f32,
    /// The transmit power [dBm].
    pub txpower: i16,
    /// The link quality as written by the driver: `57/70`.
    pub link_quality_raw: String,
    /// The link quality [0..1].
    pub link_quality: f32,
    /// The received signal power [dBm].
    pub signal_level: i16,
    /// The noise power [dBm].
    pub noise_level: i16,
    /// The name of the network.
    pub essid: String,
    /// The address of the access point.
    pub bssid: String,
    /// The frequency of the channel, in the driver's unit: [GHz] from `iwconfig`.
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
