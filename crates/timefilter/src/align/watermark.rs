//! How far a source has come, and whether rows wait for it.

use super::settings::SourceSettings;

/// How far a source has come: all that it measured until its watermark is thought to be there.
#[derive(Clone, Debug)]
pub(super) struct Watermark {
    lateness_nanos: i64,
    idle_nanos: i64,
    /// The newest sample's time less the lateness [ns]; all of it once nothing more is expected.
    pub complete_until: i64,
    /// The newest sample's time [ns]; `i64::MIN` without any.
    pub newest: i64,
    /// When it last said something [ns of session time].
    heard: i64,
    pub presence: Presence,
}

/// Whether rows wait for a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Presence {
    /// Rows wait for it.
    Awaited,
    /// It says nothing.
    Silent,
    /// It delivers too late.
    Behind,
    /// It has said all, as all others have.
    Ended,
    /// It has said all, and goes from the rows after its last sample.
    Left,
}

impl Watermark {
    pub fn new(settings: &SourceSettings, now: i64) -> Watermark {
        Watermark {
            lateness_nanos: settings.lateness_nanos,
            idle_nanos: settings.idle_nanos,
            complete_until: i64::MIN,
            newest: i64::MIN,
            heard: now,
            presence: Presence::Awaited,
        }
    }

    /// Takes a sample into account; says whether the source is back after a silence.
    #[inline]
    pub fn hear(&mut self, measured: i64, now: i64) -> bool {
        self.heard = now;
        self.newest = self.newest.max(measured);
        let complete_until = measured.saturating_sub(self.lateness_nanos);
        self.complete_until = self.complete_until.max(complete_until);
        let was_silent = self.presence == Presence::Silent;
        if was_silent {
            self.presence = Presence::Awaited;
        }
        was_silent
    }

    /// Its time begins.
    pub fn begin(&mut self, now: i64) {
        self.heard = now;
    }

    /// When it will count as silent, if it says nothing until then [ns of session time].
    pub fn silent_from(&self) -> Option<i64> {
        let may_fall_silent = matches!(self.presence, Presence::Awaited | Presence::Behind);
        may_fall_silent.then(|| self.heard.saturating_add(self.idle_nanos))
    }

    /// What it has measured is all there: nothing else is expected for now.
    pub fn fall_silent(&mut self) {
        self.presence = Presence::Silent;
        self.complete_until = self.complete_until.max(self.newest);
    }

    /// It has said all.
    pub fn end(&mut self, presence: Presence) {
        self.presence = presence;
        self.complete_until = i64::MAX;
    }

    /// Whether rows wait for a source again that was behind: its time would not be out at once.
    pub fn catch_up(&mut self, now: i64) -> bool {
        let due = self.complete_until.saturating_add(self.patience_nanos());
        let catches_up = self.presence == Presence::Behind && due > now;
        if catches_up {
            self.presence = Presence::Awaited;
        }
        catches_up
    }

    /// How long a row waits for it at most [ns after the row's time].
    #[inline]
    pub fn patience_nanos(&self) -> i64 {
        self.lateness_nanos + self.idle_nanos
    }
}
