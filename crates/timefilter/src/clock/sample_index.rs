//! The clock model of a device without a clock.

mod pause;

use self::pause::Pause;
use super::one_way::{OneWay, OneWaySettings};
use super::rate::Rate;
use super::{ClockEvent, ClockKind, ClockModel, ClockState, Corrected, Latency, Stamps};

/// The standard deviation of the true rates of such devices around the nominal rate [ppm]: a Polar H10 is
/// within 2 % at room temperature, others within 5 %.
const USUAL_SKEW_PPM: f64 = 10_000.0;

/// How long a declared rate is checked against the observed one [ns].
const DOUBTED_NANOS: i64 = 20_000_000_000;

/// The model of a device without a clock: a constant rate and numbered samples.
///
/// Sample indices at the nominal rate replace device time; the true rate is estimated from arrivals. A jump
/// in the indices is a gap in time. A pause that the indices do not show starts a new epoch, as no backlog follows
/// it; so does a declared rate that proves wrong by a factor between a quarter and four within the first seconds.
#[derive(Clone, Debug)]
pub struct SampleIndex {
    declared_hz: f64,
    period_nanos: f64,
    clock: OneWay,
    rate: Rate,
    /// When the check of the declared rate ends [ns]; `None` before the first reading.
    doubted: Option<i64>,
    /// The reference for device time: a sample index and the device time assigned to it [ns].
    origin: (u64, f64),
    pause: Pause,
}

impl SampleIndex {
    /// The most memory that one instance uses, itself included [B].
    pub const MOST_BYTES: usize = size_of::<SampleIndex>() + OneWay::MOST_BYTES;

    /// Creates the model of a stream with a nominal rate of `rate_hz`. Without a usable rate, readings are
    /// placed at their arrival, less the latency.
    pub fn new(rate_hz: f64, latency: Latency) -> SampleIndex {
        let usable = rate_hz.is_finite() && rate_hz > 0.0;
        let period_nanos = if usable { 1e9 / rate_hz } else { f64::NAN };
        let (clock, rate) = (OneWay::counting(settings(latency)), Rate::default());
        SampleIndex {
            declared_hz: rate_hz,
            period_nanos,
            clock,
            rate,
            doubted: None,
            origin: (0, 0.0),
            pause: Pause::default(),
        }
    }

    /// The estimated true rate [Hz].
    pub fn rate_hz(&self) -> f64 {
        let skew = self.clock.state().skew_ppm * 1e-6;
        1e9 / self.period_nanos * if skew.is_nan() { 1.0 } else { 1.0 + skew }
    }

    /// A new model with the same settings.
    pub(super) fn again(&self) -> SampleIndex {
        SampleIndex::new(self.declared_hz, self.clock.settings().latency)
    }

    /// The settings of the underlying clock model.
    pub(super) fn settings(&self) -> OneWaySettings {
        self.clock.settings()
    }

    /// Replaces device time in the stamps by that of the sample index. Also returns the declared rate [Hz]
    /// if it has just been found to be wrong.
    pub(super) fn by_number(&mut self, stamps: &Stamps) -> (Stamps, Option<f64>) {
        let last = stamps.index.saturating_add(u64::from(stamps.count.saturating_sub(1)));
        let declared_hz = 1e9 / self.period_nanos;
        let until = stamps.arrival.saturating_add(DOUBTED_NANOS);
        let mut wrong = None;
        if stamps.arrival <= *self.doubted.get_or_insert(until) {
            let found = self.rate.push(last, stamps.arrival, self.period_nanos);
            if let Some(period_nanos) = found {
                self.origin = (stamps.index, self.device(stamps.index));
                self.period_nanos = period_nanos;
                wrong = Some(declared_hz);
            }
        }
        let device = self.device(stamps.index).round();
        let device = (device.abs() < 9e18).then_some(device as i64);
        (Stamps { device, period_nanos: self.period_nanos, ..*stamps }, wrong)
    }

    /// Whether the device paused before a reading, for a time that its index does not show.
    pub(super) fn has_paused(&mut self, stamps: &Stamps) -> bool {
        self.pause.push(stamps, self.device(stamps.index), self.period_nanos)
    }

    /// The device time assigned to a sample index [ns].
    fn device(&self, index: u64) -> f64 {
        let since = i128::from(index) - i128::from(self.origin.0);
        self.origin.1 + since as f64 * self.period_nanos
    }
}

/// The clock settings of a device that counts samples.
pub(super) fn settings(latency: Latency) -> OneWaySettings {
    OneWaySettings { usual_skew_ppm: USUAL_SKEW_PPM, ..OneWaySettings::new(latency) }
}

impl ClockModel for SampleIndex {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        if self.period_nanos.is_nan() {
            return self.clock.arrived(&Stamps { device: None, ..*stamps });
        }
        let (stamps, wrong) = self.by_number(stamps);
        if let Some(declared_hz) = wrong {
            self.clock.begin_anew(declared_hz, 1e9 / self.period_nanos);
        }
        if self.has_paused(&stamps) {
            self.clock.resume();
        }
        self.clock.correct(&stamps)
    }

    fn state(&self) -> ClockState {
        self.clock.state_as(ClockKind::SampleIndex)
    }

    fn next_event(&mut self) -> Option<ClockEvent> {
        self.clock.next_event()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::simulated::{Device, SECOND};

    const LATENCY: Latency = Latency::new(0.0, 0.0);

    fn run(clock: &mut SampleIndex, device: &mut Device, secs: i64) -> f64 {
        let mut error = f64::NAN;
        let end = device.now + secs * SECOND;
        while device.now < end {
            let (truth, stamps) = device.send();
            let measured = clock.correct(&Stamps { device: None, ..stamps }).measured;
            error = (measured - truth) as f64 / 1e9 - device.least_delay;
        }
        error
    }

    #[test]
    fn the_true_rate_is_found() {
        for nominal in [190.0, 200.0, 210.0] {
            let (mut clock, mut device) = (SampleIndex::new(nominal, LATENCY), Device::new(200.0));
            device.batch = 2;
            let error = run(&mut clock, &mut device, 120);
            assert!(error.abs() < 0.01, "{error}");
            assert!((clock.rate_hz() - 200.0).abs() < 0.05, "{}", clock.rate_hz());
        }
    }

    #[test]
    fn a_rate_that_is_declared_wrong_is_reported_and_corrected() {
        for declared in [13.0, 30.0, 80.0, 135.0, 210.0] {
            let (mut clock, mut device) = (SampleIndex::new(declared, LATENCY), Device::new(55.0));
            run(&mut clock, &mut device, 10);
            let event = clock.next_event();
            assert!(matches!(event, Some(ClockEvent::WrongRate { .. })), "{declared}: {event:?}");
            let error = run(&mut clock, &mut device, 110);
            assert!(error.abs() < 0.01, "{declared}: {error}");
            assert!((clock.rate_hz() - 55.0).abs() < 0.05, "{declared}: {}", clock.rate_hz());
        }
    }

    #[test]
    fn a_rate_that_was_a_little_off_at_first_does_not_keep_packets_out() {
        let (period, interval) = (30_956_000, 16_250_000);
        let mut random = Device::new(1.0);
        for session in 0..40 {
            let mut clock = SampleIndex::new(32.0, LATENCY);
            for number in 0..500 {
                let first = (14 * number + session) * period + 400_000 * session;
                let again = i64::from(random.uniform() < 0.1);
                let event = (first + 13 * period) / interval + 1 + again;
                let arrival = 1_700_000_000 * SECOND + event * interval;
                let index = 14 * number as u64;
                let stamps = Stamps { index, count: 14, ..Stamps::arrived(arrival) };
                let measured = clock.correct(&stamps).measured;
                let error = measured - 1_700_000_000 * SECOND - first;
                let is_late = number < 250 || error.abs() < 20_000_000;
                assert!(is_late, "{session}, packet {number}: {error} ns");
            }
        }
    }

    #[test]
    fn a_jump_in_numbers_is_a_gap_in_time() {
        let (mut clock, mut device) = (SampleIndex::new(50.0, LATENCY), Device::new(50.0));
        run(&mut clock, &mut device, 60);
        for _ in 0..500 {
            device.send(); // lost
        }
        let (truth, stamps) = device.send();
        let error = (clock.correct(&stamps).measured - truth) as f64 / 1e9 - device.least_delay;
        assert!(error.abs() < 0.01, "{error}");
        assert_eq!(clock.next_event(), None);
    }

    #[test]
    fn a_pause_that_indices_do_not_show_begins_a_new_epoch_within_samples() {
        for millis in [700, 2_000, 20_000] {
            let (mut clock, mut device) = (SampleIndex::new(50.0, LATENCY), Device::new(50.0));
            device.tail = 0.005;
            run(&mut clock, &mut device, 60);
            device.now += millis * SECOND / 1000;
            let resumed = device.now;
            while device.now < resumed + 30 * SECOND {
                let (truth, stamps) = device.send();
                let measured = clock.correct(&Stamps { device: None, ..stamps }).measured;
                let error = (measured - truth) as f64 / 1e9 - device.least_delay;
                assert!(truth < resumed + SECOND / 5 || error.abs() < 0.02, "{millis}: {error}");
            }
            assert_eq!((clock.state().epoch, clock.next_event()), (1, None), "{millis}");
            assert!((clock.rate_hz() - 50.0).abs() < 0.2, "{}", clock.rate_hz());
        }
    }

    #[test]
    fn a_backlog_after_a_silence_is_placed_where_it_was_measured() {
        // It arrives at once, or at twice the speed.
        for speed in [i64::MAX, 2] {
            let (mut clock, mut device) = (SampleIndex::new(50.0, LATENCY), Device::new(50.0));
            run(&mut clock, &mut device, 60);
            let begin = device.now;
            let up = begin + 5 * SECOND;
            while device.now < begin + 30 * SECOND {
                let (truth, stamps) = device.send();
                let arrival = stamps.arrival.max(up + (truth - begin) / speed);
                let measured = clock.correct(&Stamps { device: None, arrival, ..stamps }).measured;
                let error = (measured - truth) as f64 / 1e9 - device.least_delay;
                assert!(error.abs() < 0.05, "{speed}: {error}");
            }
            assert_eq!((clock.state().epoch, clock.next_event()), (0, None), "{speed}");
        }
    }

    #[test]
    fn without_a_rate_the_arrival_stands_in() {
        for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut clock = SampleIndex::new(rate_hz, Latency::new(1e-6, 0.0));
            let corrected = clock.correct(&Stamps::arrived(5_000));
            assert_eq!((corrected.measured, corrected.disbelieved), (4_000, false));
        }
    }
}
