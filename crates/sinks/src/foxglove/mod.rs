//! The session in Foxglove and Lichtblick.

mod channels;
mod client;
mod protocol;
mod server;

use std::sync::Arc;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use tokio::net::TcpListener;
use tokio::runtime::Builder;

use self::channels::Channels;
use self::server::Shared;
use crate::terminal::Estimates;
use crate::{Announcements, SinkContext};

/// The longest wait for records.
const PATIENCE: Duration = Duration::from_millis(20);
/// The time allowed for clients to receive the last messages.
const FAREWELL: Duration = Duration::from_millis(300);

/// Serves all streams to Foxglove and Lichtblick ("Open connection", "Foxglove WebSocket", <ws://localhost:8765>).
///
/// The messages are the same as in the bag, with their definitions. Each channel of a wave is also a separate topic,
/// with at most 60 values per second, as those viewers can't plot arrays. A text published from a viewer sets a marker
/// with that text, if `[commands]` allows `foxglove = ["mark"]`. Only programs and pages on this computer, and
/// Foxglove's web app, can connect; from other computers use `ssh -L 8765:localhost:8765`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Foxglove {
    /// The port.
    pub port: u16,
    /// Other origins of pages that may connect: `["https://viewer.lab.example"]`.
    pub origins: Vec<String>,
}

impl Default for Foxglove {
    fn default() -> Foxglove {
        Foxglove { port: 8765, origins: Vec::new() }
    }
}

impl Component<dyn Sink, SinkContext> for Foxglove {
    const EXAMPLE: &'static str = "port = 8765";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        if let Some(place) = self.origins.iter().position(|origin| !origin.contains("://")) {
            let error = SettingsError::new("an origin begins with `https://` or `http://`");
            return Err(error.at(format!("origins.{place}")));
        }
        let (session, estimates) = (context.session.clone(), context.terminal.estimates);
        let announcements = context.announcements.clone();
        Ok(Box::new(Viewers { settings: self, session, estimates, announcements }))
    }
}

/// Serves viewers that use Foxglove's protocol.
struct Viewers {
    settings: Foxglove,
    session: String,
    estimates: Estimates,
    announcements: Announcements,
}

impl Sink for Viewers {
    fn name(&self) -> &'static str {
        "foxglove"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        let estimates = self.estimates;
        Wants::Only(Box::new(move |stream| !estimates.hide(stream)))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let Viewers { settings: Foxglove { port, origins }, session, announcements, .. } = *self;
        let failed = |what: String, error: std::io::Error, hint: &str| SinkError::Failed {
            message: format!("{what}: {error}"),
            hint: hint.to_owned(),
        };
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.map_err(|error| failed("start its thread".into(), error, ""))?;
        let listener = runtime.block_on(TcpListener::bind(("127.0.0.1", port)));
        let listener = listener.map_err(|error| {
            failed(format!("listen on port {port}"), error, "give another `port`")
        })?;
        announcements.add(format!("open ws://localhost:{port} in Foxglove or Lichtblick"));
        let shared = Arc::new(Shared::new(&session, origins, inbox.outlet().cloned()));
        let outlet = inbox.outlet().cloned();
        let serving = server::run(listener, Arc::clone(&shared));
        runtime.spawn(async move {
            if let (Err(error), Some(outlet)) = (serving.await, outlet) {
                let label = format!("foxglove: failed to keep serving: {error}");
                outlet.happen(teampulse_core::fault::lasting(label));
            }
        });
        let mut channels = Channels::new(Arc::clone(&shared));
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => batch.iter().for_each(|record| channels.take(record)),
                Received::Silence => {}
                Received::Closed => break,
            }
            shared.report_skipped(inbox.take_skipped());
        }
        shared.end();
        runtime.block_on(async { tokio::time::sleep(FAREWELL).await });
        runtime.shutdown_timeout(FAREWELL);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
