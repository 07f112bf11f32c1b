//! The clock model of another computer, which stamps its messages itself.

mod line;
mod envelope;
mod bursts;
mod strangers;
mod backlog;
mod shift;
mod doubt;

use std::collections::VecDeque;

use self::backlog::Backlogs;
use self::bursts::Bursts;
use self::doubt::Doubt;
use self::envelope::{Envelope, Found};
use self::line::LinearFit;
use self::shift::Shift;
use self::strangers::Strangers;
use super::{ClockKind, ClockModel, ClockState, Corrected, News, Probe, Says, Stamps};

/// A computer may be ahead by so much and still be trusted: clocks that are kept in step over a
/// network differ by less [ns].
const TRUSTED_AHEAD_NANOS: i64 = 2_000_000;
/// A computer may seem to be behind by so much and still be trusted, as its messages may have been
/// on their way for that long [ns].
const TRUSTED_BEHIND_NANOS: i64 = 50_000_000;
/// So much sooner than any message before may one be, and still be of the same clock [ns].
const SOONER_NANOS: i64 = 100_000_000;
/// So much later than the fastest may a message be, and still be believed [ns].
const LATER_NANOS: i64 = 1_000_000_000;
/// How long stamps must agree before their clock is taken to be known [ns].
const KNOWN_NANOS: i64 = 500_000_000;
/// How long all stamps must be elsewhere before the clock is taken to have jumped [ns].
const JUMPED_NANOS: i64 = 3_000_000_000;
/// What the fastest message may have taken, and no one-way stamp can show [ns].
const PATH_NANOS: f64 = 10e6;
/// What a sample that a device measured may have taken to the computer that stamps it [ns]: the way of a
/// sensor, a batch apart.
const SENSED_NANOS: f64 = 300e6;
/// The most reports that wait.
const NEWS: usize = 16;

/// Another computer that stamps its messages.
///
/// The fastest of its messages show how far its clock is off: if their stamps lie after their arrival it is
/// ahead, and if even they seem old it is behind, or the path is long. A clock less than 2 ms ahead and
/// less than 50 ms behind is trusted: its stamps are used as they are. The stamps of any other are shifted
/// by the estimated offset. With probes the offset is known to half their round trip, and one of more than
/// 2 ms, or of more than its uncertainty, is corrected.
///
/// Stamps after their arrival mean a clock that is ahead: only the delay is unknown then, and assumed to be
/// within 10 ms. Stamps before their arrival may mean a clock that is behind as well as messages that are
/// sent late, which cannot be distinguished without probes: the stated uncertainty is then all of that time
/// and the delay. It grows by corrections that are still pending and by what the last messages and bursts
/// of probes say against the known line, as after a jump.
///
/// The shift follows offset and skew by slewing, so that within an epoch later stamps have later
/// times. A stamp that is more than a second older than the fastest would be, unless it goes on in
/// order where its stream was (what a network held up), or more than 0.1 s younger, is not believed,
/// and moves nothing. When all stamps are like that for three seconds the
/// clock has jumped. A stamp of zero is none.
///
/// Stamps that say when a device measured something ([`Says::Measured`]) lie behind their arrival by the
/// device's way, so they show a clock that is ahead, and never one that is behind: without probes, and
/// without messages that say when they were sent, they are taken as they are, and nothing is known of the
/// clock.
///
/// No time lies more than 2 ms after its arrival.
#[derive(Clone, Debug, Default)]
pub struct Remote {
    envelope: Envelope,
    bursts: Bursts,
    strangers: Strangers,
    backlogs: Backlogs,
    shift: Shift,
    doubt: Doubt,
    /// Whether any stamp said when its message was sent.
    hears_sending: bool,
    /// `None` until its clock is known.
    trusted: Option<bool>,
    epoch: u32,
    now: i64,
    news: VecDeque<News>,
}

impl ClockModel for Remote {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let arrival = stamps.arrival;
        self.pass(arrival);
        let arrived = |disbelieved| Corrected {
            measured: arrival,
            period_nanos: stamps.period_nanos,
            disbelieved,
        };
        let Some(source) = stamps.source.filter(|source| *source != 0) else {
            return arrived(false);
        };
        if source < 0 {
            self.doubt.disbelieve();
            return arrived(true);
        }
        if stamps.says == Says::Kept {
            let measured = self.shift.of(source).min(arrival.saturating_add(TRUSTED_AHEAD_NANOS));
            return Corrected { measured, ..arrived(false) };
        }
        let last = source.saturating_add(stamps.span_nanos() as i64);
        let delay = arrival.saturating_sub(last);
        self.hears_sending |= stamps.says == Says::Sent;
        let is_held_up = self.is_held_up(stamps, last, delay);
        if !is_held_up {
            self.consider(delay, stamps.says);
            let believed = self.believes(delay);
            self.backlogs.judged(stamps.stream, last, believed);
            if !believed {
                self.doubt.disbelieve();
                return arrived(true);
            }
        }
        let shows = !is_held_up && self.shows_the_way(delay, stamps.says);
        if let Some(offset) = self.offset().filter(|_| shows) {
            self.compare(delay, offset);
            self.envelope.push(arrival, delay);
        }
        let shifted = self.shift.apply(source);
        let measured = shifted.min(arrival.saturating_add(TRUSTED_AHEAD_NANOS));
        Corrected { measured, period_nanos: stamps.period_nanos, disbelieved: false }
    }

    fn probe(&mut self, probe: &Probe) {
        self.pass(probe.arrival);
        self.bursts.push(probe);
    }

    fn tick(&mut self, now: i64) {
        self.pass(now);
    }

    fn state(&self) -> ClockState {
        let (kind, known) = match self.probed() {
            Some(probed) => (ClockKind::TwoWay, Some(probed)),
            None => (ClockKind::Remote, self.envelope.line().map(LinearFit::reversed)),
        };
        let nanos = known.map_or(f64::NAN, |line| line.at(self.now) as f64);
        let steady = match kind {
            ClockKind::TwoWay => self.bursts.knows_skew(),
            _ => self.envelope.knows_skew(),
        };
        ClockState {
            kind,
            epoch: self.epoch,
            offset_secs: nanos * 1e-9,
            skew_ppm: known.filter(|_| steady).map_or(f64::NAN, |line| line.slope * 1e6),
            jitter_secs: self.envelope.spread_nanos() * 1e-9,
            uncertainty_secs: self.uncertainty_nanos() * 1e-9,
        }
    }

    fn news(&mut self) -> Option<News> {
        self.news.pop_front()
    }
}

impl Remote {
    /// The most memory that one takes, itself included [B]; a vector that grows is there twice for
    /// a moment.
    pub const MOST_BYTES: usize = size_of::<Remote>()
        + 2 * (Envelope::BYTES + Bursts::BYTES + Shift::BYTES + NEWS * size_of::<News>());

    /// Time passes.
    fn pass(&mut self, now: i64) {
        self.now = self.now.max(now);
        match self.envelope.pass(self.now) {
            Found::LinearFit => self.judge(),
            // Where probes say that the clock is the same, it is the way that has become long.
            Found::Elsewhere(delay) if self.probed().is_none() => self.jump(delay),
            Found::Elsewhere(_) | Found::Nothing => {}
        }
        if self.bursts.pass(self.now) {
            self.judge();
        }
    }

    /// Whether a message with this delay, by its stamp, is of the clock that is known.
    fn believes(&self, delay: i64) -> bool {
        match self.offset() {
            Some(offset) => {
                let late = delay.saturating_add(offset.at(self.now));
                (-SOONER_NANOS..=LATER_NANOS).contains(&late)
            }
            None => (-TRUSTED_AHEAD_NANOS..=LATER_NANOS).contains(&delay),
        }
    }

    /// Whether a message is too late to be believed for itself, but goes on where its stream was.
    fn is_held_up(&mut self, stamps: &Stamps, last: i64, delay: i64) -> bool {
        let ahead = match (self.offset(), stamps.says) {
            (Some(offset), _) => offset.at(self.now),
            (None, Says::Measured) => 0,
            (None, _) => return false,
        };
        let late = delay.saturating_add(ahead);
        late > LATER_NANOS && self.backlogs.goes_on(stamps.stream, last, self.now, late)
    }

    /// Whether a delay is that of the way between the computers, as far as is known.
    fn shows_the_way(&self, delay: i64, says: Says) -> bool {
        let Some(fastest) = self.envelope.line() else { return says == Says::Sent };
        says == Says::Sent || !self.hears_sending || delay < fastest.at(self.now)
    }

    /// Learns from a delay what the clock is, or that it is another than it was.
    fn consider(&mut self, delay: i64, says: Says) {
        let known = self.offset().is_some();
        if known && self.believes(delay) {
            return self.strangers.forget();
        }
        let ahead = delay.saturating_add(self.offset().map_or(0, |offset| offset.at(self.now)));
        if says == Says::Measured && ahead >= -TRUSTED_AHEAD_NANOS {
            return;
        }
        let patience = if known { JUMPED_NANOS } else { KNOWN_NANOS };
        match self.strangers.push(self.now, delay, patience) {
            Some(lowest) if known => self.jump(lowest),
            Some(lowest) => {
                self.envelope = Envelope::new(self.now, lowest);
                self.strangers.forget();
                self.judge();
            }
            None => {}
        }
    }

    /// Holds a delay against what is known.
    fn compare(&mut self, delay: i64, offset: LinearFit) {
        let fastest = self.envelope.line().map_or(delay, |line| line.at(self.now));
        let late = delay.saturating_sub(fastest) as f64;
        let ahead = delay.saturating_add(offset.at(self.now)).saturating_neg() as f64;
        self.doubt.push(self.now, late, ahead.max(-late));
    }

    /// The clock has jumped: now the fastest messages have this delay.
    fn jump(&mut self, delay: i64) {
        let before = self.offset().map_or(0, |offset| offset.at(self.now));
        let secs = delay.saturating_add(before).saturating_neg() as f64 * 1e-9;
        self.envelope = Envelope::new(self.now, delay);
        self.bursts = Bursts::default();
        self.doubt = Doubt::default();
        self.strangers.forget();
        let was_off = self.trusted.take() == Some(false);
        self.begin_epoch(secs);
        self.judge();
        if was_off && self.trusted == Some(true) {
            self.report(News::Trusted);
        }
    }

    fn begin_epoch(&mut self, secs: f64) {
        self.epoch = self.epoch.saturating_add(1);
        self.shift = Shift::default();
        self.report(News::Jumped { epoch: self.epoch, secs });
    }

    /// Decides whether the clock is trusted, and steers the shift accordingly.
    fn judge(&mut self) {
        let Some(offset) = self.offset() else { return };
        let nanos = offset.at(self.now);
        let trusted = self.is_near(nanos);
        if !trusted && self.trusted != Some(false) {
            self.report(News::Off { secs: nanos as f64 * 1e-9 });
        }
        if trusted && self.trusted == Some(false) {
            self.report(News::Trusted);
        }
        self.trusted = Some(trusted);
        let target = if trusted { LinearFit::default() } else { offset };
        let step = target.at(self.now).saturating_sub(self.shift.newest());
        if self.shift.is_used() && step.saturating_abs() > LATER_NANOS {
            self.begin_epoch(step as f64 * 1e-9);
        }
        self.shift.steer(target.at(self.now), target.slope);
    }

    /// Whether a clock that is ahead by this much needs no correction. What is corrected must come
    /// twice as near before it is trusted again.
    fn is_near(&self, ahead: i64) -> bool {
        let (most_ahead, most_behind) = match self.probed() {
            Some(_) => {
                let most = TRUSTED_AHEAD_NANOS.max(self.bursts.uncertainty_nanos() as i64);
                (most, most)
            }
            None if self.hears_sending => (TRUSTED_AHEAD_NANOS, TRUSTED_BEHIND_NANOS),
            None => (TRUSTED_AHEAD_NANOS, LATER_NANOS),
        };
        let strictness = if self.trusted == Some(false) { 2 } else { 1 };
        (-most_behind / strictness..=most_ahead / strictness).contains(&ahead)
    }

    /// How wrong a time may be [ns]: by pending corrections, by what cannot be observed, and by what
    /// contradicts the known line.
    fn uncertainty_nanos(&self) -> f64 {
        let Some(offset) = self.offset() else { return f64::NAN };
        let ahead = offset.at(self.now) as f64;
        let probes = self.probed().map(|_| &self.bursts);
        let is_told = probes.is_some() || ahead > 0.0;
        let left = if is_told && self.trusted == Some(false) { 0.0 } else { ahead.abs() };
        let way = if self.hears_sending { PATH_NANOS } else { SENSED_NANOS };
        let line = probes.map_or(way, Bursts::uncertainty_nanos);
        let contradiction = probes.map_or(0.0, |probes| probes.doubt_nanos(self.now));
        let doubt = self.doubt.nanos(probes).max(contradiction);
        (left + line + self.unsteered_nanos() + doubt).max(self.arrival_nanos())
    }

    /// What the shift is still away from where it is steered to [ns].
    fn unsteered_nanos(&self) -> f64 {
        let Some(offset) = self.offset().filter(|_| self.shift.is_used()) else { return 0.0 };
        let target = if self.trusted == Some(false) { offset.at(self.now) } else { 0 };
        target.saturating_sub(self.shift.newest()).saturating_abs() as f64
    }

    /// How wrong an arrival that stands in may be [ns]; 0 where none does.
    fn arrival_nanos(&self) -> f64 {
        if self.doubt.believes_all() {
            return 0.0;
        }
        let fastest = self.envelope.line().map(|line| line.at(self.now));
        let way = self
            .probed()
            .zip(fastest)
            .map_or(0, |(probed, fastest)| fastest.saturating_add(probed.at(self.now)));
        let spread = self.envelope.spread_nanos();
        PATH_NANOS.max(way as f64) + if spread.is_nan() { 0.0 } else { 2.0 * spread }
    }

    /// How far the clock is ahead [ns]: by probes where there are any, else by stamps.
    fn offset(&self) -> Option<LinearFit> {
        self.probed().or_else(|| self.envelope.line().map(LinearFit::reversed))
    }

    /// The same by probes, unless what stamps the messages is another clock than what answers.
    fn probed(&self) -> Option<LinearFit> {
        let probed = self.bursts.line()?;
        let fastest = self.envelope.line().map(|line| line.at(self.now));
        let way = fastest.map(|delay| delay.saturating_add(probed.at(self.now)));
        way.is_none_or(|way| (-SOONER_NANOS..=LATER_NANOS).contains(&way)).then_some(probed)
    }

    fn report(&mut self, news: News) {
        if self.news.len() == NEWS {
            self.news.pop_front();
        }
        self.news.push_back(news);
    }
}

#[cfg(test)]
mod tests;
