//! A source for a Bluetooth device worn by a person.

use std::collections::VecDeque;
use std::future::Future;
use std::pin::Pin;
use std::time::Duration;

use async_trait::async_trait;
use tokio::sync::mpsc;
use tokio::time::sleep;

use teampulse_core::clock::Stopwatch;
use teampulse_core::command::{Command, Instruction};
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::SettingsError;
use teampulse_core::source::{Source, SourceError};
use teampulse_devices::gatt::Request;
use teampulse_devices::{Error, GattSession, Output};

use super::{Answer, Bluetooth, BluetoothError, GattLink, Seen, Wanted};
use crate::SourceContext;
use crate::wearables::session_time::SessionTime;
use crate::wearables::uses::{Rival, Use, Uses};
use crate::wearables::worn::Worn;

/// The longest time between two checks of the session.
const LOOK: Duration = Duration::from_secs(1);
/// How long a device may take to end its session.
const FAREWELL: Duration = Duration::from_secs(2);
/// The largest number of requests that may wait for a device that does not answer.
const REQUESTS: usize = 256;

/// A protocol over Bluetooth Low Energy, and how its devices are recognised.
pub(in crate::wearables) trait Wearable: GattSession + Send + 'static {
    /// The type of the source in a study, such as `polar`.
    const KIND: &'static str;

    /// The settings of the session in a study.
    type Settings: Send + 'static;

    /// Creates the session with a device, which is done once.
    fn session(settings: &Self::Settings, seen: &Seen) -> Self;

    /// Whether a device in range uses this protocol.
    fn is_kind(seen: &Seen) -> bool;

    /// Returns the device's name in streams and in the table of latencies: `polar_h10`.
    fn device(seen: &Seen) -> &'static str;

    /// Whether the device carries out a command for the person who wears it.
    fn accepts(_command: &Command, _person: &str) -> bool {
        false
    }

    /// Carries out a command that the device accepts.
    fn obey(&mut self, _command: &Command) {}
}

/// Which device a person wears, according to a study.
pub(in crate::wearables) struct Pairing {
    pub person: String,
    pub address: Option<String>,
    pub name: Option<String>,
}

/// A running Bluetooth device. Its session continues when the link is up again.
pub(in crate::wearables) struct Wireless<S: Wearable> {
    bluetooth: Bluetooth,
    uses: Uses,
    wanted: Wanted,
    person: String,
    settings: S::Settings,
    /// `None` until the device is known.
    conversation: Option<Conversation<S>>,
    /// Reserves the device's address, if the study gives one.
    _address: Option<Use>,
}

/// A session with a device that a person wears.
struct Conversation<S> {
    session: S,
    worn: Worn,
    /// The time of the session.
    clock: SessionTime,
    /// Reserves the names of the streams.
    _names: Use,
}

impl<S: Wearable> Wireless<S> {
    pub(in crate::wearables) fn build(
        pairing: Pairing,
        settings: S::Settings,
        context: &SourceContext,
    ) -> Result<Box<dyn Source>, SettingsError> {
        let Pairing { person, address, name } = pairing;
        Worn::check(&person)?;
        let uses = context.claims.uses.clone();
        let address_use = match &address {
            Some(address) => {
                check_address(address)?;
                context.bluetooth.reserve(address);
                Some(only_use(&uses, address)?)
            }
            None => None,
        };
        if address.is_none() && name.is_none() {
            uses.take_any(S::KIND, &person)
                .map_err(|rival| which_is_whose(S::KIND, &person, &rival))?;
        }
        let bluetooth = context.bluetooth.clone();
        let wanted = Wanted { kind: S::KIND, is_kind: S::is_kind, address, name };
        let conversation = None::<Conversation<S>>;
        Ok(Box::new(Wireless {
            bluetooth,
            uses,
            wanted,
            person,
            settings,
            conversation,
            _address: address_use,
        }))
    }
}

impl<S: Wearable> Wireless<S> {
    /// Begins a session with a device that was found.
    fn begin(&self, seen: &Seen) -> Result<Conversation<S>, SourceError> {
        let worn = Worn::of(self.person.clone(), S::device(seen));
        let names = worn.names(&self.uses).map_err(|error| SourceError::Gone {
            message: format!("use {} ({}): {}", seen.name, seen.address, error.message),
            hint: error.hint,
        })?;
        let session = S::session(&self.settings, seen);
        Ok(Conversation { session, worn, clock: SessionTime::start(), _names: names })
    }
}

impl<S: Wearable> Conversation<S> {
    /// Runs the session until the link is lost, the device gives up or the teampulse session is over; the device is
    /// then asked to stop.
    async fn hold(
        &mut self,
        link: &mut GattLink,
        commands: &mut mpsc::Receiver<Instruction>,
        outlet: &Outlet,
    ) -> Result<(), SourceError> {
        let mut requests = VecDeque::new();
        let mut pending: Option<Pending> = None;
        let mut leaving: Option<Stopwatch> = None;
        self.session.start(self.clock.now());
        loop {
            let ended = self.take_outputs(&mut requests, outlet);
            if pending.is_none() {
                let next = requests.pop_front();
                pending = next.map(|request| Box::pin(link.carry_out(request)) as Pending);
            }
            match ended {
                // Requests that the session made at its end, such as to stop measuring, are still carried out.
                Some(result) if pending.is_none() => return result.map_err(gone),
                Some(result) => return farewell(pending, requests, link, result).await,
                None => {}
            }
            if requests.len() > REQUESTS {
                return Err(gone(Error::NoAnswer("requests")));
            }
            if leaving.as_ref().is_some_and(|since| since.elapsed() >= FAREWELL) {
                return Ok(());
            }
            let pause = self.clock.wait(self.session.next_tick(), LOOK);
            tokio::select! {
                value = link.next() => match value {
                    Some((characteristic, value)) => {
                        self.session.receive(characteristic, &value, self.clock.now());
                    }
                    None if leaving.is_some() => return Ok(()),
                    None => return Err(BluetoothError::Lost.into()),
                },
                answer = answer(&mut pending) => {
                    pending = None;
                    self.take_answer(answer);
                }
                Some(instruction) = commands.recv() => self.session.obey(&instruction.command),
                () = sleep(pause) => {}
                () = outlet.closed(), if leaving.is_none() => {
                    leaving = Some(Stopwatch::start());
                    self.session.stop(self.clock.now());
                }
            }
            self.worn.count_lost(link.take_lost(), outlet);
            self.session.tick(self.clock.now());
        }
    }

    fn take_answer(&mut self, answer: Answer) {
        let now = self.clock.now();
        match answer {
            Answer::Done(characteristic, Some(value)) => {
                self.session.receive(characteristic, &value, now);
            }
            Answer::Done(_, None) => {}
            Answer::Failed(characteristic) => self.session.fail(characteristic, now),
        }
    }

    /// Hands over the session's readings and queues its requests; returns the result of the session if it has ended.
    fn take_outputs(
        &mut self,
        requests: &mut VecDeque<Request>,
        outlet: &Outlet,
    ) -> Option<Result<(), Error>> {
        while let Some(output) = self.session.poll() {
            match output {
                Output::Request(request) => requests.push_back(request),
                Output::Stream(stream) => self.worn.declare(&stream, outlet),
                Output::Reading(reading) => self.worn.offer(&reading, outlet),
                Output::Event(event) => self.worn.report(event, outlet),
                Output::Done(result) => return Some(result),
            }
        }
        None
    }
}

/// A request being carried out.
type Pending = Pin<Box<dyn Future<Output = Answer> + Send>>;

/// Returns the answer to the request being carried out; never resolves if there is none.
async fn answer(pending: &mut Option<Pending>) -> Answer {
    match pending {
        Some(pending) => pending.await,
        None => std::future::pending().await,
    }
}

/// Carries out the requests that a session made at its end.
async fn farewell(
    pending: Option<Pending>,
    requests: VecDeque<Request>,
    link: &mut GattLink,
    result: Result<(), Error>,
) -> Result<(), SourceError> {
    let all = async {
        if let Some(pending) = pending {
            pending.await;
        }
        for request in requests {
            link.carry_out(request).await;
        }
    };
    // A device that no longer accepts anything is left as it is.
    drop(tokio::time::timeout(FAREWELL, all).await);
    result.map_err(gone)
}

#[async_trait]
impl<S: Wearable> Source for Wireless<S> {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        // Held so that finding and connecting share one connection to `BlueZ`.
        let bus = tokio::select! {
            bus = self.bluetooth.bus() => bus?,
            () = outlet.closed() => return Ok(()),
        };
        let seen = tokio::select! {
            seen = self.bluetooth.find(&self.wanted) => seen?,
            () = outlet.closed() => return Ok(()),
        };
        // From now on this device is used, even when another of its kind comes into range.
        self.wanted.address = Some(seen.address.clone());
        let conversation = match self.conversation.take() {
            Some(known) => known,
            None => self.begin(&seen)?,
        };
        let conversation = self.conversation.insert(conversation);
        let person = self.person.clone();
        let mut commands = outlet.commands(move |command| S::accepts(command, &person));
        let rssi_dbm = seen.rssi_dbm;
        let (mut link, _hold) = match self.bluetooth.connect(seen, outlet.closed()).await {
            Err(_) if outlet.is_closed() => return Ok(()),
            connected => connected?,
        };
        conversation.worn.link(true, rssi_dbm, outlet);
        let held = conversation.hold(&mut link, &mut commands, outlet).await;
        link.close().await;
        conversation.worn.link(false, None, outlet);
        drop(bus);
        held
    }
}

/// Returns an error of a session after which the device is retried.
fn gone(error: Error) -> SourceError {
    let hint = "is the device switched on, worn and in range?".into();
    SourceError::Gone { message: format!("continue: {error}"), hint }
}

/// Reserves a device for a single source.
fn only_use(uses: &Uses, address: &str) -> Result<Use, SettingsError> {
    uses.begin(format!("device {}", address.to_ascii_uppercase())).ok_or_else(|| {
        let error = SettingsError::new(format!("two sources read the device {address}"));
        error.at("address").with_hint("give each source the address of a different device")
    })
}

fn which_is_whose(kind: &str, person: &str, rival: &Rival) -> SettingsError {
    let message = if rival.kind != kind {
        let other = rival.kind;
        format!("a `{kind}` and a `{other}` without an address may take the same strap")
    } else if rival.person == person {
        format!(
            "two sources of {person} take any `{kind}`: which source takes which device is undefined"
        )
    } else {
        format!("several people have a `{kind}` without an address: who wears which is unknown")
    };
    SettingsError::new(message).at("person").with_hint(
        "give each source the `address` of its device; `teampulse scan` lists the addresses",
    )
}

pub(crate) fn check_address(address: &str) -> Result<(), SettingsError> {
    let is_byte = |byte: &str| byte.len() == 2 && byte.bytes().all(|each| each.is_ascii_hexdigit());
    let bytes: Vec<&str> = address.split(':').collect();
    if bytes.len() == 6 && bytes.into_iter().all(is_byte) {
        return Ok(());
    }
    let error = SettingsError::new(format!("`{address}` is not a Bluetooth address"));
    Err(error.at("address").with_hint("`teampulse scan` lists those in range"))
}
