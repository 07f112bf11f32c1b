use std::time::Duration;

use teampulse_emulators::devices::Notice;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, timeout};
use zbus::Variant;

use super::central::Central;
use super::device::{Answer, Handle, Request};
use super::error::BluezError;
use super::gatt::{GattCharacteristic, GattService};
use super::objects::{DEVICE, Device};
use super::{LinkFault, LinkIncident};

/// How often a device is polled for data: finer than the connection interval of most links.
const TICK: Duration = Duration::from_millis(5);
/// The time between two reported advertisements \[s\].
const ADVERTISE_SECS: f64 = 0.3;
/// The time to connect, and again to discover the services \[s\].
const SETUP_SECS: f64 = 0.05;
/// The time after which a connection attempt to an unresponsive device is given up \[s\].
const CONNECT_PATIENCE_SECS: f64 = 20.0;
/// How long sending a reply to a client may take.
const REPLY_PATIENCE: Duration = Duration::from_secs(1);

/// The radio link of a device, through its states: advertised, connected, resolved and lost.
pub(super) struct Link {
    device: Handle,
    incidents: Vec<LinkIncident>,
    /// Whether BlueZ has an object for the device.
    is_known: bool,
    /// Whether the signal strength of its last advertisement is still valid.
    is_heard: bool,
    connecting: Option<Connecting>,
    resolve_secs: Option<f64>,
    advertised_secs: f64,
    advertisements: u32,
    away_until_secs: f64,
    silent_until_secs: f64,
}

struct Connecting {
    since_secs: f64,
    answers: Vec<Answer>,
}

impl Link {
    /// Creates a link; `incidents` are in order of time.
    pub fn new(device: Handle, incidents: Vec<LinkIncident>) -> Self {
        Self {
            device,
            incidents,
            is_known: false,
            is_heard: false,
            connecting: None,
            resolve_secs: None,
            advertised_secs: f64::NEG_INFINITY,
            advertisements: 0,
            away_until_secs: f64::NEG_INFINITY,
            silent_until_secs: f64::NEG_INFINITY,
        }
    }

    /// Runs until the bus is closed.
    pub async fn run(mut self, mut requests: mpsc::Receiver<Request>) -> zbus::Result<()> {
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = ticks.tick() => self.tick().await?,
                Some(request) = requests.recv() => self.request(request).await?,
            }
        }
    }

    fn central(&self) -> &Central {
        self.device.central()
    }

    fn is_connected(&self) -> bool {
        self.device.state().is_connected
    }

    async fn request(&mut self, request: Request) -> zbus::Result<()> {
        match request {
            Request::Connect(answer) => {
                self.connect(answer);
                return Ok(());
            }
            Request::Disconnect(answer, replied) => {
                if self.is_connected() || self.connecting.is_some() {
                    _ = answer.send(Ok(()));
                    _ = timeout(REPLY_PATIENCE, replied).await;
                    self.lose().await?;
                } else {
                    _ = answer.send(Err(BluezError::NotConnected("Not Connected".into())));
                }
            }
            Request::Remove(answer) => {
                self.lose().await?;
                self.central_objects().remove::<Device, _>(self.device.path()).await?;
                self.is_known = false;
                _ = answer.send(Ok(()));
            }
            Request::Suffer(fault, answer) => {
                self.suffer(fault).await?;
                _ = answer.send(Ok(()));
            }
        }
        Ok(())
    }

    fn connect(&mut self, answer: Answer) {
        let refusal = || BluezError::Failed("Resource Not Ready".into());
        if !self.central().is_powered() {
            _ = answer.send(Err(refusal()));
        } else if self.is_connected() {
            _ = answer.send(Ok(()));
        } else {
            let since_secs = self.central().now_secs();
            let connecting = Connecting { since_secs, answers: Vec::new() };
            self.connecting.get_or_insert(connecting).answers.push(answer);
        }
    }

    async fn tick(&mut self) -> zbus::Result<()> {
        let now_secs = self.central().now_secs();
        if self.incidents.first().is_some_and(|incident| incident.at_secs <= now_secs) {
            let incident = self.incidents.remove(0);
            self.suffer(incident.fault).await?;
        }
        for notice in self.device.sent() {
            match notice {
                Notice::Value(characteristic, value) if now_secs >= self.silent_until_secs => {
                    self.device.value(characteristic, value).await?;
                }
                Notice::Value(..) => {}
                Notice::LinkLost => self.lose().await?,
            }
        }
        if now_secs >= self.away_until_secs {
            self.establish(now_secs).await?;
            self.advertise(now_secs).await?;
        }
        self.give_up(now_secs);
        Ok(())
    }

    async fn suffer(&mut self, fault: LinkFault) -> zbus::Result<()> {
        let now_secs = self.central().now_secs();
        match fault {
            LinkFault::Drop => self.lose().await?,
            LinkFault::Away(secs) => {
                self.away_until_secs = now_secs + secs;
                self.lose().await?;
            }
            LinkFault::Silence(secs) => self.silent_until_secs = now_secs + secs,
        }
        Ok(())
    }

    /// Carries out the steps of a connection when they are due.
    async fn establish(&mut self, now_secs: f64) -> zbus::Result<()> {
        let is_due = |one: &mut Connecting| now_secs >= one.since_secs + SETUP_SECS;
        if let Some(connecting) = self.connecting.take_if(is_due) {
            self.device.state().is_connected = true;
            self.device_changed("Connected", true).await?;
            // BlueZ, too, answers before the services are known.
            connecting.answers.into_iter().for_each(|answer| _ = answer.send(Ok(())));
            self.resolve_secs = Some(now_secs + SETUP_SECS);
        }
        if self.resolve_secs.take_if(|at_secs| now_secs >= *at_secs).is_some() {
            self.add_services().await?;
            self.device.state().is_resolved = true;
            self.device_changed("ServicesResolved", true).await?;
        }
        Ok(())
    }

    fn give_up(&mut self, now_secs: f64) {
        let is_late = |one: &mut Connecting| now_secs >= one.since_secs + CONNECT_PATIENCE_SECS;
        if let Some(connecting) = self.connecting.take_if(is_late) {
            refuse(connecting);
        }
    }

    async fn advertise(&mut self, now_secs: f64) -> zbus::Result<()> {
        if self.is_heard && !self.central().is_discovering() {
            self.is_heard = false;
            return self.central().invalidated(self.device.path(), DEVICE, "RSSI").await;
        }
        let is_due = now_secs >= self.advertised_secs + ADVERTISE_SECS;
        if !is_due || self.is_connected() || !self.central().is_discovering() {
            return Ok(());
        }
        self.advertised_secs = now_secs;
        self.advertisements += 1;
        let rssi_dbm = -60 - (self.advertisements % 3) as i16;
        self.device.state().rssi_dbm = rssi_dbm;
        self.is_heard = true;
        if self.is_known {
            let value = Variant::from(rssi_dbm);
            return self.central().changed(self.device.path(), DEVICE, "RSSI", value).await;
        }
        self.is_known = true;
        self.central_objects().at(self.device.path(), Device(self.device.clone())).await?;
        Ok(())
    }

    /// Ends the link and reports it in the order that BlueZ uses.
    async fn lose(&mut self) -> zbus::Result<()> {
        self.resolve_secs = None;
        if let Some(connecting) = self.connecting.take() {
            refuse(connecting);
        }
        let was_resolved = {
            let mut state = self.device.state();
            if !state.is_connected {
                return Ok(());
            }
            state.peripheral.disconnect();
            state.listeners.clear();
            state.values.clear();
            state.is_connected = false;
            std::mem::replace(&mut state.is_resolved, false)
        };
        if was_resolved {
            self.device_changed("ServicesResolved", false).await?;
        }
        self.device_changed("Connected", false).await?;
        if was_resolved {
            self.remove_services().await?;
        }
        Ok(())
    }

    async fn device_changed(&self, property: &str, value: bool) -> zbus::Result<()> {
        self.central().changed(self.device.path(), DEVICE, property, Variant::from(value)).await
    }

    fn central_objects(&self) -> &zbus::ObjectServer {
        self.central().connection.object_server()
    }

    async fn add_services(&self) -> zbus::Result<()> {
        let objects = self.central_objects();
        for service in self.device.services() {
            let path = self.device.service_path(service.handle);
            let device = self.device.clone();
            objects.at(path, GattService { device, service: *service }).await?;
            for entry in service.characteristics {
                let path = self.device.entry_path(service.handle, entry.handle);
                let (device, service) = (self.device.clone(), service.handle);
                objects.at(path, GattCharacteristic { device, service, entry: *entry }).await?;
            }
        }
        Ok(())
    }

    async fn remove_services(&self) -> zbus::Result<()> {
        let objects = self.central_objects();
        for service in self.device.services() {
            for entry in service.characteristics {
                let path = self.device.entry_path(service.handle, entry.handle);
                objects.remove::<GattCharacteristic, _>(path).await?;
            }
            let path = self.device.service_path(service.handle);
            objects.remove::<GattService, _>(path).await?;
        }
        Ok(())
    }
}

fn refuse(connecting: Connecting) {
    for answer in connecting.answers {
        _ = answer.send(Err(BluezError::Failed("le-connection-abort-by-local".into())));
    }
}
