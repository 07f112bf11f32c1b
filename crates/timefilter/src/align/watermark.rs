//! The watermark of a source, and whether rows wait for the source.

use super::settings::SourceSettings;

/// The watermark of a source: all samples measured up to it are assumed to have arrived.
#[derive(Clone, Debug)]
pub(super) struct Watermark {
    lateness_nanos: i64,
    idle_nanos: i64,
    /// The newest sample's time minus the lateness [ns]; `i64::MAX` once no more samples are expected.
    pub complete_until: i64,
    /// The newest sample's time [ns]; `i64::MIN` without any.
    pub newest: i64,
    /// When the source last delivered [ns of session time].
    heard: i64,
    pub presence: Presence,
}

/// Whether rows wait for a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Presence {
    /// Rows wait for it.
    Awaited,
    /// The source is silent.
    Silent,
    /// The source delivers too late.
    Behind,
    /// The source has ended, like all others.
    Ended,
    /// The source has ended, and leaves the rows after its last sample.
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

    /// Records a sample; returns whether the source is back after a silence.
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

    /// Whether rows wait for a sample measured at this time: it is newer than all samples before it.
    #[inline]
    pub fn expects(&self, measured: i64) -> bool {
        self.presence == Presence::Awaited && measured > self.newest
    }

    /// Starts the time-out of the source.
    pub fn begin(&mut self, now: i64) {
        self.heard = now;
    }

    /// When the source will count as silent if no sample arrives before [ns of session time].
    pub fn silent_from(&self) -> Option<i64> {
        let may_fall_silent = matches!(self.presence, Presence::Awaited | Presence::Behind);
        may_fall_silent.then(|| self.heard.saturating_add(self.idle_nanos))
    }

    /// Completes the watermark of a silent source: no more samples are expected for now.
    pub fn fall_silent(&mut self) {
        self.presence = Presence::Silent;
        self.complete_until = self.complete_until.max(self.newest);
    }

    /// Ends the source.
    pub fn end(&mut self, presence: Presence) {
        self.presence = presence;
        self.complete_until = i64::MAX;
    }

    /// Whether rows wait again for a source that was behind: its time-out would not expire at once.
    pub fn catch_up(&mut self, now: i64) -> bool {
        let due = self.complete_until.saturating_add(self.patience_nanos());
        let catches_up = self.presence == Presence::Behind && due > now;
        if catches_up {
            self.presence = Presence::Awaited;
        }
        catches_up
    }

    /// The longest time that a row waits for the source [ns after the row's time].
    #[inline]
    pub fn patience_nanos(&self) -> i64 {
        self.lateness_nanos + self.idle_nanos
    }
}
