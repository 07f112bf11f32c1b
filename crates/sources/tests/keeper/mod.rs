//! A sink that keeps everything it receives.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};

/// Keeps everything it receives.
pub struct Keeper(pub Arc<Mutex<Vec<Record>>>);

impl Sink for Keeper {
    fn name(&self) -> &'static str {
        "keeper"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    self.0.lock().expect("nobody panicked").extend(batch.iter().cloned());
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}
