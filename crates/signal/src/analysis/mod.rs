//! The common interface of all signal analyses: samples in, [events](Event) and the [values](Value) of any
//! [span](Span) out.
//!
//! Each signal has two analyses: a [`Causal`] one, which takes samples as they come and reports an event as
//! soon as it is known, and a [`Whole`] one, which sees the complete recording. Both answer
//! [`Windows::measure`] with the same values, by the same formulas; they differ only in how events are
//! detected and signals are split, which [`Value::method`] states.
//!
//! A causal analysis is a pure function of its samples: its output is bit-identical for any chunking, live
//! and afterwards.

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

/// The store of an analysed signal, which can be queried for any span.
pub trait Windows {
    /// The values that [`measure`](Self::measure) returns, in order; constant.
    fn values(&self) -> &[Value];

    /// The values of a span, as far as the samples so far determine them.
    ///
    /// Repeated calls return the same values until a late sample falls into the span.
    fn measure(&self, span: Span) -> Measured;

    /// Like [`measure`](Self::measure), where `last` was measured shortly before over a span of the same length:
    /// expensive values may be reused from it, provided the present span has the data for them.
    fn measure_again(&self, span: Span, _last: &Measured) -> Measured {
        self.measure(span)
    }
}

/// An analysis of a signal that comes in sample by sample.
pub trait Causal: Windows {
    /// Takes in the next sample of all channels, and its time [ns].
    ///
    /// Samples arrive at the rate the analysis was created for; lost samples and absent channels are NaN.
    /// Times ascend.
    fn push(&mut self, at_ns: i64, channels: &[f64]);

    /// Returns the next event, in the order in which events became known; `None` when there is none.
    fn next_event(&mut self) -> Option<Event>;

    /// Drops the data that only spans starting before `before_ns` [ns] need.
    fn forget(&mut self, before_ns: i64);

    /// The second, relative to other signals, at which this one is [measured](Windows::measure) in full rather than
    /// [again](Windows::measure_again) [s].
    fn turn_secs(&self) -> i64 {
        0
    }
}

/// A recording analysed as a whole.
pub struct Whole {
    /// The events of the recording, in order of time.
    pub events: Vec<Event>,
    /// The store to query for values of spans.
    pub windows: Box<dyn Windows + Send>,
}
