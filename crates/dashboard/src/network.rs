//! The computers whose clocks stamp streams, and the buses that carry the streams.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use teampulse_core::computers::ClockReport;
use teampulse_core::status::StreamStatus;

use crate::context::BusView;
use crate::wire::{Bus, Computer, known};

/// The maximum number of computers, and of streams, that are followed; any others are ignored.
const MOST: usize = 1000;
/// How long a probe counts for the shortest round trip [s].
const PROBES_SECS: f64 = 60.0;

/// What is known about other computers and the buses.
#[derive(Debug, Default)]
pub struct Network {
    /// The computer that stamps each stream, by topic.
    stamped_by: BTreeMap<String, String>,
    /// The probes of the last minute, by computer: the time [s] and the round trip [s].
    probes: BTreeMap<String, VecDeque<(f64, f64)>>,
    /// The bus that carries each stream, by topic.
    carried_by: BTreeMap<String, String>,
}

impl Network {
    /// Takes a report on a clock, at a time [s].
    pub fn take(&mut self, t: f64, report: ClockReport) {
        match report {
            ClockReport::StampedBy { stream, computer } => {
                if self.stamped_by.len() < MOST || self.stamped_by.contains_key(&stream) {
                    self.stamped_by.insert(stream, computer);
                }
            }
            ClockReport::Probed { computer, round_trip_secs, .. } => {
                if self.probes.len() < MOST || self.probes.contains_key(&computer) {
                    let probes = self.probes.entry(computer).or_default();
                    probes.push_back((t, round_trip_secs));
                    while probes.front().is_some_and(|(earlier, _)| t - earlier > PROBES_SECS) {
                        probes.pop_front();
                    }
                }
            }
        }
    }

    /// The computers at a time [s], sorted by name.
    pub fn computers<'a>(
        &self,
        now: f64,
        statuses: impl Iterator<Item = &'a StreamStatus>,
    ) -> Vec<Computer> {
        let named: BTreeSet<&String> = self.stamped_by.values().chain(self.probes.keys()).collect();
        let mut computers: BTreeMap<&str, Computer> =
            named.into_iter().map(|name| (name.as_str(), self.computer(name, now))).collect();
        for status in statuses {
            let by = self.stamped_by.get(status.topic());
            let Some(computer) = by.and_then(|by| computers.get_mut(by.as_str())) else { continue };
            computer.streams += 1;
            describe(computer, status);
        }
        computers.into_values().collect()
    }

    fn computer(&self, name: &str, now: f64) -> Computer {
        let probes = self.probes.get(name);
        let trips = probes.into_iter().flatten().map(|(_, trip)| *trip);
        Computer {
            name: name.to_owned(),
            known_by: "unknown",
            offset_secs: None,
            skew_ppm: None,
            uncertainty_secs: None,
            round_trip_secs: trips.reduce(f64::min),
            probe_age_secs: probes.and_then(VecDeque::back).map(|(t, _)| (now - t).max(0.0)),
            streams: 0,
        }
    }

    /// The buses, each with its traffic.
    pub fn buses<'a>(
        &mut self,
        views: &[BusView],
        statuses: impl Iterator<Item = &'a StreamStatus>,
    ) -> Vec<Bus> {
        let bus = |view: &BusView| Bus {
            name: view.name.clone(),
            node: view.node.clone(),
            participants: view.participants,
            topics: view.topics.len() as u32,
            streams: 0,
            rate_hz: 0.0,
            lost: None,
            uncounted: 0,
        };
        let mut buses: Vec<Bus> = views.iter().map(bus).collect();
        for status in statuses {
            let topic = status.topic();
            // A stream stays with its bus when its publisher is gone, so that its losses are still counted.
            if !self.carried_by.contains_key(topic) && self.carried_by.len() < MOST {
                let Some(view) = views.iter().find(|view| view.topics.contains(topic)) else {
                    continue;
                };
                self.carried_by.insert(topic.to_owned(), view.name.clone());
            }
            let by = self.carried_by.get(topic);
            let Some(bus) = buses.iter_mut().find(|bus| by == Some(&bus.name)) else { continue };
            bus.streams += 1;
            bus.rate_hz += known(status.rate_hz).unwrap_or(0.0);
            match status.lost_source {
                Some(lost) => bus.lost = Some(bus.lost.unwrap_or(0).saturating_add(lost)),
                None => bus.uncounted += 1,
            }
        }
        buses
    }
}

/// Adds what a stream's status states about the clock that stamps it. If there are several, the status with the
/// smallest uncertainty counts.
fn describe(computer: &mut Computer, status: &StreamStatus) {
    let known_by = match status.clock {
        2 => "probes",
        4 => "stamps",
        _ => return,
    };
    let Some(offset_secs) = known(status.offset_secs) else { return };
    let uncertainty_secs = known(status.uncertainty_secs());
    let is_better = match (computer.uncertainty_secs, uncertainty_secs) {
        (_, None) => computer.offset_secs.is_none(),
        (None, Some(_)) => true,
        (Some(before), Some(now)) => now < before,
    };
    if is_better {
        computer.known_by = known_by;
        computer.offset_secs = Some(offset_secs);
        computer.skew_ppm = known(status.skew_ppm);
        computer.uncertainty_secs = uncertainty_secs;
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::status::State;

    use super::*;

    fn status(name: &str, clock: u8, offset_secs: f64, sigma_secs: f64) -> StreamStatus {
        StreamStatus {
            name: name.into(),
            state: State::Ok,
            reason: String::new(),
            rate_hz: 20.0,
            age_secs: 0.1,
            received: 5,
            lost_source: Some(3),
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock,
            epoch: 0,
            offset_secs,
            skew_ppm: 4.0,
            jitter_secs: f64::NAN,
            sigma_secs,
            latency_secs: f64::NAN,
        }
    }

    fn stamped(stream: &str, computer: &str) -> ClockReport {
        ClockReport::StampedBy { stream: stream.into(), computer: computer.into() }
    }

    fn probed(computer: &str, round_trip_secs: f64) -> ClockReport {
        ClockReport::Probed { computer: computer.into(), offset_secs: 1.0, round_trip_secs }
    }

    #[test]
    fn a_clock_is_as_its_most_certain_stream_states_it_and_says_how_it_is_known() {
        let mut network = Network::default();
        for (t, trip) in [(0.0, 0.001), (100.0, 0.004), (101.0, 0.003)] {
            network.take(t, probed("laptop", trip));
        }
        network.take(0.0, stamped("/a", "laptop"));
        network.take(0.0, stamped("/b", "laptop"));
        network.take(0.0, stamped("/c", "robot1"));
        network.take(0.0, stamped("/d", "robot2"));
        let statuses = [
            status("/a", 2, 0.063, 0.02),
            status("/b", 2, 0.062, 0.001),
            status("/c", 4, -0.5, 0.1),
            status("/d", 4, f64::NAN, f64::NAN),
        ];
        let [laptop, robot1, robot2] = &network.computers(102.0, statuses.iter())[..] else {
            panic!("three computers")
        };
        assert_eq!(
            (laptop.known_by, laptop.offset_secs, laptop.streams),
            ("probes", Some(0.062), 2)
        );
        assert_eq!((laptop.round_trip_secs, laptop.probe_age_secs), (Some(0.003), Some(1.0)));
        assert_eq!((robot1.known_by, robot1.offset_secs), ("stamps", Some(-0.5)));
        assert_eq!((robot2.known_by, robot2.offset_secs, robot2.streams), ("unknown", None, 1));
    }

    #[test]
    fn a_stream_counts_for_the_bus_on_which_it_first_came() {
        let view = |name: &str, topics: &[&str]| BusView {
            name: name.into(),
            node: "/teampulse".into(),
            participants: 2,
            topics: topics.iter().map(|topic| (*topic).into()).collect(),
        };
        let unnumbered = StreamStatus { lost_source: None, ..status("/b", 4, 0.0, 0.1) };
        let statuses = [status("/a", 4, 0.0, 0.1), unnumbered, status("/strap/ecg", 1, 0.0, 0.1)];
        let mut network = Network::default();
        let views = [view("ROS domain 0", &["/a", "/b"]), view("ROS domain 7", &["/a"])];
        let buses = network.buses(&views, statuses.iter());
        assert_eq!((buses[0].streams, buses[0].lost, buses[0].uncounted), (2, Some(3), 1));
        assert_eq!((buses[1].streams, buses[1].lost), (0, None));
        let gone = [view("ROS domain 0", &[]), view("ROS domain 7", &["/a"])];
        let buses = network.buses(&gone, statuses.iter());
        assert_eq!((buses[0].streams, buses[1].streams), (2, 0));
    }
}
