//! A Shimmer3 GSR+: a pseudoterminal in place of its serial port.

use std::io;
use std::path::PathBuf;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Stopwatch;
use teampulse_emulators::devices::{Shimmer, ShimmerSettings, Wearer};
use tokio::time::interval;

use super::wardrobe::Dressed;
use super::{Emulation, check_clock};
use crate::serial::Pty;

/// How often devices are polled.
pub(super) const GRAIN: Duration = Duration::from_millis(5);
/// The largest number of bytes that wait for a slow reader; more are lost, as on a radio link.
const MOST_WAITING: usize = 4096;

/// A Shimmer3 GSR+ that a simulated person wears at the fingers, on a pseudoterminal in place of a serial port.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EmulatedShimmer {
    /// The person who wears it: `p001`.
    pub person: String,
    /// The path of a link to the port, such as `/tmp/shimmer`; by default the port has the name that the system
    /// assigns.
    #[serde(default)]
    pub port: Option<PathBuf>,
    /// The properties and faults of the device itself.
    #[serde(default)]
    pub device: ShimmerSettings,
}

impl EmulatedShimmer {
    pub(super) fn open(&self, worn: Dressed) -> io::Result<Emulation> {
        check_clock(self.device.clock_fast)?;
        let settings = self.device.clone();
        let pty = Pty::open(self.port.as_deref()).map_err(|error| match &self.port {
            Some(port) => {
                io::Error::other(format!("the link {} can't be created: {error}", port.display()))
            }
            None => error,
        })?;
        let address = pty.path().to_owned();
        let serving = async move {
            let mut shimmer = Shimmer::new(settings);
            let Dressed { mut wearer, clock } = worn;
            serve_shimmer(&pty, &mut shimmer, &mut wearer, clock).await
        };
        Ok(Emulation {
            device: format!("Shimmer3 GSR+ of {}", self.person),
            study: format!(
                "[[sources]]\ntype   = \"shimmer3\"\nperson = \"{}\"\nport   = \"{address}\"",
                self.person
            ),
            address,
            serving: Box::pin(serving),
        })
    }
}

/// Serves a Shimmer on a port in real time. It keeps streaming when no program listens.
pub async fn serve_shimmer(
    pty: &Pty,
    shimmer: &mut Shimmer,
    wearer: &mut (dyn Wearer + Send),
    clock: Stopwatch,
) -> io::Result<()> {
    let mut ticks = interval(GRAIN);
    let (mut received, mut waiting) = (Vec::new(), Vec::new());
    loop {
        ticks.tick().await;
        let is_open = pty.read(&mut received)?;
        shimmer.receive(&received);
        received.clear();
        let sent = shimmer.until(clock.elapsed().as_secs_f64(), wearer);
        if !is_open {
            waiting.clear();
            continue;
        }
        if waiting.len() + sent.len() <= MOST_WAITING {
            waiting.extend(sent);
        }
        let written = pty.write(&waiting)?;
        waiting.drain(..written);
    }
}
