//! Losses, published as events: they are recorded like any other input, so that a replay counts the same losses.

use std::sync::Arc;

use crate::data::{Data, Event, EventKind};
use crate::session_streams::own_events;
use crate::stream::Stream;

/// Where samples were lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Samples were lost between the publisher and us, as sequence numbers show.
    OnTheWay,
    /// Samples were lost in our own queue, in front of the pump.
    InOurQueue,
}

impl Loss {
    /// The stream of such losses: fault events whose label is the affected stream and whose value is the number of lost
    /// samples, counting each sample in a wave; NaN if unknown.
    pub fn stream(self) -> Stream {
        let doc = match self {
            Loss::OnTheWay => "samples lost between a publisher and this session",
            Loss::InOurQueue => "samples dropped in this session's own queue",
        };
        own_events(self.topic(), doc)
    }

    /// The event that reports a loss; `samples` is `None` if their number is unknown.
    pub fn event(self, stream: &str, samples: Option<u64>) -> Data {
        let label = stream.to_owned();
        let kind = EventKind::Fault;
        let value = samples.map_or(f64::NAN, |samples| samples as f64);
        Data::Event(Arc::new(Event { kind, label, value, duration_secs: 0.0 }))
    }

    /// The kind of losses that a stream reports; `None` for any other stream.
    pub fn of_stream(stream: &Stream) -> Option<Loss> {
        [Loss::OnTheWay, Loss::InOurQueue].into_iter().find(|loss| loss.topic() == stream.name)
    }

    fn topic(self) -> &'static str {
        match self {
            Loss::OnTheWay => "/teampulse/lost_source",
            Loss::InOurQueue => "/teampulse/lost_queue",
        }
    }
}
