//! Packets that do not fit their clock, until it is clear whether it was set.

use crate::clock::epoch::Packet;

/// How many packets must agree that the clock was set.
pub const AGREEING: usize = 3;
/// For how long they must [ns]: a burst of old packets agrees for a moment only.
const AGREEING_NANOS: i64 = 100_000_000;
/// How near to each other they are [ns].
const AGREE_NANOS: u64 = 250_000_000;

/// Packets in a row that are not of the epoch, but of one clock that runs.
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
    /// Takes a packet; whether there are enough that agree.
    pub fn push(&mut self, packet: Packet) -> bool {
        let delay = |packet: Packet| packet.arrival.saturating_sub(packet.device);
        let newest = self.packets[self.count.clamp(1, AGREEING) - 1];
        let runs = packet.device > newest.device;
        if self.count == 0 || !runs || delay(packet).abs_diff(delay(newest)) > AGREE_NANOS {
            *self = Astray { count: 1, packets: [packet; AGREEING] };
            return false;
        }
        self.count += 1;
        self.packets[self.count.min(AGREEING) - 1] = packet;
        let lasted = packet.arrival.saturating_sub(self.packets[0].arrival);
        self.count >= AGREEING && lasted >= AGREEING_NANOS
    }
}
