//! The sink: receives all records, and serves the viewers.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use tokio::runtime::{Builder, Runtime};

use crate::access::Access;
use crate::addresses::Addresses;
use crate::context::{Context, Settings};
use crate::hub::Hub;
use crate::relay::{Relay, is_wanted};
use crate::server;

/// The longest wait for records, and so the longest delay of anything that is due once a second.
const PATIENCE: Duration = Duration::from_millis(50);
/// How long records gather before they are stored while nobody watches.
const GATHER: Duration = Duration::from_millis(100);
/// The time allowed for sending the last messages to viewers.
pub(crate) const FAREWELL: Duration = Duration::from_millis(300);

/// Shows a session in browsers, and lets their users take part.
#[derive(Debug)]
pub struct Dashboard {
    context: Context,
    settings: Settings,
}

impl Dashboard {
    /// A dashboard of a session.
    pub fn new(context: Context, settings: Settings) -> Dashboard {
        Dashboard { context, settings }
    }
}

impl Sink for Dashboard {
    fn name(&self) -> &'static str {
        "dashboard"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(is_wanted))
    }

    fn shows_live(&self) -> bool {
        true
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let Dashboard { context, settings } = *self;
        let announce = Arc::clone(&context.announce);
        let hub = Arc::new(Hub::new(context, settings, inbox.outlet().cloned()));
        let (runtime, addresses) = match start(&hub) {
            Ok(started) => started,
            Err(error) if hub.settings.is_default() => {
                inbox.report(format!("dashboard: failed to {error}"));
                while !matches!(inbox.receive(PATIENCE), Received::Closed) {}
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        announce(&addresses);
        let mut relay = Relay::new(Arc::clone(&hub), inbox.streams().clone());
        loop {
            let gather = if hub.viewers() > 0 { Duration::ZERO } else { GATHER };
            match inbox.receive_gathered(gather, PATIENCE) {
                Received::Batch(batch) => relay.take(&batch),
                Received::Silence => {}
                Received::Closed => break,
            }
            relay.tick(inbox.take_skipped());
        }
        let cut_off = inbox.cut_off();
        relay.end(cut_off.as_deref().unwrap_or("the session is over"));
        runtime.block_on(async { tokio::time::sleep(FAREWELL).await });
        runtime.shutdown_timeout(FAREWELL);
        Ok(())
    }
}

/// Starts to listen and to serve on a separate thread; returns its runtime and the addresses for browsers.
pub(crate) fn start(hub: &Arc<Hub>) -> Result<(Runtime, Addresses), SinkError> {
    let failed = |message: String, hint: &str| SinkError::Failed { message, hint: hint.to_owned() };
    let settings = &hub.settings;
    let access = Access::new(settings.listen, &settings.names, &settings.tokens);
    let access =
        access.map_err(|error| failed(error.to_string(), "set `tokens` to a file of tokens"))?;
    let mut builder = Builder::new_multi_thread();
    let runtime = builder.worker_threads(1).thread_name("dashboard").enable_all().build();
    let runtime = runtime.map_err(|error| failed(format!("start its threads: {error}"), ""))?;
    let hint = "choose another `port`, or disable the dashboard with `dashboard = false`";
    let bound = runtime.block_on(server::bind(settings));
    let listener = bound.map_err(|error| failed(error.to_string(), hint))?;
    let address = listener.local_addr().map_err(|error| failed(error.to_string(), hint))?;
    let serving = server::run(listener, Arc::clone(hub), access);
    let outlet = hub.outlet.clone();
    runtime.spawn(async move {
        if let (Err(error), Some(outlet)) = (serving.await, outlet) {
            let label = format!("dashboard: failed to keep serving: {error}");
            outlet.happen(teampulse_core::fault::lasting(label));
        }
    });
    Ok((runtime, Addresses::of(settings, address.port())))
}
