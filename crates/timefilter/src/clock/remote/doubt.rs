//! Contradictions between the last messages and the fitted line.

use super::bursts::Bursts;

/// The number of messages considered.
const LAST: usize = 5;
/// The line is in doubt when even the fastest of these messages is later than usual by this factor.
const UNUSUAL: f64 = 3.0;
/// The forgetting factor of the usual lateness, per message.
const FORGETS: f64 = 0.005;

/// The residuals of the last messages from the fitted line.
#[derive(Clone, Debug, Default)]
pub(super) struct Doubt {
    last: [Residual; LAST],
    messages: u64,
    /// The mean square of the lateness of the fastest of the last messages.
    usual_square: f64,
    /// Since when all messages have been late, and the limit of lateness then.
    late: Option<(i64, f64)>,
}

/// The residual of a message from the fitted line.
#[derive(Clone, Copy, Debug, Default)]
struct Residual {
    late_nanos: f64,
    early_nanos: f64,
    is_disbelieved: bool,
}

impl Doubt {
    /// Takes how much later than the fastest messages one came, or how much earlier than is possible.
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

    /// Records a message whose timestamp was rejected.
    pub(super) fn disbelieve(&mut self) {
        self.keep(Residual { is_disbelieved: true, ..Residual::default() });
    }

    /// Whether the timestamps of all the last messages were accepted.
    pub(super) fn believes_all(&self) -> bool {
        self.last.iter().all(|each| !each.is_disbelieved)
    }

    /// How far the line may be off [ns]. Lateness that began before probes last agreed with the line is due
    /// to the path.
    pub(super) fn nanos(&self, probes: Option<&Bursts>) -> f64 {
        let early = self.last.iter().map(|each| each.early_nanos).fold(0.0, f64::max);
        // Even the earliest of them may have the usual lateness.
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

    /// The lateness beyond which the last messages are unusual [ns].
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

    /// Messages with a cycling lateness in steps of `more_nanos`.
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
    fn a_rejected_stamp_is_remembered_for_some_messages() {
        let mut doubt = after(0, 0.0);
        doubt.disbelieve();
        assert!(!doubt.believes_all());
        (0..LAST as i64).for_each(|k| doubt.push(501 + k, 0.0, 0.0));
        assert!(doubt.believes_all());
    }
}
