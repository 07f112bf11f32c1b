//! The first lines of the screen: the state of the recording, and the phase.

use teampulse_bag::{Growth, OnDisk, Stage};
use teampulse_core::time::Time;

use super::format::{clock, minutes, size};
use super::styled_line::{Style, StyledLine};

/// What a session stores.
#[derive(Clone, Debug, Default)]
pub enum Kept {
    /// Nothing: no sink stores data.
    #[default]
    Nothing,
    /// Files, but no bag.
    Tables,
    /// A bag.
    Bag(Growth),
}

/// The time without growth after which a recording has stalled, as it writes at least once per second [s].
const STILL_SECS: f64 = 3.0;
/// The remaining recording time is shown if it is below this [s].
const SHORT_SECS: f64 = 12.0 * 3600.0;
/// The remaining recording time below which somebody must act [s].
const URGENT_SECS: f64 = 600.0;

/// The recording as observed: it counts as growing only if its size on disk grows.
#[derive(Debug, Default)]
pub(super) struct Recording {
    kept: Kept,
    on_disk: OnDisk,
    began: Option<Time>,
    grown: Time,
    /// When the current bag began, if that was after the start of the session [host time].
    later: Option<Time>,
    now: Time,
}

impl Recording {
    /// The state before the recording began.
    pub fn of(kept: Kept) -> Recording {
        Recording { kept, ..Recording::default() }
    }

    /// Checks the disk; `now` is the host's time, independent of the session's clock.
    pub fn look(&mut self, now: Time) {
        self.now = now;
        let began = *self.began.get_or_insert(now);
        let Kept::Bag(growth) = &self.kept else { return };
        let on_disk = growth.on_disk();
        if on_disk.synced_bytes > self.on_disk.synced_bytes || self.grown == Time::EPOCH {
            self.grown = now.max(began);
        }
        let was_begun = self.on_disk.stage != Stage::NotBegun;
        if was_begun && on_disk.folder != self.on_disk.folder {
            self.later = Some(now);
        }
        self.on_disk = on_disk;
    }

    /// The stage of the recording, which shows whether ending the session by mistake would lose data.
    #[cfg(test)]
    pub fn stage(&self) -> &Stage {
        &self.on_disk.stage
    }

    /// The line of the recording: its state, its size, and the free space.
    pub fn line(&self, elapsed_secs: f64) -> StyledLine {
        let elapsed = clock(elapsed_secs);
        let still_secs = self.now.secs_since(self.grown);
        match (&self.kept, &self.on_disk.stage) {
            (Kept::Nothing, _) => StyledLine::of(Style::Warning, "○ NOT RECORDED")
                .with(Style::Plain, &format!("  {elapsed}  no sink stores data")),
            (Kept::Tables, _) => StyledLine::of(Style::Strong, "○ NO BAG")
                .with(Style::Plain, &format!("  {elapsed}  tables only")),
            (_, Stage::EndedEarly(why)) => StyledLine::of(Style::Alarm, "■ NOT RECORDING")
                .with(Style::Plain, &format!("  {elapsed}  "))
                .with(Style::Alarm, why),
            (_, Stage::Paused { kept_secs }) => {
                let line = StyledLine::of(Style::Warning, "○ NOT RECORDING")
                    .with(Style::Plain, &format!("  {elapsed}  paused"));
                let kept = format!(", the last {kept_secs:.0} s are kept");
                if *kept_secs > 0.0 { line.with(Style::Plain, &kept) } else { line }
            }
            (_, Stage::NotBegun) => StyledLine::of(Style::Strong, "○ REC")
                .with(Style::Plain, &format!(" {elapsed}  starting")),
            (_, Stage::Open) if still_secs >= STILL_SECS => {
                StyledLine::of(Style::Alarm, "◌ NOT GROWING")
                    .with(Style::Plain, &format!("  {elapsed}  "))
                    .with(Style::Alarm, &format!("nothing on disk for {still_secs:.0} s"))
                    .with(Style::Plain, &format!("  {}", size(self.on_disk.synced_bytes)))
            }
            (_, Stage::Open | Stage::Finished) => {
                let recorded = self.later.map(|began| clock(self.now.secs_since(began)));
                let line = StyledLine::of(Style::Strong, "● REC")
                    .with(Style::Strong, &format!(" {}", recorded.unwrap_or(elapsed)))
                    .with(Style::Plain, &format!("  {}  ", size(self.on_disk.synced_bytes)));
                self.with_room(line)
            }
        }
    }

    /// Appends the free space on the disk, and the remaining recording time if it is short.
    fn with_room(&self, line: StyledLine) -> StyledLine {
        let Some(free_bytes) = self.on_disk.free_bytes else { return line };
        let recorded_secs = self.began.map_or(0.0, |began| self.now.secs_since(began));
        let bytes_per_sec = self.on_disk.synced_bytes as f64 / recorded_secs.max(1.0);
        let left_secs = free_bytes as f64 / bytes_per_sec.max(1.0);
        let free = size(free_bytes);
        if left_secs < URGENT_SECS {
            line.with(Style::Alarm, &format!("only {free} left, {}", minutes(left_secs)))
        } else if left_secs < SHORT_SECS {
            line.with(Style::Warning, &format!("{free} left, {}", minutes(left_secs)))
        } else {
            line.with(Style::Plain, &format!("{free} left"))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn at(secs: i32) -> Time {
        Time::from_stamp(1000 + secs, 0)
    }

    fn recording(growth: &Growth) -> Recording {
        Recording::of(Kept::Bag(growth.clone()))
    }

    #[test]
    fn it_records_only_while_bytes_on_the_disk_become_more() {
        let growth = Growth::default();
        let mut recording = recording(&growth);
        recording.look(at(0));
        assert_eq!(recording.line(0.0).text(), "○ REC 0:00  starting");
        growth.begin(Path::new("bag"));
        growth.synced(1_200_000, 212_000_000_000);
        recording.look(at(1));
        assert_eq!(recording.line(1.0).text(), "● REC 0:01  1.2 MB  212 GB left");
        recording.look(at(5));
        let still = recording.line(5.0);
        assert_eq!(still.text(), "◌ NOT GROWING  0:05  nothing on disk for 4 s  1.2 MB");
        growth.synced(10, 212_000_000_000);
        recording.look(at(6));
        assert!(recording.line(6.0).text().starts_with("● REC"));
    }

    #[test]
    fn one_that_ended_early_says_so_for_good_and_why() {
        let growth = Growth::default();
        let mut recording = recording(&growth);
        growth.begin(Path::new("bag"));
        growth.synced(10, 20);
        growth.end_early("record to /d: the disk is full");
        recording.look(at(1));
        assert_eq!(recording.stage(), &growth.on_disk().stage);
        let line = recording.line(754.0).text();
        assert_eq!(line, "■ NOT RECORDING  12:34  record to /d: the disk is full");
    }

    #[test]
    fn a_disk_that_will_not_do_says_for_how_long_it_will() {
        let growth = Growth::default();
        let mut recording = recording(&growth);
        recording.look(at(0));
        growth.begin(Path::new("bag"));
        growth.synced(100_000_000, 3_600_000_000);
        recording.look(at(100));
        assert!(recording.line(100.0).text().ends_with("3.6 GB left, 60 min"));
        growth.synced(1, 300_000_000);
        recording.look(at(101));
        assert!(recording.line(101.0).text().ends_with("only 300 MB left, 5 min"));
    }

    #[test]
    fn that_nothing_is_kept_is_said_all_the_time() {
        let line = Recording::of(Kept::Nothing).line(3.0).text();
        assert_eq!(line, "○ NOT RECORDED  0:03  no sink stores data");
    }
}
