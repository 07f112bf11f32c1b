//! Sessions of which all is known, over links of every kind that devices and computers have.
//!
//! [`KINDS`] is the table. A session is a function of its kind, its seed and its length. Settings of
//! the clock models were chosen on seeds 1 to 110, 501 to 510 and 601 to 610; figures are of seeds 301
//! to 310, on which nothing was chosen.

mod random;
mod oscillator;
mod packet_paths;
mod devices;
mod computers;
mod mixture;
pub mod peers;

use teampulse_timefilter::clock::{Probe, Stamps};

/// A kind of link.
pub struct Kind {
    /// What it is called on the command line.
    pub name: &'static str,
    /// What it is, and what is random in it.
    pub doc: &'static str,
    /// What must be reached.
    pub bars: Bars,
    /// Makes a session of this many seconds.
    pub make: fn(&mut random::Random, f64) -> Session,
}

impl Kind {
    /// The session of a seed.
    pub fn session(&self, seed: u64, secs: f64) -> Session {
        (self.make)(&mut random::Random::new(self.name, seed), secs)
    }
}

/// What must be reached on a kind of link.
#[derive(Clone, Copy)]
pub struct Bars {
    /// The 95th percentile of errors [ms].
    pub p95: P95,
    /// How many packets are within what is stated [%].
    pub coverage: f64,
    /// What is stated in the median, as a multiple of the 95th percentile.
    pub wide: f64,
    /// The longest allowed delay of a report [s of data].
    pub reported_secs: f64,
}

/// What the 95th percentile of errors may be.
#[derive(Clone, Copy)]
pub enum P95 {
    /// This much [ms].
    Millis(f64),
    /// This much of what `pyxdf` reaches.
    OfPyxdf(f64),
    /// There is no bar.
    Any,
}

/// A session over a link.
pub struct Session {
    /// How its stamps are to be understood.
    pub stamped: Stamped,
    /// What arrived, in order.
    pub packets: Vec<Packet>,
    /// Exchanges with the computer's clock, in order.
    pub probes: Vec<Probe>,
    /// Incidents of the clock: these must be reported, and nothing else.
    pub happened: Vec<Happened>,
    /// The nominal rate of packets [Hz].
    pub packet_hz: f64,
    /// Where errors are written to, if at all.
    pub errors_to: Option<String>,
}

/// How stamps are to be understood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stamped {
    /// By a device's clock.
    Device,
    /// By numbers, of nominally this many samples a second.
    Number(f64),
    /// By another computer's clock.
    Computer,
}

/// A reading, and its truth.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// What is known of it.
    pub stamps: Stamps,
    /// When its first sample was measured [ns].
    pub first: i64,
    /// When its last sample was measured [ns].
    pub last: i64,
}

/// Something that happened to a clock.
#[derive(Clone, Copy, Debug)]
pub struct Happened {
    /// When [ns].
    pub at: i64,
    /// What.
    pub what: What,
    /// How long errors after it do not count [s].
    pub settles_secs: f64,
}

/// What happened to a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// It was set.
    Set,
    /// It was set, or is off, by a small amount: a report is optional.
    MayBeTold,
    /// It is known from the start that its rate is not the declared one.
    WrongRate,
    /// It is known from the start that it runs as no quartz does.
    Fast,
}

/// When sessions begin [s since the Unix epoch].
const START_SECS: i64 = 1_700_000_000;

/// The time of a moment of a session [ns].
fn nanos(secs: f64) -> i64 {
    START_SECS * 1_000_000_000 + (secs * 1e9).round() as i64
}

const COVERED: f64 = 95.0;

const fn within(p95: P95) -> Bars {
    Bars { p95, coverage: COVERED, wide: 3.0, reported_secs: 1.0 }
}

/// Without a bar for the width: what a computer's stamps do not show of the way is stated, however
/// short that is; and five minutes are too short for what is stated at first to come down.
const fn however_wide(p95: P95, coverage: f64) -> Bars {
    Bars { coverage, wide: f64::INFINITY, ..within(p95) }
}

/// All kinds of links.
pub const KINDS: &[Kind] = &[
    Kind {
        name: "strap",
        doc: "ECG at 130 Hz in batches of 73 over BLE; drop-outs of 1 to 6 s, sent afterwards",
        bars: within(P95::Millis(3.0)),
        make: devices::strap,
    },
    Kind {
        name: "motion",
        doc: "52 Hz over BLE: 7.5 to 50 ms, slave latency, drift of 3 ppm, warm-up of 20 ppm",
        bars: within(P95::Millis(1.0)),
        make: devices::motion,
    },
    Kind {
        name: "wifi",
        doc: "50 Hz over Wi-Fi: Pareto tails, stalls of 2 s",
        bars: within(P95::Millis(0.5)),
        make: devices::wifi,
    },
    Kind {
        name: "camera",
        doc: "30 Hz over USB, read-out of 33 ms",
        bars: within(P95::Millis(0.5)),
        make: devices::camera,
    },
    Kind {
        name: "route",
        doc: "100 Hz over a network whose route takes 80 ms more for 5 minutes",
        bars: within(P95::Millis(2.0)),
        make: devices::route,
    },
    Kind {
        name: "one_hz",
        doc: "1 Hz over BLE, of an interval that does not divide the second",
        bars: within(P95::Millis(10.0)),
        make: devices::one_hz,
    },
    Kind {
        name: "beating",
        doc: "10 or 20 Hz over BLE at 50 ms: packets beat with connection events",
        bars: within(P95::OfPyxdf(0.5)),
        make: devices::beating,
    },
    Kind {
        name: "saturated",
        doc: "52 Hz over BLE that carries less for 1 to 4 minutes at a time: delays of seconds",
        bars: within(P95::OfPyxdf(0.5)),
        make: devices::saturated,
    },
    Kind {
        name: "usb_poll",
        doc: "125 Hz on a USB port polled each 8 ms",
        bars: within(P95::Millis(4.0)),
        make: devices::usb_poll,
    },
    Kind {
        name: "wrong_rate",
        doc: "numbered samples over BLE whose rate is a quarter to four times the declared one",
        bars: Bars { reported_secs: 10.0, ..within(P95::Millis(10.0)) },
        make: devices::wrong_rate,
    },
    Kind {
        name: "set",
        doc: "52 Hz over BLE; the clock is set back and ahead by 50 to 600 ms, right after 2 s",
        bars: within(P95::Millis(1.0)),
        make: devices::set,
    },
    Kind {
        name: "perfect_clocks",
        doc: "perfect clocks, 1 to 200 packets a second, 1 to 100 samples each, 5 minutes",
        bars: however_wide(P95::Any, COVERED),
        make: devices::perfect,
    },
    Kind {
        name: "fast",
        doc: "10 packets a second over Wi-Fi from a clock that is 900 to 2000 ppm off, and said to be",
        bars: Bars { reported_secs: 15.0, ..within(P95::Millis(3.0)) },
        make: devices::fast,
    },
    Kind {
        name: "silence",
        doc: "52 Hz over BLE with silences of up to 20 minutes, resets and duplicates",
        bars: within(P95::Millis(1.0)),
        make: devices::silence,
    },
    Kind {
        name: "robot_stall",
        doc: "a robot's messages at 20 Hz over Wi-Fi with stalls of up to 4 s",
        bars: however_wide(P95::Millis(50.0), 99.0),
        make: computers::robot_stall,
    },
    Kind {
        name: "robot_step",
        doc: "a robot whose clock NTP steps by 20 to 500 ms and slews by up to 100 ppm; probes",
        bars: however_wide(P95::Millis(5.0), COVERED),
        make: computers::robot_step,
    },
    Kind {
        name: "two_laptops",
        doc: "a computer 0.6 s and 40 ppm off, with probes",
        bars: however_wide(P95::Millis(5.0), 99.0),
        make: computers::two_laptops,
    },
    Kind {
        name: "backlog",
        doc: "a person's waves from another computer; 10 s without a network, sent afterwards",
        bars: however_wide(P95::Millis(50.0), 99.0),
        make: computers::backlog,
    },
    Kind {
        name: "mixture",
        doc: "a random mixture of all that: clocks, rates, batches, packet paths, losses, duplicates",
        bars: within(P95::Any),
        make: mixture::mixture,
    },
];
