//! Conformity of a robot with the profile.

use std::collections::BTreeMap;

use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Stream;

use super::{Norm, PROFILE};

/// A robot with its findings.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// The robot's id.
    pub id: String,
    /// The finding for each norm of the profile, in order.
    pub findings: Vec<(&'static Norm, Finding)>,
}

/// Whether a robot meets a norm.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The parameter is offered at this rate [Hz].
    Met(f64),
    /// The parameter is offered at too low a rate [Hz].
    Slow(f64),
    /// The parameter is not offered.
    Absent,
}

impl Robot {
    /// Whether all essential norms are met.
    pub fn conforms(&self) -> bool {
        let met = |(norm, finding): &(&Norm, Finding)| {
            !norm.essential || matches!(finding, Finding::Met(_))
        };
        self.findings.iter().all(met)
    }

    /// Whether a parameter is advertised but no message was received.
    pub fn is_silent(&self, parameter: &str) -> bool {
        let silent = |(norm, finding): &(&Norm, Finding)| {
            norm.parameter == parameter && matches!(finding, Finding::Slow(hz) if *hz <= 0.0)
        };
        self.findings.iter().any(silent)
    }
}

/// Checks every robot among the streams against the profile.
pub fn conformity<'a>(
    streams: impl IntoIterator<Item = (&'a Stream, &'a StreamStatus)>,
) -> Vec<Robot> {
    let mut robots: BTreeMap<&str, Vec<(&Stream, &StreamStatus)>> = BTreeMap::new();
    for (stream, status) in streams {
        robots.entry(&stream.id).or_default().push((stream, status));
    }
    let judged = |(id, streams): (&str, Vec<(&Stream, &StreamStatus)>)| Robot {
        id: id.to_owned(),
        findings: PROFILE.iter().map(|norm| (norm, find(norm, &streams))).collect(),
    };
    robots.into_iter().map(judged).collect()
}

fn find(norm: &Norm, streams: &[(&Stream, &StreamStatus)]) -> Finding {
    let of_signal = streams.iter().filter(|(stream, _)| stream.signal == norm.signal);
    let fastest = of_signal.map(|(_, status)| status.rate_hz).max_by(f64::total_cmp);
    match fastest {
        None => Finding::Absent,
        Some(rate_hz) if rate_hz < norm.least_hz => Finding::Slow(rate_hz),
        Some(rate_hz) => Finding::Met(rate_hz),
    }
}
