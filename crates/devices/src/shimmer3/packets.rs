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
    /// The length of the channels in a packet; `None` if one of them is unknown.
    length: Option<usize>,
    interval_ticks: i64,
    clock: Clock,
    next_index: u64,
    lost_link: bool,
}

/// Adjacent channels of one stream.
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

    /// The length of a packet from `00` to the last channel.
    pub fn packet_length(&self) -> Option<usize> {
        self.length.map(|length| 4 + length)
    }

    pub fn lose_link(&mut self, out: &mut Outbox<Vec<u8>>) {
        if self.next_index > 0 {
            self.lost_link = true;
            for group in &self.groups {
                for stream in [Some(group.stream), group.raw_stream()].into_iter().flatten() {
                    out.event(Event::Gap { stream, samples: None });
                }
            }
        }
    }

    /// Sets the channels that the inquiry listed.
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
        self.groups.iter().flat_map(Group::descriptions).collect()
    }

    pub fn receive(&mut self, ticks: u32, bytes: &[u8], now: Duration, out: &mut Outbox<Vec<u8>>) {
        let (count, step) = self.clock.count(ticks, now);
        let steps = step.map_or(1, |step| (step + self.interval_ticks / 2) / self.interval_ticks);
        let lost = (steps - 1).max(0) as u64;
        let lost = if std::mem::take(&mut self.lost_link) { 0 } else { lost };
        let index = self.next_index.saturating_add(lost);
        self.next_index = index.saturating_add(1);
        let mut rest = bytes;
        let device_time_ns = Some(nanos(count));
        let period_ns = Some(self.interval_ticks as f64 * 1e9 / f64::from(super::TICKS_HZ));
        for group in &self.groups {
            let raw = group.raw(&mut rest);
            let mut reading = |stream, values| {
                if lost > 0 {
                    out.event(Event::Gap { stream, samples: Some(lost) });
                }
                out.reading(Reading { stream, index, device_time_ns, period_ns, values });
            };
            match (group.converted(&raw, self.gsr_range), group.raw_stream()) {
                (Some(converted), Some(raw_stream)) => {
                    reading(group.stream, converted);
                    reading(raw_stream, raw);
                }
                _ => reading(group.stream, raw),
            }
        }
    }
}

impl Group {
    fn is_gsr(&self) -> bool {
        self.stream == "eda"
    }

    /// Returns the name of the stream of raw values, if the computed values have a separate stream.
    fn raw_stream(&self) -> Option<&'static str> {
        match self.stream {
            "eda" => Some("eda_raw"),
            _ if self.calibration.is_none() || self.channels.len() != 3 => None,
            "acceleration_low_noise" => Some("acceleration_low_noise_raw"),
            "acceleration_wide_range" => Some("acceleration_wide_range_raw"),
            "gyroscope" => Some("gyroscope_raw"),
            "magnetometer" => Some("magnetometer_raw"),
            _ => None,
        }
    }

    /// Returns the descriptions of the streams, each with one quantity: computed values, and the raw ones.
    fn descriptions(&self) -> Vec<Stream> {
        let of = |name, channels| Stream { has_clock: true, ..Stream::irregular(name, channels) };
        let raw = |channel: &PacketChannel| {
            Channel::new(channel.name, channel.unit).scaled(channel.scale)
        };
        let raw: Vec<Channel> = self.channels.iter().map(raw).collect();
        let Some(raw_stream) = self.raw_stream() else { return vec![of(self.stream, raw)] };
        let axes = |unit| ["x", "y", "z"].map(|axis| Channel::new(axis, unit)).to_vec();
        let converted = match self.stream {
            "eda" => vec![Channel::new("conductance", "uS")],
            "gyroscope" => axes("deg/s"),
            "magnetometer" => axes(""),
            _ => axes("m/s^2"),
        };
        vec![of(self.stream, converted), of(raw_stream, raw)]
    }

    fn raw(&self, bytes: &mut &[u8]) -> Vec<f64> {
        let value = |channel: &PacketChannel| {
            let (field, rest) = bytes.split_at_checked(channel.bytes).unwrap_or_default();
            *bytes = rest;
            channel.decode(field)
        };
        self.channels.iter().map(value).collect()
    }

    /// Returns the values computed from raw ones; `None` if there are none.
    fn converted(&self, raw: &[f64], gsr_range: GsrRange) -> Option<Vec<f64>> {
        match (&self.calibration, raw) {
            (_, [raw]) if self.is_gsr() => {
                Some(vec![Gsr { raw: *raw as u16 }.conductance_us(gsr_range)])
            }
            (Some(calibration), [x, y, z]) => Some(calibration.apply([*x, *y, *z]).to_vec()),
            _ => None,
        }
    }
}
