//! The analysis of intervals reported by a device, such as a heart rate strap.

use std::collections::VecDeque;

use super::repeats::Repeats;
use super::{Domain, HeartWindows, Treatment};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::SignalError;
use crate::intervals::Edit;

/// The longest accepted interval [ms].
const LONGEST_MS: f64 = 60_000.0;
/// The largest difference between the sum of intervals and the host's time [s]: straps report two or three
/// intervals at once, about once a second. Beyond it, intervals were lost.
const MOST_ASTRAY_SECS: f64 = 1.5;
/// The shortest hole that marks lost intervals [ns].
const LEAST_HOLE_NS: i64 = 1_000_000;
/// Above this share of repeated intervals a span has no variability.
const MOST_REPEATED: f64 = 0.1;

/// Settings of the interval analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The domains to compute; all by default.
    pub domains: Vec<Domain>,
    /// The treatment of artefacts; corrected by default.
    pub treatment: Treatment,
    /// Manual edits of single beats, in seconds since the start of the first interval; whole recordings only.
    pub edits: Vec<Edit>,
    /// How far the sum of intervals may be from the times at which they are reported [s]: 1.5 by default, as straps
    /// report two or three intervals at once. Beyond it, intervals were lost. If the times are those of the beats
    /// themselves, a value below one interval detects every lost one.
    pub most_astray_secs: f64,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            domains: Domain::ALL.to_vec(),
            treatment: Treatment::Corrected,
            edits: Vec::new(),
            most_astray_secs: MOST_ASTRAY_SECS,
        }
    }
}

/// Computes the variability of intervals [ms] as they arrive in the first channel; see [`HeartWindows`].
///
/// An interval ends with a beat (event `beat`, detail `interval_ms`), and the next begins there. Host times only place
/// the first one, and reveal lost intervals by differing from the sum of the intervals since by more than
/// [`Settings::most_astray_secs`]. Where the sum is ahead by more, one interval is left out and the next begins at the
/// host's time. An interval that is NaN, not positive or over a minute also leaves a hole. Sixteen or more equal
/// intervals in a row are those of a device that repeats one: the quality of a span is reduced by their share, and if
/// they exceed a tenth, its variability is withheld, but not its means. The rate is ignored; there are no errors.
/// Limits: a single lost interval that is not reported as lost remains undetected.
pub fn causal(settings: &Settings, _rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    let heart = HeartWindows::causal().only(&settings.domains).treated(settings.treatment);
    Ok(Box::new(Intervals {
        windows: IntervalWindows { heart, repeats: Repeats::default() },
        chain: Chain::new(settings),
        count: 0,
        events: VecDeque::new(),
    }))
}

/// Computes the variability of a recording. A second channel gives the time at which each interval ended [s after the
/// recording began], like the times of [`causal`]. Without it, and where it is NaN, the first interval begins with the
/// recording, each other where the last ended, and a lost interval takes the length of the interval before it,
/// initially a second. The rate is ignored.
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let intervals_ms = recording.channels.first().map_or(&[][..], Vec::as_slice);
    let beat_ns = |sample: usize| {
        let end_secs = recording.channels.get(1)?.get(sample).filter(|secs| secs.is_finite())?;
        Some(recording.begin_ns.saturating_add((end_secs * 1e9).round() as i64))
    };
    let (mut beats_ns, mut holes, mut events) = (Vec::new(), Vec::new(), Vec::new());
    let (mut chain, mut repeats) = (Chain::new(settings), Repeats::default());
    let (mut end_ns, mut usual_ns) = (recording.begin_ns, 1_000_000_000);
    for (sample, &interval_ms) in intervals_ms.iter().enumerate() {
        let interval_ns = nanos(interval_ms);
        usual_ns = interval_ns.unwrap_or(usual_ns);
        end_ns = beat_ns(sample).unwrap_or_else(|| end_ns.saturating_add(usual_ns));
        let Some(placed) = chain.place(end_ns, interval_ns) else { continue };
        holes.extend(placed.hole);
        beats_ns.extend(placed.begin_ns);
        beats_ns.push(placed.end_ns);
        if let Some(interval_ns) = interval_ns {
            repeats.push(placed.end_ns, interval_ns);
        }
        events.push(beat(sample, placed.end_ns, interval_ms));
    }
    let heart = HeartWindows::whole(recording.begin_ns, &beats_ns, &holes, &settings.edits);
    let heart = heart.only(&settings.domains).treated(settings.treatment);
    Ok(Whole { events, windows: Box::new(IntervalWindows { heart, repeats }) })
}

/// The store of a device's intervals.
struct IntervalWindows {
    heart: HeartWindows,
    repeats: Repeats,
}

impl IntervalWindows {
    /// The values of a span, without the variability of repeated intervals; the quality is reduced by their share.
    fn judged(&self, mut measured: Measured, span: Span) -> Measured {
        let share = self.repeats.share(span);
        measured.quality *= 1.0 - share;
        if share > MOST_REPEATED {
            self.heart.withhold_variability(&mut measured.values);
        }
        measured
    }
}

impl Windows for IntervalWindows {
    fn values(&self) -> &[Value] {
        self.heart.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.judged(self.heart.measure(span), span)
    }

    fn measure_again(&self, span: Span, last: &Measured) -> Measured {
        self.judged(self.heart.measure_again(span, last), span)
    }
}

struct Intervals {
    windows: IntervalWindows,
    chain: Chain,
    count: usize,
    events: VecDeque<Event>,
}

impl Windows for Intervals {
    fn values(&self) -> &[Value] {
        self.windows.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.windows.measure(span)
    }

    fn measure_again(&self, span: Span, last: &Measured) -> Measured {
        self.windows.measure_again(span, last)
    }
}

impl Causal for Intervals {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let interval_ms = channels.first().copied().unwrap_or(f64::NAN);
        let interval_ns = nanos(interval_ms);
        if let Some(placed) = self.chain.place(at_ns, interval_ns) {
            let IntervalWindows { heart, repeats } = &mut self.windows;
            if let Some((from_ns, to_ns)) = placed.hole {
                heart.mark_gap(from_ns, to_ns);
            }
            placed.begin_ns.into_iter().for_each(|begin_ns| heart.push(begin_ns));
            heart.push(placed.end_ns);
            if let Some(interval_ns) = interval_ns {
                repeats.push(placed.end_ns, interval_ns);
            }
            self.events.push_back(beat(self.count, placed.end_ns, interval_ms));
        }
        self.count += 1;
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.windows.heart.forget(before_ns);
        self.windows.repeats.forget(before_ns);
    }
}

fn nanos(interval_ms: f64) -> Option<i64> {
    let is_one = interval_ms > 0.0 && interval_ms <= LONGEST_MS;
    is_one.then(|| (interval_ms * 1e6).round() as i64)
}

fn beat(sample: usize, at_ns: i64, interval_ms: f64) -> Event {
    let details = vec![("interval_ms", interval_ms)];
    Event { kind: "beat", sample: sample as f64, at_ns, details }
}

/// Places intervals one after the other.
struct Chain {
    most_astray_ns: i64,
    last_ns: Option<i64>,
    is_broken: bool,
}

/// The position of an interval.
struct Placed {
    /// The hole before the interval [ns].
    hole: Option<(i64, i64)>,
    /// The beat at the start of the interval, if that is not the end of the last one [ns].
    begin_ns: Option<i64>,
    /// The beat at the end of the interval [ns].
    end_ns: i64,
}

impl Chain {
    fn new(settings: &Settings) -> Chain {
        let most_astray_ns = (settings.most_astray_secs * 1e9).round() as i64;
        Chain { most_astray_ns, last_ns: None, is_broken: false }
    }

    /// Appends the next interval [ns], reported at a time; `None` if the interval is lost.
    fn place(&mut self, at_ns: i64, interval_ns: Option<i64>) -> Option<Placed> {
        let Some(interval_ns) = interval_ns else {
            self.is_broken = true;
            return None;
        };
        let placed = match self.last_ns {
            Some(last_ns) if !self.is_broken => {
                let end_ns = last_ns.saturating_add(interval_ns);
                let ahead_ns = end_ns.saturating_sub(at_ns);
                if ahead_ns.saturating_abs() <= self.most_astray_ns {
                    Placed { hole: None, begin_ns: None, end_ns }
                } else if ahead_ns > 0 {
                    return self.go_back_to(at_ns, last_ns);
                } else {
                    after_hole(at_ns, interval_ns, Some(last_ns))
                }
            }
            last_ns => after_hole(at_ns, interval_ns, last_ns),
        };
        self.last_ns = Some(placed.end_ns);
        self.is_broken = false;
        Some(placed)
    }

    /// Places a beat at the time of its report, because the sum of the intervals is too far ahead: an earlier interval
    /// was reported too late, and none was lost. `None` if the last beat was placed after that time.
    fn go_back_to(&mut self, at_ns: i64, last_ns: i64) -> Option<Placed> {
        if at_ns < last_ns.saturating_add(LEAST_HOLE_NS) {
            self.is_broken = true;
            return None;
        }
        self.last_ns = Some(at_ns);
        Some(Placed { hole: Some((last_ns, at_ns)), begin_ns: None, end_ns: at_ns })
    }
}

/// Places an interval after lost ones, or the first one.
fn after_hole(at_ns: i64, interval_ns: i64, last_ns: Option<i64>) -> Placed {
    let earliest_ns = last_ns.map_or(i64::MIN, |ns| ns.saturating_add(LEAST_HOLE_NS));
    let begin_ns = at_ns.saturating_sub(interval_ns).max(earliest_ns);
    Placed {
        hole: last_ns.map(|last_ns| (last_ns, begin_ns)),
        begin_ns: Some(begin_ns),
        end_ns: begin_ns.saturating_add(interval_ns),
    }
}
