//! Probes of a sender's clock.

use std::fmt::Write;

/// The largest size of a request or a reply [bytes].
const LARGEST_BYTES: usize = 512;

/// A request for the time of a stream's sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeRequest {
    /// The number of the probe.
    pub wave: i32,
    /// When the request was sent, by the clock of the requester [s].
    pub sent_secs: f64,
}

/// The reply to a probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeReply {
    /// The number of the probe.
    pub wave: i32,
    /// When the request was sent, by the clock of the requester [s].
    pub sent_secs: f64,
    /// When the request arrived, by the clock of the replier [s].
    pub received_secs: f64,
    /// When the reply was sent, by the clock of the replier [s].
    pub replied_secs: f64,
}

impl ProbeRequest {
    /// Encodes the request as a datagram.
    pub fn encode(&self) -> String {
        format!("LSL:timedata\r\n{} {}\r\n", self.wave, self.sent_secs)
    }

    /// Parses a datagram; `None` if it is not a probe request.
    pub fn parse(datagram: &[u8]) -> Option<ProbeRequest> {
        let text = std::str::from_utf8(datagram.get(..datagram.len().min(LARGEST_BYTES))?).ok()?;
        let (method, rest) = text.split_once('\n')?;
        let mut words = rest.split_ascii_whitespace();
        let wave = words.next()?.parse().ok()?;
        let sent_secs = finite(words.next()?)?;
        (method.trim() == "LSL:timedata").then_some(ProbeRequest { wave, sent_secs })
    }
}

impl ProbeReply {
    /// Encodes the reply as a datagram.
    pub fn encode(&self) -> String {
        let mut text = format!(" {}", self.wave);
        for secs in [self.sent_secs, self.received_secs, self.replied_secs] {
            // Writing to a string can't fail.
            write!(text, " {secs}").ok();
        }
        text
    }

    /// Parses a datagram; `None` if it is not a reply to a probe.
    pub fn parse(datagram: &[u8]) -> Option<ProbeReply> {
        let text = std::str::from_utf8(datagram.get(..datagram.len().min(LARGEST_BYTES))?).ok()?;
        let mut words = text.split_ascii_whitespace();
        let wave = words.next()?.parse().ok()?;
        let mut secs = || finite(words.next()?);
        let (sent_secs, received_secs, replied_secs) = (secs()?, secs()?, secs()?);
        Some(ProbeReply { wave, sent_secs, received_secs, replied_secs })
    }
}

fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|secs: &f64| secs.is_finite())
}
