//! The protocol between the server and a browser.
//!
//! They communicate over the WebSocket at `/ws`: text frames are JSON with a `type`, binary frames are [waves](waves)
//! and [pictures](pictures). Times are in seconds since the session began [s]; `hello` contains its start. Unknown
//! values are `null`, never 0. The types of the front end, `web/src/wire.ts`, are generated from these by a test.

mod declared;
mod from_browser;
mod from_server;
mod machine;
mod network;
pub mod pictures;
mod replay;
mod stream;
pub mod waves;

pub use declared::{ChannelList, Declared, Description, StreamRow, Whose};
pub use from_browser::{FromBrowser, History as HistoryRequest, MOST_WANTED, Wanted};
pub use from_server::{
    Alert, Column, Echo, Ended, Event, Feature, FromServer, Hello, HistoryReply, Marker, Mode,
    PhasePlan, Pong, Refused, Request, Right, Sample, Status, StreamHealth, Viewer,
};
pub use machine::{Machine, Missed, Recording, RecordingStage, Unmet};
pub use network::{Bus, Computer};
pub use replay::{Absence, Gap, Playback, Timeline};
pub use stream::{Channel, Span, Stream};

/// The version of this protocol; a browser with another version reloads its page.
pub const PROTOCOL: u32 = 6;

/// The number, or `None` if it is not finite: JSON has neither NaN nor infinities.
pub fn known(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod typescript;
