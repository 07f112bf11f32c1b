//! A Shimmer3 GSR+ with the `LogAndStream` firmware, over a byte stream.
//!
//! Based on the firmware's sources (log-and-stream-common at 12db787), and on what pyshimmer and `BrainFlow` accept.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Wearer;
use super::faults::in_order;
use super::shimmer_gsr::Amplifier;

/// The ticks of the device's clock per second.
const TICKS_HZ: f64 = 32768.0;

const ACKNOWLEDGED: u8 = 0xff;
const REFUSED: u8 = 0xfe;

/// The properties of an emulated Shimmer3.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ShimmerSettings {
    /// Whether the firmware supports checksums.
    pub has_checksums: bool,
    /// The clock at the start \[ticks\]; its lower 24 bits are sent, and wrap.
    pub first_ticks: u32,
    /// How much too fast the clock runs: 0.0001 for 100 ppm.
    pub clock_fast: f64,
    /// The faults, in any order.
    #[serde(rename = "faults")]
    pub incidents: Vec<ShimmerIncident>,
}

impl Default for ShimmerSettings {
    fn default() -> Self {
        Self { has_checksums: true, first_ticks: 0, clock_fast: 0.0, incidents: Vec::new() }
    }
}

/// A fault at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShimmerIncident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: ShimmerFault,
}

/// The possible faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShimmerFault {
    /// This byte of the next packet is lost.
    LostByte(usize),
    /// A bit of this byte of the next packet is flipped.
    CorruptByte(usize),
    /// The next packets are lost.
    LostPackets(u32),
    /// The device sends an unsolicited status, as after docking.
    Status,
    /// The device sends nothing until it is started again.
    Stall,
}

/// A Shimmer3 GSR+. Times are true seconds since it was switched on, and never go back.
#[derive(Debug)]
pub struct Shimmer {
    settings: ShimmerSettings,
    now_secs: f64,
    /// The bytes of a command received so far.
    command: Vec<u8>,
    sent: VecDeque<u8>,
    interval_ticks: u16,
    sensors: [u8; 3],
    gsr_range: u8,
    amplifier: Amplifier,
    expansion_power: u8,
    checksum_bytes: u8,
    /// The number of the next packet, counted from power-on.
    streaming: Option<u64>,
    stalled: bool,
    to_lose: u32,
    to_spoil: Option<ShimmerFault>,
}

impl Shimmer {
    /// Creates a Shimmer3 that is switched on and idle.
    pub fn new(mut settings: ShimmerSettings) -> Self {
        settings.incidents = in_order(settings.incidents, |incident| incident.at_secs);
        Self {
            settings,
            now_secs: 0.0,
            command: Vec::new(),
            sent: VecDeque::new(),
            interval_ticks: 640,
            sensors: [0x04, 0, 0],
            gsr_range: 0,
            amplifier: Amplifier::default(),
            expansion_power: 0,
            checksum_bytes: 0,
            streaming: None,
            stalled: false,
            to_lose: 0,
            to_spoil: None,
        }
    }

    /// Whether the device is streaming.
    pub fn is_streaming(&self) -> bool {
        self.streaming.is_some()
    }

    /// Handles commands, split anywhere.
    pub fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.command.push(*byte);
            let Some(code) = self.command.first() else { continue };
            if self.command.len() > arguments(*code) {
                let command = std::mem::take(&mut self.command);
                self.carry_out(&command);
            }
        }
    }

    fn carry_out(&mut self, command: &[u8]) {
        match *command {
            [0x3f] => self.reply(&[0x25, 3]),
            [0x2e] => self.reply(&[0x2f, 3, 0, 0, 0, 16, 11]),
            [0x95] => self.reply(&[0x8a, 0x94, 0x2e, 0x0b, 0x80]),
            [0x72] => self.reply(&[0x8a, 0x71, self.status()]),
            [0x01] => {
                let inquiry = self.inquiry();
                self.reply(&inquiry);
            }
            [0x07] => {
                let interval_secs = self.interval_secs();
                self.streaming = Some((self.now_secs / interval_secs).floor() as u64 + 1);
                self.stalled = false;
                self.reply(&[]);
            }
            [0x20] => {
                self.streaming = None;
                self.reply(&[]);
            }
            [0x8b, ..] if !self.settings.has_checksums => {}
            [0x8b, bytes] => {
                self.checksum_bytes = bytes.min(2);
                self.reply(&[]);
            }
            [0xa3, _] => self.reply(&[]),
            [0x05 | 0x08 | 0x21 | 0x5e, ..] if self.is_streaming() => self.send(&[REFUSED]),
            [0x05, low, high] => {
                self.interval_ticks = u16::from_le_bytes([low, high]).max(1);
                self.reply(&[]);
            }
            [0x08, first, second, third] => {
                self.sensors = [first, second, third];
                self.reply(&[]);
            }
            [0x21, range] => {
                self.gsr_range = range.min(4);
                self.reply(&[]);
            }
            [0x5e, power] => {
                self.expansion_power = power & 1;
                self.reply(&[]);
            }
            // The firmware ignores unknown commands.
            _ => {}
        }
    }

    fn reply(&mut self, reply: &[u8]) {
        self.send(&[&[ACKNOWLEDGED], reply].concat());
    }

    fn send(&mut self, bytes: &[u8]) {
        let sum = checksum(bytes).to_le_bytes();
        self.sent.extend(bytes);
        self.sent.extend(sum.iter().take(self.checksum_bytes.into()));
    }

    /// The status byte. Bit 4: streaming.
    fn status(&self) -> u8 {
        u8::from(self.is_streaming()) << 4
    }

    /// The channels in the firmware's order: battery, PPG (internal ADC 13), skin conductance.
    fn channels(&self) -> Vec<u8> {
        let [first, second, _] = self.sensors;
        let bits =
            [(second & 0x20 != 0, 0x03), (second & 0x01 != 0, 0x12), (first & 0x04 != 0, 0x1c)];
        bits.into_iter().filter(|(on, _)| *on).map(|(_, channel)| channel).collect()
    }

    fn inquiry(&self) -> Vec<u8> {
        let channels = self.channels();
        let mut inquiry = vec![0x02];
        inquiry.extend(self.interval_ticks.to_le_bytes());
        // Bit 0 of the fourth byte is the power, bits 1 to 3 are the range of the conductance.
        inquiry.extend([0x02, 0x09, 0x00, self.gsr_range << 1 | self.expansion_power]);
        inquiry.extend([channels.len() as u8, 1]);
        inquiry.extend(channels);
        inquiry
    }

    fn interval_secs(&self) -> f64 {
        f64::from(self.interval_ticks) / (TICKS_HZ * (1.0 + self.settings.clock_fast))
    }

    /// Returns what the device sends until a time \[s\].
    pub fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<u8> {
        loop {
            let packet_secs = self.streaming.map(|number| number as f64 * self.interval_secs());
            let incident_secs = self.settings.incidents.first().map(|incident| incident.at_secs);
            let next_secs =
                packet_secs.into_iter().chain(incident_secs).fold(f64::INFINITY, f64::min);
            if next_secs > secs {
                break;
            }
            self.now_secs = self.now_secs.max(next_secs);
            if incident_secs == Some(next_secs) {
                let incident = self.settings.incidents.remove(0);
                self.suffer(incident.fault);
            } else {
                self.packet(wearer);
            }
        }
        self.now_secs = self.now_secs.max(secs);
        self.sent.drain(..).collect()
    }

    fn suffer(&mut self, fault: ShimmerFault) {
        match fault {
            ShimmerFault::LostByte(_) | ShimmerFault::CorruptByte(_) => self.to_spoil = Some(fault),
            ShimmerFault::LostPackets(count) => self.to_lose += count,
            ShimmerFault::Status => self.send(&[0x8a, 0x71, self.status()]),
            ShimmerFault::Stall => self.stalled = true,
        }
    }

    fn packet(&mut self, wearer: &mut dyn Wearer) {
        let Some(number) = self.streaming else { return };
        self.streaming = Some(number + 1);
        if self.stalled {
            return;
        }
        if self.to_lose > 0 {
            self.to_lose -= 1;
            return;
        }
        let ticks = u64::from(self.settings.first_ticks) + number * u64::from(self.interval_ticks);
        let [low, middle, high, ..] = ticks.to_le_bytes();
        let mut packet = vec![0, low, middle, high];
        for channel in self.channels() {
            let value = match channel {
                0x03 => 2862,
                0x12 => (wearer.light(self.now_secs).clamp(0.0, 1.0) * 4095.0).round() as u16,
                _ => {
                    let us = wearer.conductance_us(self.now_secs);
                    self.amplifier.value(us, self.gsr_range, ticks)
                }
            };
            packet.extend(value.to_le_bytes());
        }
        let before = self.sent.len();
        self.send(&packet);
        match self.to_spoil.take() {
            Some(ShimmerFault::LostByte(at)) => {
                self.sent.remove(before + at);
            }
            Some(ShimmerFault::CorruptByte(at)) => {
                if let Some(byte) = self.sent.get_mut(before + at) {
                    *byte ^= 0x20;
                }
            }
            _ => {}
        }
    }
}

/// The number of bytes that follow a command.
const fn arguments(code: u8) -> usize {
    match code {
        0x05 => 2,
        0x08 => 3,
        0x21 | 0x5e | 0x8b | 0xa3 => 1,
        _ => 0,
    }
}

/// Computes the CRC-16 with polynomial 0x1021, bit by bit; it starts from 0xB0CA, and an odd message ends with a zero.
fn checksum(bytes: &[u8]) -> u16 {
    let padding = if bytes.len().is_multiple_of(2) { None } else { Some(&0) };
    bytes.iter().chain(padding).fold(0xb0ca, |sum: u16, byte| {
        (0..8).fold(sum ^ u16::from(*byte) << 8, |sum, _| {
            if sum & 0x8000 == 0 { sum << 1 } else { sum << 1 ^ 0x1021 }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_firmwares() {
        let bytes: Vec<u8> = (1..=11).collect();
        let sums = [8, 9, 10, 11].map(|length| checksum(&bytes[..length]));
        assert_eq!(sums, [0x48aa, 0x2a5d, 0x8b17, 0x794e]);
    }
}
