//! The clocks of the computers whose streams were heard.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Stream;
use teampulse_ros::buses::Buses;
use teampulse_timefilter::clock::ClockKind;

/// An offset of more than this is worth a warning [s].
const WARNED_SECS: f64 = 0.050;
/// Half the width of an interval that holds the truth with a probability of 95 %, in sigmas.
const SIGMAS_95: f64 = 1.96;

/// One line for each computer that stamps any of these streams.
pub fn lines(buses: &Buses, heard: &[(Arc<Stream>, StreamStatus)]) -> Vec<String> {
    let stamping = stamping(buses);
    let mut clocks = BTreeMap::<&str, &StreamStatus>::new();
    for (stream, status) in heard {
        let Some(computer) = stamping.get(&stream.name) else { continue };
        if !status.offset_secs.is_nan() {
            let known = clocks.entry(computer).or_insert(status);
            if is_probed(status) {
                *known = status;
            }
        }
    }
    clocks.into_iter().map(|(computer, status)| line(computer, status)).collect()
}

/// By topic, the computer that publishes it; the first where several do.
fn stamping(buses: &Buses) -> BTreeMap<String, String> {
    let mut stamping = BTreeMap::new();
    for bus in buses.joined() {
        let graph = Arc::clone(&bus.graph().borrow());
        for endpoint in graph.endpoints.iter().filter(|each| !each.own) {
            let computer = || graph.computer(endpoint.gid);
            if graph.publishers(&endpoint.topic).any(|each| each.gid == endpoint.gid) {
                stamping.entry(endpoint.topic.clone()).or_insert_with(computer);
            }
        }
    }
    stamping
}

fn is_probed(status: &StreamStatus) -> bool {
    status.clock == ClockKind::TwoWay as u8
}

fn line(computer: &str, status: &StreamStatus) -> String {
    let off = status.offset_secs.abs() > WARNED_SECS;
    let uncertainty_ms = status.sigma_secs * SIGMAS_95 * 1e3;
    let word = if off { "off  " } else { "ok   " };
    let how = if is_probed(status) { "by probes" } else { "by its stamps" };
    let remedy = if off { ": its stamps are corrected; better start chrony on it" } else { "" };
    let ahead_ms = status.offset_secs * 1e3;
    format!("clock    {word} {computer}  {ahead_ms:+.1} ms ± {uncertainty_ms:.1} ms {how}{remedy}")
}

#[cfg(test)]
mod tests {
    use teampulse_core::status::State;

    use super::*;

    #[test]
    fn a_computer_that_is_more_than_50_ms_off_is_warned_of() {
        let status = |offset_secs, clock| StreamStatus {
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
            clock,
            epoch: 0,
            offset_secs,
            skew_ppm: 0.0,
            jitter_secs: 0.0,
            sigma_secs: 0.001 / SIGMAS_95,
            latency_secs: 0.0,
        };
        let near = line("laptop2", &status(-0.004, ClockKind::Remote as u8));
        assert_eq!(near, "clock    ok    laptop2  -4.0 ms ± 1.0 ms by its stamps");
        let off = line("laptop2", &status(1.5, ClockKind::TwoWay as u8));
        assert!(
            off.starts_with("clock    off   laptop2  +1500.0 ms ± 1.0 ms by probes: "),
            "{off}"
        );
    }
}
