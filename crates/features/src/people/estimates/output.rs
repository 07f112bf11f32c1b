//! The streams of estimates.

use std::collections::BTreeSet;

use teampulse_core::reports::SCALE;
use teampulse_core::stream::{Shape, Signal, Stream, Subject, Window};

use super::FAMILY;
use super::physiology::LEAST_SIGMA;

/// Estimates about a person over windows or phases, from these inputs.
pub(super) fn estimates(
    person: &Subject,
    window: Window,
    inputs: &BTreeSet<String>,
    doubled_secs: f64,
) -> Stream {
    let id = &person.id;
    let name = format!("/humans/persons/{id}/{FAMILY}");
    let stream = Stream::concluded(name, person.clone(), FAMILY, Shape::Feature).over(window);
    Stream {
        inputs: inputs.iter().cloned().collect(),
        rate_hz: if window == Window::Phases { 0.0 } else { 1.0 },
        method: format!(
            "estimates on [0..1], 0 as in the baseline or below; workload_physiology: mean of s = z/(|z| + 3) \
             of heart rate, -ln RMSSD and breathing rate, z the robust z; arousal: the same of skin level and \
             response rate; their sigmas are {LEAST_SIGMA} (72 % of three classes right, the best published \
             within people; across people, 46 %, it would be 0.7), the spread of the measures, and what the \
             baseline leaves unsure; workload_report: (ISA - 1)/4 of the newest report about the phase, sigma \
             {LEAST_SIGMA}, its variance doubled after {doubled_secs} s and over the share of the window in \
             the phase; workload: both by inverse variance, less sure where they contradict each other"
        ),
        doc: format!(
            "An estimate of the workload and the arousal of {id}, not a measurement: treat it \
             with caution. An experimenter who sees it is no longer blind."
        ),
        ..stream.with_channels(&[
            ("workload", "1"),
            ("workload_physiology", "1"),
            ("workload_report", "1"),
            ("arousal", "1"),
        ])
    }
}

/// The stream of faults about unusable reports: of a person, or of the session where the person is
/// unknown.
pub(super) fn faults(subject: &Subject, input: &str) -> Stream {
    let id = &subject.id;
    let (name, method, whom) = if id.is_empty() {
        let method = "the first report labelled isa that is about an unknown person";
        ("/session/reports/faults".to_owned(), method, "nobody known")
    } else {
        let method = "the first report labelled isa that is not from 1 to 5";
        (format!("/humans/persons/{id}/reports/faults"), method, id.as_str())
    };
    Stream {
        signal: Signal::Event,
        inputs: vec![input.to_owned()],
        method: method.to_owned(),
        doc: format!("Self-reports of {whom} that are not used."),
        ..Stream::concluded(name, subject.clone(), "reports", Shape::Event)
    }
}

/// The fault about a report that is not on its scale.
pub(super) fn off_scale(value: f64) -> String {
    let text =
        if value.is_nan() { "ISA that is not a number".to_owned() } else { format!("ISA {value}") };
    let (least, most) = (SCALE.start(), SCALE.end());
    format!(
        "{text} is not used: report the workload as a value from {least} (idle) to {most} (too much)"
    )
}

/// The fault about a report that names an unknown person, or nobody, while `count` people are known. It does not name
/// them, as streams about the session may be published.
pub(super) fn about_nobody(named: &str, count: usize) -> String {
    let text = match (named, count) {
        ("", 0) => "ISA without a name is not used, as nobody is known yet".to_owned(),
        ("", _) => format!("ISA without a name is not used, as there are {count} people"),
        _ => format!("ISA of {named} is not used, as nobody of that name is known"),
    };
    format!("{text}: label it isa and the id of a person, as in the streams' names")
}
