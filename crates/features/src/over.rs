//! Phases that are over: each is told of once, as far as it is held.

use teampulse_core::phases::Phase;
use teampulse_signal::analysis::{LONGEST_HELD_NS, Span};

/// How a recipe says what is measured of a phase.
pub(crate) const OVER_PHASES: &str = "each phase, of a longer one its last 600 s";

/// Which phases were told of already.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PhasesTold(usize);

impl PhasesTold {
    /// The next phase that has ended at a time [ns]; each once.
    pub(crate) fn next_over<'a>(&mut self, phases: &'a [Phase], at_ns: i64) -> Option<&'a Phase> {
        let is_over = |phase: &&Phase| phase.end.is_some_and(|end| end.nanos() <= at_ns);
        let next = phases.get(self.0).filter(is_over)?;
        self.0 += 1;
        Some(next)
    }

    /// When the phase begins that is to be told of next [ns]; `None` when it is not known yet.
    pub(crate) fn next_begin_ns(self, phases: &[Phase]) -> Option<i64> {
        phases.get(self.0).map(|phase| phase.begin.nanos())
    }
}

/// What is measured of a phase that is over: all of it, or as much of its end as is held. `None` of one
/// without length, or of before there was anything (`since_ns`).
pub(crate) fn measured_span(phase: &Phase, since_ns: i64) -> Option<Span> {
    let (begin_ns, end_ns) = (phase.begin.nanos(), phase.end?.nanos());
    let begin_ns = begin_ns.max(end_ns.saturating_sub(LONGEST_HELD_NS));
    (end_ns > begin_ns.max(since_ns)).then_some(Span { begin_ns, end_ns })
}
