use std::time::Duration;

use super::{HeartRateMeasurement, MEASUREMENT, RR_INTERVAL_MS};
use crate::gatt::Request;
use crate::outbox::Outbox;
use crate::{Channel, Event, Reading, Stream};

/// How far the sum of intervals may fall short of the elapsed time before intervals count as missing: they arrive up to
/// four seconds late.
const MAY_LACK: Duration = Duration::from_secs(3);

/// Turns notifications of the Heart Rate Measurement characteristic into readings.
#[derive(Debug, Default)]
pub(crate) struct HeartRateReceiver {
    heart_rates: u64,
    intervals: u64,
    /// Whether the stream of intervals is declared.
    has_intervals: bool,
    energies: u64,
    account: Option<BeatAccount>,
}

/// The elapsed time, compared with the sum of the received intervals.
#[derive(Debug)]
struct BeatAccount {
    since: Duration,
    accounted: Duration,
    least_lacking: Duration,
}

impl HeartRateReceiver {
    pub fn start(&mut self, out: &mut Outbox<Request>) {
        let channels = vec![Channel::new("heart_rate", "1/min"), Channel::new("contact", "")];
        out.stream(by_beats("heart_rate", channels));
        if std::mem::take(&mut self.has_intervals) {
            self.expect_intervals(out);
        }
        if self.account.take().is_some() {
            out.event(Event::Gap { stream: "rr_interval", samples: None });
        }
        out.request(Request::Subscribe(MEASUREMENT));
    }

    /// Declares the stream of intervals, for a device that is known to send some. Otherwise it is declared when the
    /// first ones arrive, as optical sensors send none.
    pub fn expect_intervals(&mut self, out: &mut Outbox<Request>) {
        if !std::mem::replace(&mut self.has_intervals, true) {
            let interval = Channel::new("rr_interval", "ms").scaled(RR_INTERVAL_MS);
            out.stream(by_beats("rr_interval", vec![interval]));
        }
    }

    /// Handles a value; returns whether it is a measurement.
    pub fn receive(&mut self, value: &[u8], now: Duration, out: &mut Outbox<Request>) -> bool {
        let Ok(measurement) = HeartRateMeasurement::decode(value) else {
            out.discarded("heart_rate", value.len());
            return false;
        };
        let contact = measurement.contact.map_or(f64::NAN, |touches| f64::from(u8::from(touches)));
        let values = vec![f64::from(measurement.heart_rate_bpm), contact];
        out.reading(Reading::untimed("heart_rate", self.heart_rates, values));
        self.heart_rates += 1;
        if let Some(energy_kj) = measurement.energy_kj {
            self.receive_energy(energy_kj, out);
        }
        self.receive_intervals(&measurement.rr_intervals, now, out);
        true
    }

    fn receive_energy(&mut self, energy_kj: u16, out: &mut Outbox<Request>) {
        if self.energies == 0 {
            let channels = vec![Channel::new("energy_expended", "kJ")];
            out.stream(Stream::irregular("energy_expended", channels));
        }
        let values = vec![f64::from(energy_kj)];
        out.reading(Reading::untimed("energy_expended", self.energies, values));
        self.energies += 1;
    }

    fn receive_intervals(&mut self, intervals: &[u16], now: Duration, out: &mut Outbox<Request>) {
        if intervals.is_empty() {
            return;
        }
        self.expect_intervals(out);
        let sum = intervals.iter().map(|steps| u64::from(*steps)).sum::<u64>();
        let sum = Duration::from_nanos(sum * 1_000_000_000 / 1024);
        if BeatAccount::is_short(&mut self.account, sum, now) {
            out.event(Event::Gap { stream: "rr_interval", samples: None });
        }
        let values = intervals.iter().map(|steps| f64::from(*steps)).collect();
        out.reading(Reading::untimed("rr_interval", self.intervals, values));
        self.intervals += intervals.len() as u64;
    }
}

/// Describes a stream of the measurements, whose only clock is the beats.
fn by_beats(name: &'static str, channels: Vec<Channel>) -> Stream {
    Stream { by_beats: true, ..Stream::irregular(name, channels) }
}

impl BeatAccount {
    /// Whether intervals are missing before the given ones, which end at `now` and last for `sum`.
    fn is_short(account: &mut Option<Self>, sum: Duration, now: Duration) -> bool {
        if let Some(account) = account {
            account.accounted = account.accounted.saturating_add(sum);
            let lacking = now.saturating_sub(account.since).saturating_sub(account.accounted);
            account.least_lacking = account.least_lacking.min(lacking);
            if lacking.saturating_sub(account.least_lacking) <= MAY_LACK {
                return false;
            }
        }
        let new = Self { since: now, accounted: Duration::ZERO, least_lacking: Duration::ZERO };
        account.replace(new).is_some()
    }
}
