//! The state of one person over whole phases.

use teampulse_core::data::{Data, FeatureValues, Reason};
use teampulse_core::feature::Outputs;
use teampulse_core::phases::{BASELINE, Phase};
use teampulse_core::stream::{Stream, StreamId, Subject};
use teampulse_core::time::Time;

use super::baseline::{Baseline, Difference};
use super::measures::{COUNT, MEASURES};
use super::output;
use super::track::{Track, WindowValue};
use super::windows::Windows;
use crate::value::window_of;

/// A phase is reported this long after its end, whether or not all streams have reported it [ns].
const PATIENCE_NS: i64 = 12_000_000_000;

/// All streams of one person's phases.
#[derive(Default)]
pub(super) struct Whole {
    tracks: Vec<Track>,
    /// The index of the first phase that is not finished.
    next: usize,
    /// The baseline that phases are compared with.
    against: Option<Against>,
}

/// A baseline as a phase.
struct Against {
    /// The index of the baseline's phase.
    number: usize,
    end: Time,
    length_secs: f64,
    /// The compared measures, each with its baseline and its stream.
    compared: [Option<Compared>; COUNT],
    /// The reason why each other measure lacks windows of the baseline.
    lacks: [Reason; COUNT],
    method: String,
    inputs: Vec<String>,
}

struct Compared {
    baseline: Baseline,
    /// The name of the measure's stream without its window.
    family: String,
    /// The baseline as one phase, as soon as it is needed.
    value: Option<Result<f64, Reason>>,
}

impl Whole {
    /// Adds a stream of phases.
    pub(super) fn join(&mut self, id: StreamId, stream: &Stream) {
        if self.tracks.iter().all(|track| track.id != id) {
            self.tracks.extend(Track::all(id, stream));
        }
    }

    /// Notes that a stream has reported a finished phase.
    pub(super) fn take(&mut self, (id, end): (StreamId, Time), phase: &FeatureValues) {
        for track in self.tracks.iter_mut().filter(|track| track.id == id) {
            track.take(end, phase, None);
        }
    }

    /// Ends a baseline: later phases are compared with it, in the measures that its windows compare.
    pub(super) fn judge(&mut self, (number, phase): (usize, &Phase), windows: &Windows) {
        let Some(end) = phase.end else { return };
        let mut compared = [const { None }; COUNT];
        for (track, baseline) in windows.chosen() {
            let family = track.family.clone();
            compared[track.measure] = Some(Compared { baseline: *baseline, family, value: None });
        }
        let recipes = windows.chosen().map(|(track, baseline)| {
            output::recipe(&MEASURES[track.measure], &track.stream, baseline)
        });
        let method = output::method_of_phases(windows.length_secs(), phase, recipes);
        let inputs = windows.chosen().map(|(track, _)| track.stream.clone()).collect();
        let length_secs = end.secs_since(phase.begin);
        let lacks = std::array::from_fn(|measure| windows.lack(measure));
        self.against = Some(Against { number, end, length_secs, compared, lacks, method, inputs });
    }

    /// Reports the phases that are over at `now`, as soon as all streams have reported them.
    pub(super) fn report(
        &mut self,
        (person, phases_from): (&Subject, &str),
        phases: &[Phase],
        now: Time,
        out: &mut Outputs,
    ) {
        while let Some(phase) = phases.get(self.next) {
            let Some(end) = phase.end.filter(|end| *end <= now) else { return };
            let reference = phases[..self.next].iter().rposition(|each| each.label == BASELINE);
            if phase.label != BASELINE && reference.is_some() {
                let is_judged = self.against.as_ref().map(|against| against.number) == reference;
                let is_late = now.nanos_since(end) >= PATIENCE_NS;
                let is_due = is_late || (is_judged && self.is_complete(end));
                if !is_due {
                    return;
                }
                if is_judged {
                    self.report_phase((person, phases_from), phase, out);
                }
            }
            self.next += 1;
        }
    }

    /// Whether all compared measures have been reported for the phase with this end.
    fn is_complete(&self, end: Time) -> bool {
        let Some(against) = &self.against else { return false };
        let mut compared = against.compared.iter().enumerate();
        compared.all(|(measure, compared)| {
            let track = compared.as_ref().and_then(|each| track(&self.tracks, measure, each));
            track.is_none_or(|track| track.value_at(end).is_some())
        })
    }

    fn report_phase(
        &mut self,
        (person, phases_from): (&Subject, &str),
        phase: &Phase,
        out: &mut Outputs,
    ) {
        let (Some(against), Some(end)) = (&mut self.against, phase.end) else { return };
        let length_secs = end.secs_since(phase.begin);
        let mut found = [const { Err(Reason::Missing) }; COUNT];
        for (measure, found) in found.iter_mut().enumerate() {
            let lack = lack(&self.tracks, measure, against.lacks[measure]);
            let Some(compared) = &mut against.compared[measure] else {
                *found = Err(lack);
                continue;
            };
            let track = track(&self.tracks, measure, compared);
            *found = track.ok_or(lack).and_then(|track| {
                let baseline = *compared.value.get_or_insert_with(|| value_at(track, against.end));
                compared.difference(track, (baseline?, end), length_secs / against.length_secs)
            });
        }
        let used = self.tracks.iter().filter(|track| {
            let compared = against.compared[track.measure].as_ref();
            compared.is_some_and(|compared| compared.is_of(track))
        });
        let inputs = used.map(|track| track.stream.as_str());
        let inputs = inputs.chain(against.inputs.iter().map(String::as_str)).chain([phases_from]);
        let stream = output::phases(person, inputs, against.method.clone());
        let output = out.declare(stream);
        out.emit(output, end, values(length_secs, &found));
    }
}

impl Compared {
    fn is_of(&self, track: &Track) -> bool {
        track.family == self.family
    }

    /// The differences of the phase with this end, and the quality of its data; `lengths` is the phase's length divided
    /// by that of the baseline.
    fn difference(
        &self,
        track: &Track,
        (value, end): (f64, Time),
        lengths: f64,
    ) -> Result<(Difference, f32), Reason> {
        let WindowValue { value: of_phase, quality, .. } =
            track.value_at(end).ok_or(Reason::Gap)?;
        Ok((self.baseline.between(of_phase?, value, self.baseline.worth * lengths), quality))
    }
}

/// The value of a track for the phase with this end.
fn value_at(track: &Track, end: Time) -> Result<f64, Reason> {
    track.value_at(end).map_or(Err(Reason::NoBaseline), |value| value.value)
}

/// The track of phases with the measure that is compared for windows.
fn track<'a>(tracks: &'a [Track], measure: usize, compared: &Compared) -> Option<&'a Track> {
    tracks.iter().find(|track| track.measure == measure && compared.is_of(track))
}

/// Why a measure can't be compared, if its windows were insufficient when the baseline ended.
fn lack(tracks: &[Track], measure: usize, of_windows: Reason) -> Reason {
    let is_measured = tracks.iter().any(|track| track.measure == measure);
    match of_windows {
        Reason::Missing if is_measured => Reason::NoBaseline,
        of_windows if is_measured => of_windows,
        _ => Reason::Missing,
    }
}

fn values(length_secs: f64, differences: &[Result<(Difference, f32), Reason>; COUNT]) -> Data {
    let known = differences.iter().flatten();
    let (count, sum) = known
        .fold((0.0, 0.0), |(count, sum), (_, quality)| (count + 1.0, sum + f64::from(*quality)));
    let quality = if count > 0.0 { (sum / count).clamp(0.0, 1.0) } else { 0.0 };
    let differences =
        differences.map(|found| found.map_or_else(|reason| [Err(reason); 3], |found| found.0));
    window_of(length_secs, count / COUNT as f64, quality, differences.as_flattened())
}
