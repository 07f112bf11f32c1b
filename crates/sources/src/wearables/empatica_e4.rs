//! An Empatica E4, read through Empatica's streaming server.

use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_devices::empatica_e4::{E4Session, E4Settings};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::link::Conversation;
use super::session_time::SessionTime;
use super::uses::Use;
use super::worn::Worn;
use crate::SourceContext;

/// The name of the device in a study and in the table of latencies.
pub(super) const DEVICE: &str = "empatica_e4";
/// How long the server may take to accept a connection.
const PATIENCE: Duration = Duration::from_secs(5);

/// An Empatica E4 that a person wears: PPG (64 Hz), skin conductance and temperature (4 Hz), acceleration
/// (32 Hz), intervals between beats, battery, and a marker when its button is pressed.
///
/// It is reached through Empatica's streaming server, a program on the computer with the E4's dongle; that may be this
/// computer or another. The server counts samples from the arrival of the first one, so times are as accurate as its
/// Bluetooth link was then; the stated uncertainty includes this.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EmpaticaE4 {
    /// The person who wears the E4, by pseudonym: `p001`.
    pub person: String,
    /// The address of the streaming server.
    #[serde(default = "server")]
    pub server: String,
    /// The E4's id, such as `9ff167`; by default the first one that the server lists.
    #[serde(default)]
    pub device: Option<String>,
}

fn server() -> String {
    "127.0.0.1:28000".into()
}

impl Component<dyn Source, SourceContext> for EmpaticaE4 {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let port = self.server.rsplit_once(':').and_then(|(_, port)| port.parse::<u16>().ok());
        if port.is_none() {
            let error = SettingsError::new(format!("`{}` is not an address", self.server));
            return Err(error
                .at("server")
                .with_hint("give host and port, such as \"127.0.0.1:28000\""));
        }
        let uses = &context.claims.uses;
        let worn = Worn::new(self.person, DEVICE)?;
        let names = worn.names(uses)?;
        let of_server = [Some(self.server.as_str()), self.device.as_deref()];
        let of_server: Vec<&str> = of_server.into_iter().flatten().collect();
        let device = uses.begin(of_server.join("/")).ok_or_else(|| {
            let error =
                SettingsError::new(format!("two sources read the same E4 of {}", self.server));
            error
                .at("device")
                .with_hint("give each source the id of a different E4, such as \"9ff167\"")
        })?;
        let session = E4Session::new(E4Settings { device: self.device, ..E4Settings::default() });
        let conversation = Conversation { session, worn, clock: SessionTime::start() };
        Ok(Box::new(E4 { server: self.server, conversation, _uses: [names, device] }))
    }
}

/// A running E4.
struct E4 {
    server: String,
    conversation: Conversation<E4Session>,
    _uses: [Use; 2],
}

#[async_trait]
impl Source for E4 {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let connecting = timeout(PATIENCE, TcpStream::connect(&self.server));
        let link = tokio::select! {
            link = connecting => link,
            () = outlet.closed() => return Ok(()),
        };
        let unreached = |why: &str| SourceError::Gone {
            message: format!("reach the E4 streaming server at {}: {why}", self.server),
            hint: "start it, or give its address as `server`".into(),
        };
        let link = link.map_err(|_elapsed| unreached("it does not answer"))?;
        let link = link.map_err(|error| unreached(&error.to_string()))?;
        self.conversation.hold(link, outlet).await
    }
}
