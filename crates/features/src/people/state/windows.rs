//! The state of one person in windows of one length.

use teampulse_core::data::{Data, FeatureValues, Reason};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::phases::Phase;
use teampulse_core::stream::{Stream, StreamId, Subject};
use teampulse_core::time::Time;

use super::baseline::{Baseline, Difference};
use super::measures::{COUNT, MEASURES};
use super::output;
use super::track::{Span, Track};
use crate::value::window_of;

/// A compared measure: the index of its track, and its baseline.
pub(super) type Compared = (usize, Baseline);

/// All streams of one person with windows of one length.
#[derive(Default)]
pub(super) struct Windows {
    length_secs: f64,
    tracks: Vec<Track>,
    compared: [Option<Compared>; COUNT],
    output: Option<OutputId>,
}

impl Windows {
    /// Adds a stream with windows of this length.
    pub(super) fn join(&mut self, id: StreamId, stream: &Stream) {
        if self.tracks.iter().all(|track| track.id != id) {
            self.tracks.extend(Track::all(id, stream));
        }
    }

    /// Takes in the end of a window of a stream.
    pub(super) fn take(
        &mut self,
        (id, end): (StreamId, Time),
        window: &FeatureValues,
        baseline: Option<Span>,
    ) {
        self.length_secs = window.window_secs;
        for track in self.tracks.iter_mut().filter(|track| track.id == id) {
            track.take(end, window, baseline);
        }
    }

    /// Starts another baseline.
    pub(super) fn begin_anew(&mut self) {
        self.tracks.iter_mut().for_each(Track::begin_anew);
    }

    /// The length of the windows [s].
    pub(super) fn length_secs(&self) -> f64 {
        self.length_secs
    }

    /// Ends the baseline and chooses the track of each measure for later comparisons: that of the best family with a
    /// baseline; among several, the one with the best quality; among equals, the first by name.
    pub(super) fn judge(
        &mut self,
        person: &Subject,
        (phase, end): (&Phase, Time),
        phases_from: &str,
        out: &mut Outputs,
    ) {
        self.compared = [None; COUNT];
        for place in 0..self.tracks.len() {
            let baseline = Baseline::of(self.tracks[place].held(end), self.length_secs);
            let Some(baseline) = baseline else { continue };
            let known = &mut self.compared[self.tracks[place].measure];
            let is_better = known.is_none_or(|(other, than)| {
                let (track, other) = (&self.tracks[place], &self.tracks[other]);
                let better = |a: f64, b: f64| b.total_cmp(&a);
                let by_quality = better(baseline.quality, than.quality);
                let order = track.rank.cmp(&other.rank).then(by_quality);
                order.then(track.stream.cmp(&other.stream)).is_lt()
            });
            if is_better {
                *known = Some((place, baseline));
            }
        }
        if self.compared.iter().any(Option::is_some) {
            let recipes = self.chosen().map(|(track, baseline)| {
                output::recipe(&MEASURES[track.measure], &track.stream, baseline)
            });
            let recipe = output::method(self.length_secs, phase, recipes);
            let inputs = self.chosen().map(|(track, _)| track.stream.as_str());
            let stream =
                output::windows(person, self.length_secs, inputs.chain([phases_from]), recipe);
            self.output = Some(out.declare(stream));
        }
    }

    /// The compared measure of a stream, and its baseline.
    pub(super) fn chosen(&self) -> impl Iterator<Item = (&Track, &Baseline)> {
        self.compared.iter().flatten().map(|(place, baseline)| (&self.tracks[*place], baseline))
    }

    /// Why a measure can't be compared: its sensor is missing, its windows are too short, or it has no
    /// values in the baseline, or too few.
    pub(super) fn lack(&self, measure: usize) -> Reason {
        let tracks = self.tracks.iter().filter(|track| track.measure == measure);
        let is_short =
            |track: &Track| track.newest().is_some_and(|newest| newest.value == Err(Reason::Short));
        let lack = |track: &Track| match track {
            track if track.is_held() => Reason::BriefBaseline,
            track if is_short(track) => Reason::Short,
            _ => Reason::NoBaseline,
        };
        tracks.map(lack).max_by_key(|lack| *lack as u8).unwrap_or(Reason::Missing)
    }

    /// Reports the state at a whole second, from windows that ended less than `stale_secs` [s] before.
    pub(super) fn report(&self, second: Time, stale_secs: f64, out: &mut Outputs) {
        let Some(output) = self.output else { return };
        out.emit(output, second, self.state(second, stale_secs));
    }

    fn state(&self, second: Time, stale_secs: f64) -> Data {
        let (mut known, mut quality) = (0.0, 0.0);
        let mut differences = [[Err(Reason::Missing); 3]; COUNT];
        for (measure, difference) in differences.iter_mut().enumerate() {
            let found = self.difference(measure, second, stale_secs);
            *difference =
                found.map_or_else(|reason| [Err(reason); 3], |(difference, _)| difference);
            if let Ok((_, of_window)) = found {
                (known, quality) = (known + 1.0, quality + f64::from(of_window));
            }
        }
        let quality = if known > 0.0 { (quality / known).clamp(0.0, 1.0) } else { 0.0 };
        window_of(self.length_secs, known / COUNT as f64, quality, differences.as_flattened())
    }

    /// The difference of a measure and the quality of the window, or the reason why it is unknown.
    fn difference(
        &self,
        measure: usize,
        second: Time,
        stale_secs: f64,
    ) -> Result<(Difference, f32), Reason> {
        let Some((place, baseline)) = &self.compared[measure] else {
            return Err(self.lack(measure));
        };
        let newest = self.tracks[*place].newest().ok_or(Reason::Gap)?;
        if second.secs_since(newest.end) > stale_secs {
            return Err(Reason::Gap);
        }
        Ok((baseline.difference(newest.value?), newest.quality))
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{About, Shape, Window};

    use super::*;

    #[test]
    fn windows_that_are_too_short_for_a_measure_do_not_blame_the_baseline() {
        let person = Subject { about: About::Person, id: "p1".into() };
        let name = "/humans/persons/p1/belt/respiration/breath";
        let stream = Stream::concluded(name, person, "breath", Shape::Feature);
        let stream = stream.over(Window::of_secs(10.0));
        let stream = stream.with_channels(&[("RSP_Quality", "1"), ("RSP_Rate_Mean", "1/min")]);
        let mut windows = Windows::default();
        windows.join(StreamId(0), &stream);
        let window = |reason| FeatureValues {
            window_secs: 10.0,
            coverage: 1.0,
            quality: 1.0,
            values: vec![60.0, f64::NAN],
            sigmas: Vec::new(),
            reasons: vec![Reason::Ok, reason],
        };
        let breathing = MEASURES.iter().position(|each| each.name == "breathing_rate").unwrap();
        for (reason, lack) in [(Reason::Short, Reason::Short), (Reason::Gap, Reason::NoBaseline)] {
            windows.take((StreamId(0), Time::from_stamp(10, 0)), &window(reason), None);
            assert_eq!(windows.lack(breathing), lack);
        }
        assert_eq!(windows.lack(COUNT - 1), Reason::Missing);
    }
}
