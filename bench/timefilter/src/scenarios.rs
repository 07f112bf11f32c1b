//! Measures how close clock models come to the truth over links of every kind, live and with hindsight, and how well
//! they know their own uncertainty; and the results of LSL and `pyxdf` for the same arrivals.
//!
//! The error of a packet is the larger one of its first and last sample, after a constant is subtracted for the
//! session: the fixed latency, which stamps cannot show. For accuracy it is the median of the errors, for peers, too. For
//! coverage the median is weighted by the inverse square of what is stated: errors that may be tens of milliseconds
//! reveal nothing about the latency. For computers' clocks nothing is subtracted. There is one line per kind; the worst
//! seed counts.

use std::error::Error;
use std::fs::{File, OpenOptions};
use std::io::Write;

use teampulse_timefilter::clock::{
    ClockEvent, ClockModel, Latency, OneWay, OneWaySettings, Remote, SampleIndex, Smoother,
};

use crate::links::{KINDS, Kind, P95, Packet, Session, Stamped, What, peers};

/// The time after which errors count [s].
const WARM_UP_SECS: f64 = 60.0;
/// The length of a session [s].
const SECONDS: f64 = 2700.0;
/// The size below which errors are ignored: the stated uncertainty need not be finer [ms].
const FINE_MS: f64 = 0.1;
/// The longest delay of a report after an incident for it to count [ns].
const OF_IT_NANOS: i64 = 120_000_000_000;
const TICK_NANOS: i64 = 100_000_000;

/// What is printed besides the worst figures.
struct Shown {
    /// Whether to print the figures and events of each session.
    verbose: bool,
    /// The file for a line per packet, live and then with hindsight: its arrival [s], its error, the stated
    /// uncertainty, and its delay [ms].
    errors_to: Option<String>,
}

/// Measures kinds of links: `KIND|all FIRST_SEED SEEDS [SECONDS [verbose [FILE]]]`; returns whether every bar is met.
pub fn measure(arguments: &[String]) -> Result<bool, Box<dyn Error>> {
    let [name, first, seeds, rest @ ..] = arguments else {
        return Err("expected a kind, the first seed, and the number of seeds".into());
    };
    let (first, seeds): (u64, u64) = (first.parse()?, seeds.parse()?);
    let secs = rest.first().map_or(Ok(SECONDS), |secs| secs.parse())?;
    let shown = Shown { verbose: rest.len() > 1, errors_to: rest.get(2).cloned() };
    let mut passed = true;
    for kind in KINDS.iter().filter(|kind| name == "all" || kind.name == name) {
        let mut worst = Worst::default();
        for seed in first..first + seeds {
            let figures = kind.figures(seed, secs, &shown);
            if shown.verbose {
                println!("  seed {seed}: {figures:.3?}");
            }
            worst.add(&figures);
        }
        passed &= worst.print(kind);
    }
    Ok(passed)
}

/// The figures of a session.
#[derive(Debug)]
struct Figures {
    live: Timed,
    afterwards: Option<Timed>,
    lsl_ms: f64,
    pyxdf_ms: f64,
    /// The number of reported events that did not happen.
    false_events: usize,
    /// The number of incidents that were not reported.
    unreported: usize,
    /// The longest delay of a report [s of data].
    reported_secs: f64,
}

/// How accurate the times of a session are.
#[derive(Clone, Copy, Debug)]
struct Timed {
    p95_ms: f64,
    /// The share of packets whose error is within the stated uncertainty [%].
    covered: f64,
    /// The median stated uncertainty [ms].
    stated_ms: f64,
}

impl Kind {
    fn figures(&self, seed: u64, secs: f64, shown: &Shown) -> Figures {
        let mut session = self.session(seed, secs);
        session.errors_to.clone_from(&shown.errors_to);
        let mut reported = Vec::new();
        let live = session.timed(session.model().as_mut(), &mut reported);
        let afterwards = session.smoother().map(|mut smoother| {
            for packet in &session.packets {
                smoother.push(&packet.stamps);
            }
            session.timed(&mut smoother.finish(), &mut Vec::new())
        });
        let (false_events, unreported, reported_secs) = session.events(&reported);
        if shown.verbose {
            println!("  seed {seed}, {:?}: {:?}", session.stamped, session.happened);
            for (at, event) in &reported {
                println!("    {:.2} s: {event}", (at - session.start()) as f64 / 1e9);
            }
        }
        let lsl_ms = session.peer(&peers::lsl(&session));
        let pyxdf_ms = session.peer(&peers::pyxdf(&session));
        Figures { live, afterwards, lsl_ms, pyxdf_ms, false_events, unreported, reported_secs }
    }
}

impl Session {
    fn model(&self) -> Box<dyn ClockModel> {
        let latency = Latency::new(0.0, 0.0);
        match self.stamped {
            Stamped::Device => Box::new(OneWay::new(OneWaySettings::new(latency))),
            Stamped::Number(rate_hz) => Box::new(SampleIndex::new(rate_hz, latency)),
            Stamped::Computer => Box::new(Remote::default()),
        }
    }

    fn smoother(&self) -> Option<Smoother> {
        let latency = Latency::new(0.0, 0.0);
        match self.stamped {
            Stamped::Device => Some(Smoother::new(OneWaySettings::new(latency))),
            Stamped::Number(rate_hz) => Some(Smoother::of_samples(rate_hz, latency)),
            Stamped::Computer => None,
        }
    }

    fn start(&self) -> i64 {
        self.packets.first().map_or(0, |packet| packet.stamps.arrival)
    }

    /// Whether an error at this time counts.
    fn counts(&self, at: i64) -> bool {
        let settling = self.happened.iter().any(|happened| {
            let since = (at - happened.at) as f64 / 1e9;
            (-0.5..happened.settles_secs).contains(&since)
        });
        !settling && (at - self.start()) as f64 / 1e9 > WARM_UP_SECS
    }

    fn timed(&self, model: &mut dyn ClockModel, reported: &mut Vec<(i64, ClockEvent)>) -> Timed {
        let mut probes = self.probes.iter().peekable();
        let mut tick = self.start() / TICK_NANOS;
        let (mut errors, mut states) = (Vec::new(), Vec::new());
        for packet in &self.packets {
            let arrival = packet.stamps.arrival;
            while let Some(probe) = probes.next_if(|probe| probe.arrival <= arrival) {
                model.probe(probe);
            }
            while tick < arrival / TICK_NANOS {
                tick += 1;
                model.tick(tick * TICK_NANOS);
            }
            let corrected = model.correct(&packet.stamps);
            let span = f64::from(packet.stamps.count - 1) * corrected.period_nanos;
            let last = corrected.measured + span.round() as i64;
            errors.push(((corrected.measured - packet.first) as f64, (last - packet.last) as f64));
            states.push(model.state().uncertainty_secs * 1e9);
            reported
                .extend(std::iter::from_fn(|| model.next_event()).map(|event| (arrival, event)));
        }
        let counted = |packet: &Packet| self.counts(packet.stamps.arrival);
        let counting: Vec<bool> = self.packets.iter().map(counted).collect();
        let kept = errors.iter().zip(&states).zip(&counting).filter(|(_, counts)| **counts);
        let mut lasts: Vec<(f64, f64)> =
            kept.map(|(((_, last), state), _)| (*last, *state)).collect();
        let (constant, latency) = match self.stamped {
            Stamped::Computer => (0.0, 0.0),
            _ => (weighted_median(&mut lasts, |_| 1.0), weighted_median(&mut lasts, certainty)),
        };
        let (mut counted, mut stated, mut covered, mut all) = (Vec::new(), Vec::new(), 0, 0);
        let warm = self.start() + (WARM_UP_SECS * 1e9) as i64;
        for (place, ((first, last), state)) in errors.iter().zip(&states).enumerate() {
            let error = |constant: f64| (first - constant).abs().max((last - constant).abs());
            if counting[place] {
                counted.push(error(constant));
                stated.push(*state);
            }
            if self.packets[place].stamps.arrival > warm {
                all += 1;
                covered += i32::from(error(latency) <= *state);
            }
        }
        if let Some(file) = &mut self.errors_to.as_ref().and_then(append) {
            let rows = errors.iter().zip(&states).zip(&self.packets);
            for (((_, last), state), packet) in rows {
                let at = (packet.stamps.arrival - self.start()) as f64 / 1e9;
                let (error, stated) = ((last - latency) / 1e6, state / 1e6);
                let delay = (packet.stamps.arrival - packet.last) as f64 / 1e6;
                let row = format!("{at:.3} {error:.4} {stated:.4} {delay:.4}\n");
                if file.write_all(row.as_bytes()).is_err() {
                    break;
                }
            }
        }
        Timed {
            p95_ms: quantile(&mut counted, 0.95) / 1e6,
            covered: f64::from(covered) / f64::from(all) * 100.0,
            stated_ms: quantile(&mut stated, 0.5) / 1e6,
        }
    }

    /// Returns the 95th percentile of a peer's errors [ms].
    fn peer(&self, times: &[f64]) -> f64 {
        let start = self.start();
        let counted = self.packets.iter().zip(times);
        let counted = counted.filter(|(packet, _)| self.counts(packet.stamps.arrival));
        let error = |(packet, secs): (&Packet, &f64)| secs * 1e9 - (packet.last - start) as f64;
        let mut errors: Vec<f64> = counted.map(error).collect();
        let constant = quantile(&mut errors.clone(), 0.5);
        for error in &mut errors {
            *error = (*error - constant).abs();
        }
        quantile(&mut errors, 0.95) / 1e6
    }

    /// Returns the numbers of false reports and of unreported incidents, and the longest delay of the others.
    fn events(&self, reported: &[(i64, ClockEvent)]) -> (usize, usize, f64) {
        let is_of = |at: i64, event: &ClockEvent, what: What| match (event, what) {
            (
                ClockEvent::Jumped { .. } | ClockEvent::Restarted { .. },
                What::Set | What::MayBeTold,
            )
            | (ClockEvent::WrongRate { .. }, What::WrongRate)
            | (ClockEvent::Fast { .. }, What::Fast) => at > 0,
            _ => false,
        };
        let ours = |at: i64, event: &ClockEvent| {
            self.happened.iter().any(|happened| {
                is_of(at, event, happened.what) && (0..OF_IT_NANOS).contains(&(at - happened.at))
            })
        };
        let is_claim = |event: &ClockEvent| {
            !matches!(event, ClockEvent::Off { .. } | ClockEvent::Trusted | ClockEvent::Wrapped)
        };
        let false_events =
            reported.iter().filter(|(at, event)| is_claim(event) && !ours(*at, event)).count();
        let (mut unreported, mut latest) = (0, 0.0_f64);
        for happened in self.happened.iter().filter(|happened| happened.what != What::MayBeTold) {
            let first = self.packets.iter().find(|packet| packet.first >= happened.at);
            let Some(first) = first else { continue };
            let after = reported.iter().filter(|(at, _)| *at >= happened.at);
            let found =
                after.filter(|(at, event)| is_of(*at, event, happened.what)).min_by_key(|t| t.0);
            match found.filter(|(at, _)| at - happened.at < OF_IT_NANOS + 1_200_000_000_000) {
                Some((at, _)) => latest = latest.max((at - first.stamps.arrival) as f64 / 1e9),
                None => unreported += 1,
            }
        }
        (false_events, unreported, latest)
    }
}

/// The worst figures of several sessions.
#[derive(Default)]
struct Worst {
    live: WorstTimed,
    afterwards: WorstTimed,
    of_pyxdf: f64,
    of_pyxdf_afterwards: f64,
    lsl_ms: f64,
    pyxdf_ms: f64,
    false_events: usize,
    unreported: usize,
    reported_secs: f64,
    sessions: usize,
}

#[derive(Default)]
struct WorstTimed {
    p95_ms: f64,
    uncovered: f64,
    wide: f64,
    sessions: usize,
}

impl WorstTimed {
    fn add(&mut self, timed: &Timed) {
        self.p95_ms = worse(self.p95_ms, timed.p95_ms);
        self.uncovered = worse(self.uncovered, 100.0 - timed.covered);
        self.wide = worse(self.wide, timed.stated_ms / timed.p95_ms.max(FINE_MS));
        self.sessions += 1;
    }

    fn print(&self, bar: &str) -> String {
        format!(
            "p95 {:.3} ms{bar}, covered {:.1} %, stated {:.1} × p95",
            self.p95_ms,
            100.0 - self.uncovered,
            self.wide
        )
    }
}

impl Worst {
    fn add(&mut self, figures: &Figures) {
        self.live.add(&figures.live);
        self.of_pyxdf = worse(self.of_pyxdf, figures.live.p95_ms / figures.pyxdf_ms);
        if let Some(afterwards) = &figures.afterwards {
            self.afterwards.add(afterwards);
            let of_pyxdf = afterwards.p95_ms / figures.pyxdf_ms;
            self.of_pyxdf_afterwards = worse(self.of_pyxdf_afterwards, of_pyxdf);
        }
        self.lsl_ms = worse(self.lsl_ms, figures.lsl_ms);
        self.pyxdf_ms = worse(self.pyxdf_ms, figures.pyxdf_ms);
        self.false_events += figures.false_events;
        self.unreported += figures.unreported;
        self.reported_secs = self.reported_secs.max(figures.reported_secs);
        self.sessions += 1;
    }

    fn print(&self, kind: &Kind) -> bool {
        let mut passed = self.events(kind);
        let timed = [("live", &self.live, self.of_pyxdf)];
        let later = (self.afterwards.sessions > 0).then_some((
            "with hindsight",
            &self.afterwards,
            self.of_pyxdf_afterwards,
        ));
        for (when, timed, of_pyxdf) in timed.into_iter().chain(later) {
            let (bar, near) = match kind.bars.p95 {
                P95::Millis(most) => (format!(" (bar {most})"), timed.p95_ms <= most),
                P95::OfPyxdf(most) => {
                    (format!(", {of_pyxdf:.2} of pyxdf's (bar {most})"), of_pyxdf <= most)
                }
                P95::Any => (String::new(), true),
            };
            let covers =
                100.0 - timed.uncovered >= kind.bars.coverage && timed.wide <= kind.bars.wide;
            let good = near && covers;
            let wide = match kind.bars.wide {
                most if most.is_finite() => format!(", {most} ×"),
                _ => String::new(),
            };
            println!(
                "{}  {}, {when}: {} (bars {} %{wide})",
                mark(good),
                kind.name,
                timed.print(&bar),
                kind.bars.coverage
            );
            passed &= good;
        }
        println!(
            "note  {}, peers: LSL online {:.1} ms, pyxdf {:.1} ms; {}",
            kind.name, self.lsl_ms, self.pyxdf_ms, kind.doc
        );
        passed
    }

    fn events(&self, kind: &Kind) -> bool {
        let good = self.false_events == 0
            && self.unreported == 0
            && self.reported_secs <= kind.bars.reported_secs;
        println!(
            "{}  {}, events: {} false, {} not reported, the rest within {:.2} s of data (bar {} s) in {} \
             sessions",
            mark(good),
            kind.name,
            self.false_events,
            self.unreported,
            self.reported_secs,
            kind.bars.reported_secs,
            self.sessions
        );
        good
    }
}

fn append(path: &String) -> Option<File> {
    OpenOptions::new().create(true).append(true).open(path).ok()
}

/// Returns the larger one; NaN counts as the worst.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

fn mark(good: bool) -> &'static str {
    if good { "pass" } else { "FAIL" }
}

/// The median of errors, each weighted by what is stated of it.
fn weighted_median(errors: &mut [(f64, f64)], weight: fn(f64) -> f64) -> f64 {
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = errors.iter().map(|(_, stated)| weight(*stated)).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let middle = errors.iter().find(|(_, stated)| {
        sum += weight(*stated);
        sum >= half
    });
    middle.map_or(f64::NAN, |(error, _)| *error)
}

/// How much an error shows of the fixed latency, by what is stated of it [ns].
fn certainty(stated: f64) -> f64 {
    if stated.is_nan() { 0.0 } else { (stated / 1e6).max(FINE_MS).powi(-2) }
}

fn quantile(values: &mut [f64], at: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (values.len().max(1) - 1) as f64 * at;
    values.get(place.round() as usize).copied().unwrap_or(f64::NAN)
}
