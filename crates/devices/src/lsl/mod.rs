//! Lab Streaming Layer (LSL): streams of samples and markers between programs on a network, each found by its
//! properties.
//!
//! Sources: the protocol as implemented by github.com/sccn/liblsl 1.17 (`src/udp_server.cpp`, `tcp_server.cpp`,
//! `sample.cpp`, `stream_info_impl.cpp`), and its documentation at labstreaminglayer.readthedocs.io. Protocol version
//! 1.10.
//!
//! | exchange | over | request | reply |
//! |---|---|---|---|
//! | discovery | UDP 16571 (multicast), 16572–16603 (unicast) | `LSL:shortinfo\r\n<query>\r\n<port> <id>\r\n` | to that port: `<id>\r\n<xml>` |
//! | description | TCP, the data port | `LSL:fullinfo\r\n` | the XML with channels, until the connection ends |
//! | samples | TCP, the data port | `LSL:streamfeed/110 <uid>\r\n`, headers, an empty line | `LSL/110 200 OK`, headers, an empty line, samples |
//! | clock | UDP, the service port | `LSL:timedata\r\n<wave> <t0>\r\n` | ` <wave> <t0> <t1> <t2>` |
//!
//! A sample is a byte, a stamp if that byte is 2 (`f64`, seconds of the sender's clock), and its values. If the byte is
//! 1, the stamp is one period after the previous stamp. A text is the size of its length field in bytes, its length,
//! and UTF-8. The first two samples are known patterns, by which both sides check that they agree on the format.
//!
//! Quirks, each with a test:
//! - One stream answers several times: over each multicast group and each interface.
//! - Numbers are little-endian unless the reply says `Byte-Order: 4321`; `0` means the sender's native order, which is
//!   little-endian.
//! - A sender's clock counts from when its computer was switched on; only probes relate it to another clock.
//! - Texts may hold any bytes; their lengths have sizes of 1, 2, 4 or 8 bytes.

mod xml;
mod format;
mod info;
mod query;
mod probe;
mod handshake;
mod samples;

use std::net::Ipv4Addr;

use thiserror::Error;

pub use format::{Format, Values};
pub use handshake::{FeedReply, FeedRequest, ReplyReader, Request, RequestReader, not_found};
pub use info::{ChannelInfo, StreamInfo};
pub use probe::{ProbeReply, ProbeRequest};
pub use query::{Discovery, Query, discovered};
pub use samples::{Sample, SampleReader, SampleWriter};

/// The UDP port of discovery over multicast.
pub const MULTICAST_PORT: u16 = 16571;
/// The ports of streams: UDP for services, TCP for samples.
pub const PORTS: std::ops::Range<u16> = 16572..16604;
/// The multicast groups and the broadcast address for discovery.
pub const GROUPS: [[u8; 4]; 4] =
    [[239, 255, 172, 215], [224, 0, 0, 183], [224, 0, 0, 1], [255, 255, 255, 255]];

/// The prefix of the source ids of teampulse's outlets.
pub const OWN: &str = "teampulse:";

/// Returns the addresses of this computer from the kernel's routing table (`/proc/net/fib_trie`); multicast is sent
/// through each of them.
pub fn addresses(table: &str) -> Vec<Ipv4Addr> {
    let mut addresses = Vec::new();
    let mut last: Option<Ipv4Addr> = None;
    for line in table.lines().map(str::trim) {
        if let Some(address) = line.strip_prefix("|-- ") {
            last = address.parse().ok();
        } else if line == "/32 host LOCAL" {
            addresses.extend(last);
        }
    }
    addresses.sort();
    addresses.dedup();
    addresses
}

/// Why data from another program could not be read. The message fits after "failed to".
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LslError {
    /// A description is not XML, or is too large.
    #[error("read the description of a stream: {0}")]
    Description(&'static str),
    /// A description lacks an element, or an element has an impossible value.
    #[error("read the description of a stream: its {field} is `{got}`")]
    Field {
        /// The name of the element.
        field: &'static str,
        /// The text of the element.
        got: String,
    },
    /// The headers are not a valid request or reply.
    #[error("read the headers of a stream: {0}")]
    Headers(&'static str),
    /// The other side refused the request.
    #[error("read the stream: the sender replied `{0}`")]
    Refused(String),
    /// The first samples are not the agreed patterns.
    #[error("read samples: the sender's first samples are not LSL's test pattern")]
    Pattern,
    /// A text is too long.
    #[error("read samples: a text has {0} bytes, which is too long")]
    Long(u64),
    /// A byte of a sample has an impossible value.
    #[error("read samples: a byte is {0:#x}, expected {1}")]
    Byte(u8, &'static str),
}
