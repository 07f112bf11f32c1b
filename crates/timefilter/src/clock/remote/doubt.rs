//! What the last messages say against what is taken to be known.

use super::bursts::Bursts;

/// How many messages are the last ones.
const LAST: usize = 5;
/// When even the fastest of them is later than usual by this factor, the line is in doubt.
const UNUSUAL: f64 = 3.0;
/// How fast it is forgotten what is usual, a message.
const FORGETS: f64 = 0.005;

/// How far the last messages lie from the line that is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Doubt {
    last: [Residual; LAST],
    messages: u64,
    /// The square of how late the fastest of the last messages usually is.
    usual_square: f64,
    /// Since when all are late, and what was too late then.
    late: Option<(i64, f64)>,
}

/// How far a message lies from the line that is known.
#[derive(Clone, Copy, Debug, Default)]
struct Residual {
    late_nanos: f64,
    early_nanos: f64,
    is_disbelieved: bool,
}

impl Doubt {
    /// A message came so much later than the fastest do, or so much earlier than it can be.
    pub(super) fn push(&mut self, now: i64, late_nanos: f64, early_nanos: f64) {
        self.keep(Residual { late_nanos, early_nanos, is_disbelieved: false });
        if self.messages < LAST as u64 {
            return;
        }
        let least = self.least_late_nanos();
        let too_late = self.late.map_or(self.too_late_nanos(), |(_, bound)| bound);
        let since = self.late.map_or(now, |(since, _)| since);
        self.late = (least > too_late).then_some((since, too_late));
        let forgets = FORGETS.max(1.0 / (self.messages - LAST as u64 + 1) as f64);
        self.usual_square += forgets * (least * least - self.usual_square);
    }

    /// A message came whose stamp was not believed.
    pub(super) fn disbelieve(&mut self) {
        self.keep(Residual { is_disbelieved: true, ..Residual::default() });
    }

    /// Whether the last messages were all believed.
    pub(super) fn believes_all(&self) -> bool {
        self.last.iter().all(|each| !each.is_disbelieved)
    }

    /// How far the line may be elsewhere [ns]. Lateness that began before probes agreed with the
    /// line is the way's.
    pub(super) fn nanos(&self, probes: Option<&Bursts>) -> f64 {
        let early = self.last.iter().map(|each| each.early_nanos).fold(0.0, f64::max);
        // Even the earliest of them may be as late as is usual.
        let early = early + early.min(self.too_late_nanos());
        let agreed = probes.and_then(Bursts::agreed);
        let late = self.late.filter(|(since, _)| agreed.is_none_or(|agreed| agreed <= *since));
        late.map_or(early, |_| early.max(self.least_late_nanos()))
    }

    fn keep(&mut self, residual: Residual) {
        self.last.rotate_right(1);
        self.last[0] = residual;
        self.messages = self.messages.saturating_add(1);
    }

    /// From when on the last messages are later than usual [ns].
    fn too_late_nanos(&self) -> f64 {
        UNUSUAL * self.usual_square.sqrt()
    }

    fn least_late_nanos(&self) -> f64 {
        self.last.iter().map(|each| each.late_nanos.max(0.0)).fold(f64::MAX, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages that are late by turns, each by so much more.
    fn after(messages: i64, more_nanos: f64) -> Doubt {
        let mut doubt = Doubt::default();
        for k in 0..500 + messages {
            let more_nanos = if k < 500 { 0.0 } else { more_nanos };
            doubt.push(k, (k * 7919 % 17) as f64 * 1e6 + more_nanos, 0.0);
        }
        doubt
    }

    #[test]
    fn messages_that_are_late_by_turns_leave_no_doubt() {
        assert!((0..100).all(|k| after(k, 0.0).nanos(None) < 1.0));
    }

    #[test]
    fn when_all_are_later_than_usual_the_line_is_in_doubt_by_as_much() {
        assert!((5..200).all(|k| after(k, 12e6).nanos(None) >= 12e6));
    }

    #[test]
    fn a_single_message_that_is_too_early_is_doubt_enough() {
        let mut doubt = after(0, 0.0);
        doubt.push(500, 0.0, 7e6);
        assert!((7e6..=14e6).contains(&doubt.nanos(None)));
    }

    #[test]
    fn what_is_not_believed_is_remembered_for_some_messages() {
        let mut doubt = after(0, 0.0);
        doubt.disbelieve();
        assert!(!doubt.believes_all());
        (0..LAST as i64).for_each(|k| doubt.push(501 + k, 0.0, 0.0));
        assert!(doubt.believes_all());
    }
}
