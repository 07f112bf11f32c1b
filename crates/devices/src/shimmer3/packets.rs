use std::time::Duration;

use super::calibration::Calibration;
use super::channels::PacketChannel;
use super::clock::{Clock, nanos};
use super::gsr::{Gsr, GsrRange};
use crate::outbox::Outbox;
use crate::{Channel, Event, Reading, Stream};

/// Turns packets into readings.
#[derive(Debug)]
pub(super) struct Packets {
    gsr_range: GsrRange,
    groups: Vec<Group>,
    /// Of the channels; `None` while one of them is unknown.
    length: Option<usize>,
    interval_ticks: i64,
    clock: Clock,
    next_index: u64,
    lost_link: bool,
}

/// Channels of one stream, which lie side by side.
#[derive(Debug)]
struct Group {
    stream: &'static str,
    channels: Vec<PacketChannel>,
    calibration: Option<Calibration>,
}

impl Packets {
    pub fn new(gsr_range: GsrRange) -> Self {
        Self {
            gsr_range,
            groups: Vec::new(),
            length: None,
            interval_ticks: 1,
            clock: Clock::default(),
            next_index: 0,
            lost_link: false,
        }
    }

    /// From `00` to the last channel.
    pub fn packet_length(&self) -> Option<usize> {
        self.length.map(|length| 4 + length)
    }

    pub fn lose_link(&mut self, out: &mut Outbox<Vec<u8>>) {
        if self.next_index > 0 {
            self.lost_link = true;
            for group in &self.groups {
                out.event(Event::Gap { stream: group.stream, samples: None });
            }
        }
    }

    /// Takes over what the inquiry listed.
    pub fn describe(
        &mut self,
        ids: &[u8],
        calibrations: &[(&'static str, Option<Calibration>)],
        interval_ticks: i64,
    ) -> Vec<Stream> {
        self.interval_ticks = interval_ticks;
        self.groups.clear();
        let channels: Option<Vec<PacketChannel>> =
            ids.iter().map(|id| PacketChannel::of(*id)).collect();
        self.length = channels.as_ref().map(|all| all.iter().map(|channel| channel.bytes).sum());
        for channel in channels.unwrap_or_default() {
            match self.groups.last_mut() {
                Some(group) if group.stream == channel.stream => group.channels.push(channel),
                _ => {
                    let stream = channel.stream;
                    let known = calibrations.iter().find(|(of, _)| *of == stream);
                    let calibration = known.and_then(|(_, calibration)| *calibration);
                    self.groups.push(Group { stream, channels: vec![channel], calibration });
                }
            }
        }
        self.groups.iter().map(Group::description).collect()
    }

    pub fn receive(&mut self, ticks: u32, bytes: &[u8], now: Duration, out: &mut Outbox<Vec<u8>>) {
        let (count, step) = self.clock.count(ticks, now);
        let steps = step.map_or(1, |step| (step + self.interval_ticks / 2) / self.interval_ticks);
        let lost = (steps - 1).max(0) as u64;
        let lost = if std::mem::take(&mut self.lost_link) { 0 } else { lost };
        let index = self.next_index.saturating_add(lost);
        self.next_index = index.saturating_add(1);
        let mut rest = bytes;
        for group in &self.groups {
            let stream = group.stream;
            if lost > 0 {
                out.event(Event::Gap { stream, samples: Some(lost) });
            }
            let values = group.values(&mut rest, self.gsr_range);
            let device_time_ns = Some(nanos(count));
            let period_ns = Some(self.interval_ticks as f64 * 1e9 / f64::from(super::TICKS_HZ));
            out.reading(Reading { stream, index, device_time_ns, period_ns, values });
        }
    }
}

impl Group {
    fn is_gsr(&self) -> bool {
        self.stream == "eda"
    }

    /// Raw values; what is no multiple of them stands behind them.
    fn description(&self) -> Stream {
        let raw = |channel: &PacketChannel| {
            Channel::new(channel.name, channel.unit).scaled(channel.scale)
        };
        let mut channels: Vec<Channel> = self.channels.iter().map(raw).collect();
        if self.is_gsr() {
            channels.push(Channel::new("resistance", "kOhm"));
            channels.push(Channel::new("conductance", "uS"));
        } else if self.calibration.is_some() && self.channels.len() == 3 {
            let unit = match self.stream {
                "gyroscope" => "deg/s",
                "magnetometer" => "",
                _ => "m/s^2",
            };
            channels.extend(
                ["calibrated_x", "calibrated_y", "calibrated_z"].map(|x| Channel::new(x, unit)),
            );
        }
        Stream { has_clock: true, ..Stream::irregular(self.stream, channels) }
    }

    fn values(&self, bytes: &mut &[u8], gsr_range: GsrRange) -> Vec<f64> {
        let mut values = Vec::with_capacity(6);
        for channel in &self.channels {
            let (field, rest) = bytes.split_at_checked(channel.bytes).unwrap_or_default();
            *bytes = rest;
            values.push(channel.decode(field));
        }
        match (&self.calibration, values.as_slice()) {
            (_, [raw]) if self.is_gsr() => {
                let gsr = Gsr { raw: *raw as u16 };
                let converted = [gsr.resistance_kohm(gsr_range), gsr.conductance_us(gsr_range)];
                values.extend(converted);
            }
            (Some(calibration), [x, y, z]) => {
                let calibrated = calibration.apply([*x, *y, *z]);
                values.extend(calibrated);
            }
            _ => {}
        }
        values
    }
}
