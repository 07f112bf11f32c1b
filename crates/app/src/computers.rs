//! Clocks of the computers that publish the received streams.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::computers::{SIMULATED, is_simulated};
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Stream;
use teampulse_ros::buses::Buses;
use teampulse_ros::graph::EndpointKind;
use teampulse_timefilter::clock::ClockKind;

/// An offset above this is reported as a warning [s].
const WARNED_SECS: f64 = 0.050;

/// Formats one line for each computer that stamps any of these streams.
pub fn lines(buses: &Buses, heard: &[(Arc<Stream>, StreamStatus)]) -> Vec<String> {
    let stamping = stamping(buses);
    let mut clocks = BTreeMap::<&str, &StreamStatus>::new();
    for (stream, status) in heard {
        let Some(computer) = stamping.get(&stream.name) else { continue };
        // In simulated time, the clocks of computers are not used.
        if status.clock != ClockKind::Host as u8 {
            let known = clocks.entry(computer).or_insert(status);
            if is_probed(status) || known.offset_secs.is_nan() {
                *known = status;
            }
        }
    }
    clocks.into_iter().map(|(computer, status)| line(computer, status)).collect()
}

/// Returns the computer that publishes each topic; the first one if several do.
fn stamping(buses: &Buses) -> BTreeMap<String, String> {
    let mut stamping = BTreeMap::new();
    for bus in buses.joined() {
        let graph = Arc::clone(&bus.graph().borrow());
        let others = graph.endpoints().filter(|each| !each.own);
        for endpoint in others.filter(|each| each.kind == EndpointKind::Publisher) {
            let computer = || graph.computer(endpoint.gid);
            stamping.entry(endpoint.topic.clone()).or_insert_with(computer);
        }
    }
    stamping
}

fn is_probed(status: &StreamStatus) -> bool {
    status.clock == ClockKind::TwoWay as u8
}

fn line(computer: &str, status: &StreamStatus) -> String {
    let kind = if is_probed(status) { ClockKind::TwoWay } else { ClockKind::Remote };
    if status.offset_secs.is_nan() {
        return format!(
            "clock    ?     {computer}  unknown: its stamps are not corrected; run teampulse there to measure the clock"
        );
    }
    if is_simulated(status.offset_secs, kind) {
        return format!("clock    off   {computer}  {SIMULATED}");
    }
    let off = status.offset_secs.abs() > WARNED_SECS;
    let word = if off { "off  " } else { "ok   " };
    let how = if is_probed(status) { "by probes" } else { "by its stamps" };
    let remedy = if off { remedy(status) } else { String::new() };
    let sign = if status.offset_secs < 0.0 { '-' } else { '+' };
    let offset = sized(status.offset_secs.abs());
    let uncertainty = sized(status.uncertainty_secs());
    format!("clock    {word} {computer}  {sign}{offset} ± {uncertainty} {how}{remedy}")
}

/// Describes how to correct the clock of a computer. Stamps alone can't distinguish a clock that is behind from
/// messages that are sent late.
fn remedy(status: &StreamStatus) -> String {
    if is_probed(status) {
        return ": its stamps are corrected; synchronise its clock (chrony)".into();
    }
    let away = sized(status.offset_secs.abs());
    if status.offset_secs > 0.0 {
        return format!(
            ": its stamps lie {away} after their arrival, so its clock is ahead; the stamps are corrected; synchronise the clock (chrony)"
        );
    }
    format!(
        ": its stamps lie {away} before their arrival: the stream is slow, or the clock is behind; run teampulse there to measure the clock, or synchronise it"
    )
}

/// Formats the magnitude of a time: in milliseconds below one second, otherwise in seconds.
fn sized(secs: f64) -> String {
    match secs {
        _ if secs.is_nan() => "unknown".into(),
        10.0.. => format!("{secs:.1} s"),
        0.9995.. => format!("{secs:.3} s"),
        _ => format!("{:.1} ms", secs * 1e3),
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::status::State;

    use super::*;

    fn status(offset_secs: f64, clock: ClockKind) -> StreamStatus {
        StreamStatus {
            name: "/r1/odom".into(),
            state: State::Ok,
            reason: String::new(),
            rate_hz: 10.0,
            age_secs: 0.0,
            received: 1,
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock: clock as u8,
            epoch: 0,
            offset_secs,
            skew_ppm: 0.0,
            jitter_secs: 0.0,
            sigma_secs: 0.001 / 1.96,
            latency_secs: 0.0,
        }
    }

    #[test]
    fn a_synchronised_computer_is_ok() {
        let near = line("laptop2", &status(-0.004, ClockKind::Remote));
        assert_eq!(near, "clock    ok    laptop2  -4.0 ms ± 1.0 ms by its stamps");
    }

    #[test]
    fn a_computer_that_is_more_than_50_ms_off_is_warned_of() {
        let probed = line("laptop2", &status(1.5, ClockKind::TwoWay));
        assert!(
            probed.starts_with("clock    off   laptop2  +1.500 s ± 1.0 ms by probes: "),
            "{probed}"
        );
        let ahead = line("laptop2", &status(0.3, ClockKind::Remote));
        assert!(ahead.contains("lie 300.0 ms after their arrival, so its clock is ahead"));
    }

    #[test]
    fn an_offset_that_stamps_alone_cannot_give_is_not_reported() {
        let behind = line("camera", &status(-0.201, ClockKind::Remote));
        assert_eq!(
            behind,
            "clock    off   camera  -201.0 ms ± 1.0 ms by its stamps: its stamps lie 201.0 ms \
             before their arrival: the stream is slow, or the clock is behind; run teampulse there to measure the clock, or synchronise it"
        );
    }

    #[test]
    fn an_unknown_clock_is_reported_as_unknown() {
        let nothing = line("laptop2", &status(f64::NAN, ClockKind::Remote));
        assert!(nothing.starts_with("clock    ?     laptop2  unknown: "), "{nothing}");
        let vague = StreamStatus { sigma_secs: f64::NAN, ..status(0.01, ClockKind::Remote) };
        assert_eq!(line("a", &vague), "clock    ok    a  +10.0 ms ± unknown by its stamps");
    }

    #[test]
    fn stamps_of_a_simulation_are_not_a_clock_offset() {
        let shown = line("arena", &status(-1.8e9, ClockKind::Remote));
        assert!(shown.starts_with("clock    off   arena  stamps in simulated time"), "{shown}");
    }

    #[test]
    fn long_times_are_reported_in_seconds() {
        let hour = line("laptop2", &status(-3600.0, ClockKind::Remote));
        assert!(hour.starts_with("clock    off   laptop2  -3600.0 s ± 1.0 ms"), "{hour}");
    }
}
