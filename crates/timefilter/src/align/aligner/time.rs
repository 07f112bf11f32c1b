//! How session time advances for an aligner.

use super::super::row::{Output, SourceEvent};
use super::{Aligner, NEVER};

impl Aligner {
    /// Advances session time, and issues everything that falls due, each at its own time.
    #[inline]
    pub(super) fn advance<F: FnMut(Output<'_>)>(&mut self, now: i64, out: &mut F) {
        if let Some(before) = self.now {
            if self.row_due.min(self.silence_due) <= now {
                self.pass_until(now, out);
            }
            self.now = Some(now.max(before));
        } else {
            self.begin(now);
        }
    }

    #[cold]
    pub(super) fn begin(&mut self, now: i64) {
        self.now = Some(now);
        for source in self.sources.iter_mut().flatten() {
            source.watermark.begin(now);
        }
        self.find_silence();
    }

    #[cold]
    pub(super) fn pass_until<F: FnMut(Output<'_>)>(&mut self, now: i64, out: &mut F) {
        loop {
            let due = self.row_due.min(self.silence_due);
            if due > now || due == NEVER {
                return;
            }
            self.now = self.now.max(Some(due));
            if self.silence_due <= due {
                self.fall_silent(due, out);
                self.settled = 0;
            }
            self.settle(out);
        }
    }

    pub(super) fn fall_silent<F: FnMut(Output<'_>)>(&mut self, now: i64, out: &mut F) {
        for source in self.sources.iter_mut().flatten() {
            if source.watermark.silent_from().is_some_and(|from| from <= now) {
                source.watermark.fall_silent();
                out(Output::Event(SourceEvent::Silent(source.id)));
            }
        }
        self.find_silence();
    }
}
