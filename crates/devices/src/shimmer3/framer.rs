use super::TICKS_HZ;
use super::crc;

/// The largest number of bytes kept while searching for a packet: more than three packets of any kind.
const MOST_KEPT: usize = 2048;

/// Splits the bytes of a streaming device into packets and replies.
///
/// The result depends on the bytes alone, not on the pieces in which they arrive.
#[derive(Debug)]
pub(super) struct Framer {
    /// The length of a packet without its checksum.
    length: usize,
    /// The time between packets \[ticks\].
    interval: u32,
    checked: bool,
    kept: Vec<u8>,
    last_ticks: Option<u32>,
    discarded: usize,
}

/// An item that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Frame {
    Packet { ticks: u32, channels: Vec<u8> },
    Acknowledged,
    Refused,
    Battery { adc: u16, status: u8 },
    Status,
}

/// What the remaining bytes start with.
enum Front {
    Frame(Frame, usize),
    Noise,
    NotYet,
}

impl Framer {
    /// Creates a framer; `length` is the length of a packet, from its `00` to its last channel.
    pub fn new(length: usize, interval: u32, checked: bool) -> Self {
        let (kept, last_ticks, discarded) = (Vec::new(), None, 0);
        Self { length, interval, checked, kept, last_ticks, discarded }
    }

    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(Frame, usize)) {
        for piece in bytes.chunks(MOST_KEPT) {
            self.kept.extend_from_slice(piece);
            let mut at = 0;
            loop {
                match self.front(self.kept.get(at..).unwrap_or_default()) {
                    Front::Frame(frame, length) => {
                        at += length;
                        if let Frame::Packet { ticks, .. } = &frame {
                            self.last_ticks = Some(*ticks);
                        }
                        each(frame, std::mem::take(&mut self.discarded));
                    }
                    Front::Noise => {
                        at += 1;
                        self.discarded += 1;
                    }
                    Front::NotYet => break,
                }
            }
            self.kept.drain(..at);
        }
    }

    fn front(&self, bytes: &[u8]) -> Front {
        match bytes.first() {
            None => Front::NotYet,
            Some(0) if self.checked => self.checked_packet(bytes),
            Some(0) => self.packet(bytes),
            Some(0xff | 0xfe | 0x8a) => self.reply(bytes),
            Some(_) => Front::Noise,
        }
    }

    fn checked_packet(&self, bytes: &[u8]) -> Front {
        let Some(packet) = bytes.get(..self.length + 2) else { return Front::NotYet };
        let placed = self.last_ticks.is_none_or(|last| self.follows(last, ticks(packet)));
        if placed && crc::is_intact(packet) {
            return self.take(packet, self.length + 2);
        }
        // If the clock is far off but two packets have a valid checksum, the clock was set.
        let next = bytes.get(self.length + 2..2 * (self.length + 2));
        match next {
            None if crc::is_intact(packet) => Front::NotYet,
            Some(next) if crc::is_intact(packet) && crc::is_intact(next) => {
                self.take(packet, self.length + 2)
            }
            _ => Front::Noise,
        }
    }

    /// Finds a packet without a checksum: it is accepted if the next one begins right after it; after a loss, if the
    /// next one is exactly in step; and if it does not follow the last packet, if two more packets follow in step.
    fn packet(&self, bytes: &[u8]) -> Front {
        let header = |at: usize| bytes.get(at..at + 4);
        let Some(first) = header(0) else { return Front::NotYet };
        let second = skip_replies(bytes, self.length);
        let Some(next) = header(second) else { return Front::NotYet };
        let (now, then) = (ticks(first), ticks(next));
        let is_next = next.first() == Some(&0) && self.is_next(now, then);
        let goes_on =
            is_next || next.first() == Some(&0) && self.discarded == 0 && self.follows(now, then);
        if goes_on && self.last_ticks.is_some_and(|last| self.follows(last, now)) {
            return self.take(bytes, self.length);
        }
        if !is_next {
            return Front::Noise;
        }
        let Some(last) = header(second + self.length) else { return Front::NotYet };
        if last.first() == Some(&0) && self.is_next(then, ticks(last)) {
            self.take(bytes, self.length)
        } else {
            Front::Noise
        }
    }

    fn take(&self, bytes: &[u8], whole: usize) -> Front {
        let channels = bytes.get(4..self.length).unwrap_or_default().to_vec();
        Front::Frame(Frame::Packet { ticks: ticks(bytes), channels }, whole)
    }

    /// Whether a packet is exactly one interval later than the last one.
    fn is_next(&self, last: u32, ticks: u32) -> bool {
        let step = ticks.wrapping_sub(last) & 0x00ff_ffff;
        step.abs_diff(self.interval) <= 1
    }

    /// Whether a packet is a whole number of intervals later, and at most a minute.
    fn follows(&self, last: u32, ticks: u32) -> bool {
        let step = ticks.wrapping_sub(last) & 0x00ff_ffff;
        let off = step % self.interval;
        step >= self.interval - 1 && step <= 60 * TICKS_HZ && (off <= 1 || off >= self.interval - 1)
    }

    /// Finds an acknowledgement, status or battery reply, requested or not.
    fn reply(&self, bytes: &[u8]) -> Front {
        let sum = if self.checked { 2 } else { 0 };
        let is_whole = |length: usize| {
            let reply = bytes.get(..length + sum)?;
            Some(!self.checked || crc::is_intact(reply))
        };
        let acknowledgement = match bytes {
            [0xff, ..] => Some(Frame::Acknowledged),
            [0xfe, ..] => Some(Frame::Refused),
            _ => None,
        };
        let prefix = usize::from(acknowledgement.is_some());
        if let Some(frame) = acknowledgement {
            match is_whole(1) {
                None => return Front::NotYet,
                Some(true) => return Front::Frame(frame, 1 + sum),
                Some(false) => {}
            }
        }
        let (frame, length) = match bytes.get(prefix..).unwrap_or_default() {
            [] | [0x8a] | [0x8a, 0x94] | [0x8a, 0x94, _] | [0x8a, 0x94, _, _] => {
                return Front::NotYet;
            }
            [0x8a, 0x71, ..] => (Frame::Status, 3),
            [0x8a, 0x94, low, high, status, ..] => {
                let adc = u16::from_le_bytes([*low, *high]);
                (Frame::Battery { adc, status: *status }, 5)
            }
            _ => return Front::Noise,
        };
        match is_whole(prefix + length) {
            None => Front::NotYet,
            Some(true) => Front::Frame(frame, prefix + length + sum),
            Some(false) => Front::Noise,
        }
    }
}

/// Skips replies between two packets; returns where they end.
fn skip_replies(bytes: &[u8], from: usize) -> usize {
    (0..2).fold(from, |at, _| match bytes.get(at..).unwrap_or_default() {
        [0xff, 0x8a, 0x71, ..] => at + 4,
        [0xff, 0x8a, 0x94, ..] => at + 6,
        [0x8a, 0x71, ..] => at + 3,
        [0x8a, 0x94, ..] => at + 5,
        [0xff | 0xfe, 0, ..] => at + 1,
        _ => at,
    })
}

fn ticks(packet: &[u8]) -> u32 {
    packet
        .get(1..4)
        .unwrap_or_default()
        .iter()
        .rev()
        .fold(0, |ticks, byte| ticks << 8 | u32::from(*byte))
}
