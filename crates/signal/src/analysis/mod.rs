//! What the analyses of all signals have in common: samples come in, [events](Event) and the
//! [values](Value) of any [span](Span) come out.
//!
//! Each field has two: a [`Causal`] one, which takes samples as they come and reports an event as soon as
//! it is known, and a [`Whole`] one, which sees a recording at once. Both answer [`Windows::measure`] with
//! the same values, by the same formulas; only how events were found and signals split differs, and
//! [`Value::method`] says so.
//!
//! A causal analysis is a pure function of its samples: it gives the same, bit for bit, for any
//! chunking, live and afterwards.

mod cadence;
mod event;
mod live;
mod measured;
mod recording;
mod span;
mod track;

pub use cadence::Cadence;
pub use event::Event;
pub use live::{LONGEST_HELD_NS, Live, LiveOutput, Make};
pub use measured::{LEAST_COVERAGE, Measured, Reason, Value};
pub use recording::Recording;
pub use span::Span;
pub use track::Track;

/// What is known of a signal, of which any span can be asked.
pub trait Windows {
    /// What [`measure`](Self::measure) gives, in that order; never changes.
    fn values(&self) -> &[Value];

    /// The values of a span, as far as the samples so far determine them.
    ///
    /// The same span gives the same values until a sample of it comes in late.
    fn measure(&self, span: Span) -> Measured;

    /// The same where `last` was measured for a span of the same length shortly before: expensive values
    /// may be taken from there, if the present span has the data for them, too.
    fn measure_again(&self, span: Span, _last: &Measured) -> Measured {
        self.measure(span)
    }
}

/// An analysis of a signal that comes in sample by sample.
pub trait Causal: Windows {
    /// Takes in the next sample of all channels, and when it was measured [ns].
    ///
    /// Samples follow each other at the rate that the analysis was made for; one that was lost is
    /// handed over as NaN. Channels that are not there are NaN, too. Times ascend.
    fn push(&mut self, at_ns: i64, channels: &[f64]);

    /// An event that became known, in the order of becoming known; `None` when there is no other.
    fn next_event(&mut self) -> Option<Event>;

    /// Lets go of what only spans that begin before `before_ns` [ns] need.
    fn forget(&mut self, before_ns: i64);

    /// How much later than that of other signals its turn comes to be [measured](Windows::measure) in
    /// full and not [again](Windows::measure_again) [s].
    fn turn_secs(&self) -> i64 {
        0
    }
}

/// A recording that was analysed as a whole.
pub struct Whole {
    /// Its events, in the order of their times.
    pub events: Vec<Event>,
    /// What spans of it can be asked.
    pub windows: Box<dyn Windows + Send>,
}
