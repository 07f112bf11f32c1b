//! The models of clocks, with hindsight too: any stamps, probes and ticks.

use teampulse_timefilter::clock::{
    ClockModel, Host, Latency, OneWay, OneWaySettings, Probe, Remote, SampleIndex, Smoother,
    StampOf, Stamps,
};

use crate::bytes::Bytes;

/// The most reports that wait.
const MOST_EVENTS: usize = 16;

pub fn drive(bytes: &mut Bytes<'_>) {
    let latency = Latency::new(bytes.number(), bytes.number());
    let wraps_nanos = if bytes.flag() { Some(bytes.time()) } else { None };
    let settings = OneWaySettings {
        wraps_nanos,
        usual_skew_ppm: bytes.number(),
        ..OneWaySettings::new(latency)
    };
    let rate_hz = bytes.number();
    let mut models: [Box<dyn ClockModel>; 4] = [
        Box::new(Host::default()),
        Box::new(OneWay::new(settings)),
        Box::new(SampleIndex::new(rate_hz, latency)),
        Box::new(Remote::default()),
    ];
    let mut smoothers = [Smoother::new(settings), Smoother::of_samples(rate_hz, latency)];
    let mut device = Device { begun: bytes.nanos(), index: 0 };
    let mut all = Vec::new();
    while !bytes.is_over() {
        let stamps = device.stamps(bytes);
        for model in &mut models {
            step(model.as_mut(), &stamps);
            match bytes.below(16) {
                0 => model.tick(bytes.time()),
                1 => model.probe(&probe(bytes)),
                _ => {}
            }
        }
        for smoother in &mut smoothers {
            smoother.push(&stamps);
        }
        all.push(stamps);
    }
    for smoother in smoothers {
        let mut smoothed = smoother.finish();
        for stamps in &all {
            step(&mut smoothed, stamps);
        }
    }
}

fn step(model: &mut dyn ClockModel, stamps: &Stamps) {
    model.correct(stamps);
    model.state();
    let events = std::iter::from_fn(|| model.next_event()).count();
    assert!(events <= MOST_EVENTS, "{events}");
}

fn probe(bytes: &mut Bytes<'_>) -> Probe {
    Probe { arrival: bytes.time(), offset_secs: bytes.number(), round_trip_secs: bytes.number() }
}

/// The stamps of a device whose clock and counter are wrong at times.
struct Device {
    begun: i64,
    index: u64,
}

impl Device {
    fn stamps(&mut self, bytes: &mut Bytes<'_>) -> Stamps {
        let (arrival, way) = (bytes.time(), bytes.byte());
        let ticks = arrival.wrapping_sub(self.begun);
        let count = u32::from(bytes.byte() >> 4);
        self.index = self.index.wrapping_add(u64::from(count));
        if way >> 2 == 0 {
            self.begun = bytes.time();
            self.index = bytes.integer() as u64;
        }
        Stamps {
            device: match way & 3 {
                0 => Some(bytes.time()),
                1 => None,
                _ => Some(ticks.saturating_sub(bytes.nanos())),
            },
            source: if way & 4 == 0 { None } else { Some(bytes.time()) },
            stamp_of: match way >> 4 & 3 {
                0 => StampOf::Sent,
                1 => StampOf::Measured,
                _ => StampOf::Kept,
            },
            arrival,
            stream: 0,
            index: self.index,
            count: if way == 8 { u32::MAX } else { count },
            period_nanos: bytes.number(),
        }
    }
}
