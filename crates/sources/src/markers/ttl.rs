//! TTL codes received over a serial line.

use std::collections::BTreeMap;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use tokio::io::AsyncReadExt;

use super::mark;
use crate::SourceContext;
use crate::serial::SerialPort;

/// Markers from a trigger box on a serial port: each byte is a code, like those that stimulus programs send to EEG
/// amplifiers.
///
/// A marker's time is its arrival. FTDI USB adapters hold bytes back for up to 16 ms: `echo 1 | sudo tee
/// /sys/bus/usb-serial/devices/ttyUSB0/latency_timer` reduces that to 1 ms.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ttl {
    /// The serial port: `/dev/ttyUSB0`.
    pub port: String,
    /// The speed of the serial port \[bit/s\].
    #[serde(default = "baud")]
    pub baud: u32,
    /// The labels of codes: `{ 1 = "stimulus", 2 = "response" }`. Any other code is labelled `ttl` and the code.
    #[serde(default)]
    pub labels: BTreeMap<String, String>,
    /// Codes that set no marker: by default 0, which resets the line.
    #[serde(default = "ignored")]
    pub ignored: Vec<u8>,
}

fn baud() -> u32 {
    115_200
}

fn ignored() -> Vec<u8> {
    vec![0]
}

impl Component<dyn Source, SourceContext> for Ttl {
    const EXAMPLE: &'static str =
        "port = \"/dev/ttyUSB0\"\nlabels = { 1 = \"stimulus\", 2 = \"response\" }";

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let mut labels = BTreeMap::new();
        for (code, label) in &self.labels {
            let Ok(number) = code.parse::<u8>() else {
                let error = SettingsError::new(format!("`{code}` is not a code"));
                return Err(error.at("labels").with_hint("codes are numbers from 0 to 255"));
            };
            labels.insert(number, label.clone());
        }
        let Ttl { port, baud, ignored, .. } = self;
        Ok(Box::new(TtlLine { port, baud, labels, ignored }))
    }
}

/// A serial line that carries codes.
struct TtlLine {
    port: String,
    baud: u32,
    labels: BTreeMap<u8, String>,
    ignored: Vec<u8>,
}

impl TtlLine {
    fn take(&self, code: u8, outlet: &Outlet) {
        if !self.ignored.contains(&code) {
            let label = self.labels.get(&code).cloned().unwrap_or_else(|| format!("ttl {code}"));
            mark(label, code.into(), outlet.clock().now(), outlet);
        }
    }
}

#[async_trait]
impl Source for TtlLine {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let opening = SerialPort::open(&self.port, self.baud);
        let opened = tokio::select! {
            opened = opening => opened,
            () = outlet.closed() => return Ok(()),
        };
        let mut port = opened
            .map_err(|error| SourceError::Gone { message: error.to_string(), hint: error.hint })?;
        let mut bytes = [0; 256];
        loop {
            let read = tokio::select! {
                read = port.read(&mut bytes) => read,
                () = outlet.closed() => return Ok(()),
            };
            let count = match read {
                Ok(0) => return Err(self.gone("it was unplugged")),
                Ok(count) => count,
                Err(error) => return Err(self.gone(&error.to_string())),
            };
            bytes.iter().take(count).for_each(|code| self.take(*code, outlet));
        }
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}

impl TtlLine {
    fn gone(&self, why: &str) -> SourceError {
        let message = format!("read codes at {}: {why}", self.port);
        SourceError::Gone { message, hint: "is the trigger box plugged in?".into() }
    }
}
