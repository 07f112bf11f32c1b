//! A session with a device over a byte stream.

use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::SourceError;
use teampulse_devices::{ByteSession, Output};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::{sleep, timeout};

use super::session_time::SessionTime;
use super::worn::Worn;

/// The longest time between two checks of the session.
const LOOK: Duration = Duration::from_secs(1);
/// How long a device may take to accept written bytes.
const WRITE_PATIENCE: Duration = Duration::from_secs(5);
/// How long a device may take to end its session.
const FAREWELL: Duration = Duration::from_secs(2);

/// A session with a device that a person wears. It continues when the link is up again.
pub(super) struct Conversation<S> {
    pub(super) session: S,
    pub(super) worn: Worn,
    /// The time of the session.
    pub(super) clock: SessionTime,
}

impl<S: ByteSession> Conversation<S> {
    /// Runs the session over a link until the link is lost, the device gives up or the teampulse session is over; the
    /// device is then asked to stop.
    pub(super) async fn hold<L>(&mut self, mut link: L, outlet: &Outlet) -> Result<(), SourceError>
    where
        L: AsyncRead + AsyncWrite + Unpin,
    {
        self.session.start(self.clock.now());
        let mut bytes = [0; 4096];
        let mut leaving: Option<Stopwatch> = None;
        loop {
            if self.carry_out(&mut link, outlet).await? {
                return Ok(());
            }
            if leaving.as_ref().is_some_and(|since| since.elapsed() >= FAREWELL) {
                return Ok(());
            }
            let pause = self.clock.wait(self.session.next_tick(), LOOK);
            tokio::select! {
                read = link.read(&mut bytes) => match read {
                    Ok(0) if leaving.is_some() => return Ok(()),
                    Ok(0) => return Err(gone("continue: the connection was closed")),
                    Ok(count) => {
                        let now = self.clock.now();
                        self.session.receive(bytes.get(..count).unwrap_or_default(), now);
                    }
                    Err(error) => return Err(gone(&format!("read from the device: {error}"))),
                },
                () = sleep(pause) => {}
                () = outlet.closed(), if leaving.is_none() => {
                    leaving = Some(Stopwatch::start());
                    self.session.stop(self.clock.now());
                }
            }
            self.session.tick(self.clock.now());
        }
    }

    /// Carries out the session's requests and hands over its readings; returns whether it has ended.
    async fn carry_out<L>(&mut self, link: &mut L, outlet: &Outlet) -> Result<bool, SourceError>
    where
        L: AsyncWrite + Unpin,
    {
        while let Some(output) = self.session.poll() {
            match output {
                Output::Request(request) => {
                    let written = timeout(WRITE_PATIENCE, link.write_all(&request)).await;
                    let late = |_| gone("write to the device: it accepts no data");
                    let failed = |error| gone(&format!("write to the device: {error}"));
                    written.map_err(late)?.map_err(failed)?;
                }
                Output::Stream(stream) => self.worn.declare(&stream, outlet),
                Output::Reading(reading) => self.worn.offer(&reading, outlet),
                Output::Event(event) => self.worn.report(event, outlet),
                Output::Done(result) => {
                    let failed = |error| gone(&format!("continue: {error}"));
                    return result.map(|()| true).map_err(failed);
                }
            }
        }
        Ok(false)
    }
}

/// Returns an error after which the device is retried.
fn gone(message: &str) -> SourceError {
    SourceError::Gone {
        message: message.to_owned(),
        hint: "is the device switched on and near?".into(),
    }
}
