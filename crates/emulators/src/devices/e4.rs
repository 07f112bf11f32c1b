//! The streaming server of the Empatica E4, with one E4: lines of text over TCP.
//!
//! Based on the server's protocol pages, and on what pyEmpatica accepts.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Wearer;
use super::faults::in_order;

/// The ID of the E4.
const ID: &str = "9ff167";

/// The Unix time at the start, unless another is set \[s\].
const EPOCH_SECS: f64 = 1_460_377_850.0;

/// The subscription, line and rate \[Hz\] of each sampled signal.
const SIGNALS: [(&str, &str, f64); 5] = [
    ("bvp", "E4_Bvp", 64.0),
    ("acc", "E4_Acc", 32.0),
    ("gsr", "E4_Gsr", 4.0),
    ("tmp", "E4_Temperature", 4.0),
    ("bat", "E4_Battery", 0.2),
];

/// A fault at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct E4Incident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: E4Fault,
}

/// A fault, or another occurrence.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum E4Fault {
    /// The radio link to the E4 is lost.
    LinkLost,
    /// The link is up again; samples from the meantime are lost.
    LinkBack,
    /// The server stops sending subscribed signals until they are subscribed to again.
    Stall,
    /// The wearer presses the button.
    Press,
}

/// An E4 streaming server. Times are true seconds since it was started, and never go back.
#[derive(Debug)]
pub struct E4Server {
    epoch_secs: f64,
    has_decimal_comma: bool,
    incidents: Vec<E4Incident>,
    now_secs: f64,
    line: Vec<u8>,
    sent: VecDeque<u8>,
    is_connected: bool,
    /// The reasons why the server sends no samples.
    silent: Vec<Silence>,
    subscribed: Vec<String>,
    /// The number of the next sample of each signal.
    next: [u64; SIGNALS.len()],
    last_beat_secs: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Silence {
    Paused,
    LinkLost,
    Stalled,
}

impl Default for E4Server {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

impl E4Server {
    /// Creates a server with faults, which may be in any order.
    pub fn new(incidents: Vec<E4Incident>) -> Self {
        Self {
            epoch_secs: EPOCH_SECS,
            has_decimal_comma: false,
            incidents: in_order(incidents, |incident| incident.at_secs),
            now_secs: 0.0,
            line: Vec::new(),
            sent: VecDeque::new(),
            is_connected: false,
            silent: Vec::new(),
            subscribed: Vec::new(),
            next: [0; SIGNALS.len()],
            last_beat_secs: None,
        }
    }

    /// Returns the server, started at this Unix time \[s\].
    #[must_use]
    pub fn started_at(self, epoch_secs: f64) -> Self {
        Self { epoch_secs, ..self }
    }

    /// Returns the server on a Windows that writes numbers with a decimal comma.
    #[must_use]
    pub fn with_decimal_comma(self) -> Self {
        Self { has_decimal_comma: true, ..self }
    }

    fn silence(&mut self, why: Silence, is_on: bool) {
        self.silent.retain(|one| *one != why);
        if is_on {
            self.silent.push(why);
        }
    }

    /// Handles requests, split anywhere.
    pub fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if *byte == b'\n' {
                let line = std::mem::take(&mut self.line);
                self.request(String::from_utf8_lossy(&line).trim());
            } else {
                self.line.push(*byte);
            }
        }
    }

    fn request(&mut self, line: &str) {
        let words: Vec<&str> = line.split(' ').collect();
        match words.as_slice() {
            ["device_list"] => self.say(&format!("R device_list 1 | {ID} Empatica_E4")),
            ["device_connect", ID] => {
                self.is_connected = true;
                self.say("R device_connect OK");
            }
            ["device_connect", ..] => {
                self.say("R device_connect ERR The requested device is not available");
            }
            ["device_disconnect"] => {
                self.is_connected = false;
                self.subscribed.clear();
                self.say("R device_disconnect OK");
            }
            ["pause", word @ ("ON" | "OFF")] => {
                self.silence(Silence::Paused, *word == "ON");
                self.say(&format!("R pause {word}"));
            }
            ["device_subscribe", signal, _] if !self.is_connected => {
                self.say(&format!(
                    "R device_subscribe {signal} ERR You are not connected to any device"
                ));
            }
            ["device_subscribe", signal, switch] => {
                self.subscribed.retain(|one| one != signal);
                if *switch == "ON" {
                    self.subscribed.push((*signal).to_owned());
                }
                self.silence(Silence::Stalled, false);
                self.say(&format!("R device_subscribe {signal} OK"));
            }
            _ => self.say(&format!("R {} ERR Unknown command", words.first().unwrap_or(&""))),
        }
    }

    fn say(&mut self, line: &str) {
        self.sent.extend(line.bytes().chain(*b"\r\n"));
    }

    /// Returns the data that the server sends until a time \[s\].
    pub fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<u8> {
        loop {
            let samples = SIGNALS.iter().zip(&self.next).enumerate();
            let due = samples.map(|(at, ((.., rate_hz), next))| (*next as f64 / rate_hz, Some(at)));
            let incident = self.incidents.first().map(|incident| (incident.at_secs, None));
            let next = due.chain(incident).min_by(|(one, _), (other, _)| one.total_cmp(other));
            let Some((at_secs, signal)) = next.filter(|(at_secs, _)| *at_secs <= secs) else {
                break;
            };
            self.now_secs = at_secs;
            match signal {
                Some(signal) => self.sample(signal, wearer),
                None => self.suffer(),
            }
        }
        self.sent.drain(..).collect()
    }

    fn suffer(&mut self) {
        match self.incidents.remove(0).fault {
            E4Fault::LinkLost => {
                self.silence(Silence::LinkLost, true);
                self.say(&format!("R connection lost to device {ID}"));
            }
            E4Fault::LinkBack => {
                self.silence(Silence::LinkLost, false);
                self.say(&format!("R connection re-established to device {ID}"));
            }
            E4Fault::Stall => self.silence(Silence::Stalled, true),
            E4Fault::Press => self.data("tag", "E4_Tag", &[]),
        }
    }

    fn sample(&mut self, at: usize, wearer: &mut dyn Wearer) {
        let (Some(next), Some((subscription, word, _))) = (self.next.get_mut(at), SIGNALS.get(at))
        else {
            return;
        };
        *next += 1;
        let secs = self.now_secs;
        let values = match *subscription {
            "bvp" => vec![wearer.light(secs)],
            // In units of 1/64 g.
            "acc" => wearer.acceleration_mg(secs).map(|mg| (mg * 0.064).round()).to_vec(),
            "gsr" => vec![wearer.conductance_us(secs)],
            "tmp" => vec![wearer.temperature_c(secs)],
            _ => vec![0.87],
        };
        self.data(subscription, word, &values);
        if *subscription == "gsr" {
            self.beats(wearer);
        }
    }

    /// Adds intervals and heart rates, stamped with their beats.
    fn beats(&mut self, wearer: &mut dyn Wearer) {
        let after_secs = self.last_beat_secs.unwrap_or(self.now_secs - 1.0);
        for beat_secs in wearer.beats(after_secs, self.now_secs) {
            if let Some(last_secs) = self.last_beat_secs.replace(beat_secs) {
                let now_secs = std::mem::replace(&mut self.now_secs, beat_secs);
                self.data("ibi", "E4_Ibi", &[beat_secs - last_secs]);
                self.data("ibi", "E4_Hr", &[60.0 / (beat_secs - last_secs)]);
                self.now_secs = now_secs;
            }
        }
    }

    fn data(&mut self, subscription: &str, word: &str, values: &[f64]) {
        let subscribed = self.subscribed.iter().any(|one| one == subscription);
        if !subscribed || !self.silent.is_empty() {
            return;
        }
        let mut line = format!("{word} {:.6}", self.epoch_secs + self.now_secs);
        for value in values {
            line.push(' ');
            line.push_str(&value.to_string());
        }
        if self.has_decimal_comma {
            line = line.replace('.', ",");
        }
        self.say(&line);
    }
}
