//! Packets that do not fit their clock, held until it is clear whether the clock was set.

use crate::clock::epoch::Packet;

/// The number of packets that must agree that the clock was set.
pub const AGREEING: usize = 3;
/// How long they must agree [ns]: a burst of old packets agrees only briefly.
const AGREEING_NANOS: i64 = 100_000_000;
/// How close their delays must be, in addition to the duration of a batch: batches may arrive in pairs [ns].
const AGREE_NANOS: u64 = 250_000_000;

/// A run of packets that do not fit the epoch, but are consistent with each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Astray {
    count: usize,
    pub packets: [Packet; AGREEING],
}

impl Default for Astray {
    fn default() -> Astray {
        Astray { count: 0, packets: [Packet { device: 0, arrival: 0 }; AGREEING] }
    }
}

impl Astray {
    /// Takes a packet whose batch lasts `span` [ns]; returns whether enough packets agree. Packets of several streams
    /// with the same device time count once.
    pub fn push(&mut self, packet: Packet, span: i64) -> bool {
        let newest = self.packets[self.count.clamp(1, AGREEING) - 1];
        let agrees = |other: Packet| agree(packet, other, span);
        if self.count == 0 || !agrees(newest) || !agrees(self.packets[0]) {
            *self = Astray { count: 1, packets: [packet; AGREEING] };
            return false;
        }
        if packet.device <= newest.device {
            return false;
        }
        self.count += 1;
        self.packets[self.count.min(AGREEING) - 1] = packet;
        let lasted = packet.arrival.saturating_sub(self.packets[0].arrival);
        self.count >= AGREEING && lasted >= AGREEING_NANOS
    }
}

/// Whether two packets may be from one epoch; a batch lasts `span` [ns].
pub fn agree(packet: Packet, other: Packet, span: i64) -> bool {
    let delay = |packet: Packet| packet.arrival.saturating_sub(packet.device);
    let most = AGREE_NANOS.saturating_add(span.unsigned_abs());
    delay(packet).abs_diff(delay(other)) <= most
}
