//! The streams of states.

use teampulse_core::phases::Phase;
use teampulse_core::stream::{Channel, Shape, Stream, Subject, Window};
use teampulse_signal::statistics::Comparison;

use super::FAMILY;
use super::baseline::Baseline;
use super::measures::{MEASURES, Measure};

/// How the values are computed, for every method.
const FORMULA: &str = "difference from the mean of the baseline's windows, z in their SD (n - 1), \
     robust_z from their median in 1.4826 MAD; sigmas are those of the baseline's mean, SD, median and \
     MAD, with overlapping windows worth n (1 - r)/(1 + r), r their correlation at lag 1, and at most those \
     that fit side by side";
const FORMULA_OF_PHASES: &str = "difference from the value of the baseline as one phase, z in the SD \
     (n - 1) of its windows, robust_z in their 1.4826 MAD; sigmas of both values and of SD and MAD, with \
     overlapping windows worth n (1 - r)/(1 + r), r their correlation at lag 1, and at most those that fit \
     side by side";

/// The state of a person in windows of a length [s].
pub(super) fn windows<'a>(
    person: &Subject,
    length_secs: f64,
    inputs: impl Iterator<Item = &'a str>,
    method: String,
) -> Stream {
    let doc = format!("The difference of {} from their own baseline, every second.", person.id);
    Stream { rate_hz: 1.0, ..state(person, Window::of_secs(length_secs), inputs, method, doc) }
}

/// The state of a person over whole phases.
pub(super) fn phases<'a>(
    person: &Subject,
    inputs: impl Iterator<Item = &'a str>,
    method: String,
) -> Stream {
    let doc = format!("The difference of {} from their own baseline in each phase.", person.id);
    state(person, Window::Phases, inputs, method, doc)
}

fn state<'a>(
    person: &Subject,
    window: Window,
    inputs: impl Iterator<Item = &'a str>,
    method: String,
    doc: String,
) -> Stream {
    let name = format!("/humans/persons/{}/{FAMILY}", person.id);
    let all = MEASURES.iter().flat_map(|measure| Comparison::ALL.map(|each| (measure, each)));
    let channels = all.map(|(measure, comparison)| {
        let unit = if comparison == Comparison::Difference { measure.unit } else { "1" };
        Channel::new(comparison.of(measure.name), unit)
    });
    let mut inputs: Vec<String> = inputs.map(str::to_owned).collect();
    inputs.sort_unstable();
    inputs.dedup();
    Stream {
        channels: channels.collect(),
        inputs,
        method,
        doc,
        ..Stream::concluded(name, person.clone(), FAMILY, Shape::Feature).over(window)
    }
}

/// The method of the state in windows of a length [s].
pub(super) fn method(
    length_secs: f64,
    phase: &Phase,
    recipes: impl Iterator<Item = String>,
) -> String {
    let recipes: Vec<String> = recipes.collect();
    format!(
        "windows of {length_secs} s against those that lie in the phase {} that began at {}: {FORMULA}; {}",
        phase.label,
        phase.begin,
        recipes.join("; ")
    )
}

/// The method of the state over phases, by the windows of a length [s].
pub(super) fn method_of_phases(
    length_secs: f64,
    phase: &Phase,
    recipes: impl Iterator<Item = String>,
) -> String {
    let recipes: Vec<String> = recipes.collect();
    format!(
        "phases against the phase {} that began at {}, by the spread of its windows of {length_secs} s: \
         {FORMULA_OF_PHASES}; {}",
        phase.label,
        phase.begin,
        recipes.join("; ")
    )
}

/// The input of a measure, and its value in the baseline.
pub(super) fn recipe(measure: &Measure, stream: &str, baseline: &Baseline) -> String {
    let Baseline { mean, sd, median, deviation, count, worth, known_secs, .. } = baseline;
    let needed_secs = baseline.needed_secs();
    let is_brief = baseline.is_brief();
    let brief = if is_brief {
        format!(", too short for z: {known_secs:.0} s, needs {needed_secs:.0} s")
    } else {
        String::new()
    };
    format!(
        "{}: {} of {stream}, in the baseline mean {mean:.4} SD {sd:.4} median {median:.4} 1.4826 MAD \
         {deviation:.4} {} in {count} windows worth {worth:.1}{brief}",
        measure.name, measure.value, measure.unit
    )
}
