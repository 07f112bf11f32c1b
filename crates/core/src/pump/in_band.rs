//! Readings that the pump itself acts on: losses, other computers' clocks, publishers, standstills.

use std::time::Duration;

use super::Pump;
use crate::computers::ClockReport;
use crate::data::Data;
use crate::publishers::PublishedBy;
use crate::simulated_time::breaks_simulated_time;
use crate::source::Reading;
use crate::standstill::standstill;
use crate::stopped::Stopped;
use crate::stream::Origin;
use crate::time::Time;
use crate::track::{Track, Word};

/// The most lost samples that are counted from one report.
const MOST_LOST: u64 = u32::MAX as u64;

impl Pump {
    /// Adds the losses that a reading reports to the stream that lost samples.
    pub(super) fn count_losses(&mut self, reading: &Reading) {
        let Some(loss) = self.track(reading.stream).and_then(|track| track.gives) else { return };
        let Data::Event(event) = &reading.data else { return };
        if let Some(track) = self.raw_track(&event.label) {
            // NaN if the number can't be known; a negative number counts as 0.
            let samples = (!event.value.is_nan()).then_some(event.value as u64);
            track.lost(loss, samples.map(|samples| samples.min(MOST_LOST)));
        }
    }

    /// Applies the reports in a reading that the pump itself acts on.
    pub(super) fn take_word(&mut self, reading: &Reading, log_time: Time) {
        match self.track(reading.stream).and_then(|track| track.word) {
            Some(Word::Computers) => self.take_clock_report(reading, log_time),
            Some(Word::Publishers) => self.take_publishers(reading),
            Some(Word::Stopped) => self.take_stopped(reading, log_time),
            Some(Word::Happenings) if breaks_simulated_time(&reading.data) => {
                // Clocks in simulated time begin a new epoch.
                self.clocks.begin_epoch_of_simulated_time();
            }
            Some(Word::Happenings) => {
                if let Some(lasted) = standstill(&reading.data) {
                    self.take_standstill(lasted, log_time);
                }
            }
            None => {}
        }
    }

    /// Applies a reading's report on another computer's clock.
    fn take_clock_report(&mut self, reading: &Reading, log_time: Time) {
        let Some(track) = self.track(reading.stream) else { return };
        match ClockReport::read(&track.stream, &reading.data) {
            Some(ClockReport::StampedBy { stream, computer }) => {
                self.clocks.stamped_by(stream, computer);
            }
            Some(ClockReport::Probed { computer, offset_secs, round_trip_secs }) => {
                let probe = ClockReport::probe(offset_secs, round_trip_secs, log_time);
                self.clocks.probed(computer, &probe);
            }
            None => {}
        }
    }

    /// Applies a reading's report on the publishers of a topic to its stream.
    fn take_publishers(&mut self, reading: &Reading) {
        let Some(track) = self.track(reading.stream) else { return };
        let Some(report) = PublishedBy::read(&track.stream, &reading.data) else { return };
        if let Some(track) = self.raw_track(&report.stream) {
            track.published_by = report.complaint(&track.stream);
        }
    }

    /// Applies a reading's report that a stream was stopped on purpose, or has resumed.
    fn take_stopped(&mut self, reading: &Reading, log_time: Time) {
        let Some(track) = self.track(reading.stream) else { return };
        let Some(report) = Stopped::read(&track.stream, &reading.data) else { return };
        if let Some(track) = self.raw_track(&report.stream) {
            track.life.was_stopped(report.is_stopped, log_time);
        }
    }

    /// Keeps streams from counting as silent while this process was not running.
    fn take_standstill(&mut self, lasted: Duration, log_time: Time) {
        let until = log_time + lasted;
        for track in self.tracks.iter_mut().flatten() {
            track.life.stood_still(until);
        }
        self.extractors.stood_still(until, &mut self.given);
    }

    /// The raw stream with this name.
    fn raw_track(&mut self, name: &str) -> Option<&mut Track> {
        let is_raw = |track: &Track| track.stream.origin == Origin::Raw;
        let mut named = self.streams.named(name).into_iter();
        let id = named.find(|id| self.track(*id).is_some_and(|track| is_raw(track)))?;
        self.track(id)
    }
}
