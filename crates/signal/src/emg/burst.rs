//! Detection of muscle activity.

use super::band::{Cleaner, RATES_HZ, clean, envelope};
use super::rest::{Rest, levels};
use crate::error::{SignalError, checked, checked_rate_hz};

/// The separation of bursts from rest.
///
/// A double threshold: a burst begins where the envelope exceeds the lower one, provided it rises to the
/// upper one, and ends where it falls below the lower one for some time. Both are multiples of the envelope
/// at rest, the 10 % quantile of its means over 0.1 s. (After Hodges & Bui 1996,
/// doi:10.1016/S0921-884X(96)95190-5, who use mean and standard deviation of a known rest.) If the muscle
/// rests at least a tenth of the time, stationary noise gives no bursts; activity below about twice the noise
/// is missed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstSettings {
    /// The upper threshold relative to rest: 1 to 1000.
    pub upper: f64,
    /// The lower threshold relative to rest: 1 to `upper`.
    pub lower: f64,
    /// The shortest burst [s], 0 to 10.
    pub least_secs: f64,
    /// The shortest pause between bursts [s], 0 to 10.
    pub pause_secs: f64,
    /// The memory of the resting level [s], 10 to 600: slightly more than the longest activity without rest.
    pub memory_secs: f64,
}

impl Default for BurstSettings {
    fn default() -> BurstSettings {
        BurstSettings {
            upper: 3.0,
            lower: 2.0,
            least_secs: 0.1,
            pause_secs: 0.1,
            memory_secs: 120.0,
        }
    }
}

impl BurstSettings {
    fn checked(&self) -> Result<(), SignalError> {
        checked("upper threshold of bursts", self.upper, (1.0, 1000.0))?;
        checked("lower threshold of bursts", self.lower, (1.0, self.upper))?;
        checked("shortest burst [s]", self.least_secs, (0.0, 10.0))?;
        checked("shortest pause [s]", self.pause_secs, (0.0, 10.0))?;
        checked("memory of rest [s]", self.memory_secs, (10.0, 600.0))?;
        Ok(())
    }

    /// The recipe as text.
    pub(super) fn recipe(&self) -> String {
        let BurstSettings { upper, lower, least_secs, pause_secs, memory_secs } = self;
        format!(
            "envelope above {lower} × rest for {least_secs} s or longer with a part above {upper} × rest, \
             pauses below {pause_secs} s bridged; rest = 10 % quantile of its 0.1 s means in {memory_secs} s"
        )
    }
}

/// A burst of activity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    /// The onset of the burst [samples from the first one].
    pub onset: f64,
    /// The end of the burst [samples from the first one].
    pub offset: f64,
    /// The mean envelope [unit of the signal].
    pub mean: f64,
    /// The peak envelope [unit of the signal].
    pub peak: f64,
}

/// Finds the bursts of a whole recording: band-pass and envelope without delay, rest estimated from both sides.
///
/// Returns an error for a rate outside 100 Hz to 10 kHz, a recording of fewer than 28 samples, or one without
/// a usable number.
pub fn find_bursts(signal: &[f64], rate_hz: f64) -> Result<Vec<Burst>, SignalError> {
    let envelope = envelope(&clean(signal, rate_hz)?, rate_hz)?;
    bursts_of(signal, &envelope, rate_hz, BurstSettings::default())
}

/// The bursts of a whole recording; one cut off by the end of the recording ends there.
pub(super) fn bursts_of(
    signal: &[f64],
    envelope: &[f64],
    rate_hz: f64,
    settings: BurstSettings,
) -> Result<Vec<Burst>, SignalError> {
    let levels = levels(signal, envelope, rate_hz, settings.memory_secs)?;
    let mut gate = Gate::new(rate_hz, settings)?;
    let known = envelope.iter().zip(levels);
    let mut found: Vec<Burst> =
        known.filter_map(|(&envelope, level)| gate.push(envelope, level)).collect();
    found.extend(gate.finish());
    Ok(found)
}

/// Detects bursts sample by sample.
///
/// A burst is reported when it has ended and the shortest pause has passed. Nothing is detected in the first 1.3 s;
/// rest is estimated from the past, so initial activity is mistaken for it. Positions are corrected for the
/// [delay](Cleaner::delay_secs) of the envelope. Independent of chunking; no sample allocates.
#[derive(Clone, Debug)]
pub struct BurstDetector {
    cleaner: Cleaner,
    rest: Rest,
    gate: Gate,
    delay: f64,
}

impl BurstDetector {
    /// Creates a detector for a rate of 100 Hz to 10 kHz; an error for another rate, or settings out of
    /// range.
    pub fn new(rate_hz: f64, settings: BurstSettings) -> Result<BurstDetector, SignalError> {
        let (cleaner, gate) = (Cleaner::new(rate_hz)?, Gate::new(rate_hz, settings)?);
        let delay = cleaner.delay_secs() * rate_hz;
        Ok(BurstDetector { cleaner, rest: Rest::new(rate_hz, settings.memory_secs)?, gate, delay })
    }

    /// Takes in the next sample, and returns a burst that ended.
    pub fn push(&mut self, sample: f64) -> Option<Burst> {
        let (_, envelope) = self.cleaner.push(sample);
        self.take(envelope, sample)
    }

    /// The delay of the envelope [samples].
    pub(super) fn delay(&self) -> f64 {
        self.delay
    }

    /// Whether a burst may have begun.
    pub(super) fn is_open(&self) -> bool {
        self.gate.open.is_some()
    }

    /// Whether the newest sample belongs to a burst: it is above the lower threshold, after the upper one was
    /// exceeded.
    pub(super) fn is_active(&self) -> bool {
        let newest = self.gate.place - 1.0;
        self.gate.open.is_some_and(|open| open.is_loud && open.last >= newest)
    }

    /// Takes in a sample; returns the band-passed sample, the envelope, and the burst that ended with it.
    pub(super) fn follow(&mut self, sample: f64) -> (f64, f64, Option<Burst>) {
        let (band, envelope) = self.cleaner.push(sample);
        (band, envelope, self.take(envelope, sample))
    }

    fn take(&mut self, envelope: f64, raw: f64) -> Option<Burst> {
        self.rest.push(envelope, raw);
        let burst = self.gate.push(envelope, self.rest.level())?;
        let earlier = |place: f64| (place - self.delay).max(0.0);
        Some(Burst { onset: earlier(burst.onset), offset: earlier(burst.offset), ..burst })
    }
}

/// The double threshold on an envelope.
#[derive(Clone, Debug)]
struct Gate {
    settings: BurstSettings,
    least: f64,
    pause: f64,
    place: f64,
    open: Option<Open>,
}

/// A potential burst.
#[derive(Clone, Copy, Debug)]
struct Open {
    begin: f64,
    is_loud: bool,
    /// Where the envelope was last above the lower threshold.
    last: f64,
    peak: f64,
    sum: f64,
    /// The sum of the envelope up to `last`.
    sum_at_last: f64,
}

impl Gate {
    fn new(rate_hz: f64, settings: BurstSettings) -> Result<Gate, SignalError> {
        let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
        settings.checked()?;
        let (least, pause) = (settings.least_secs * rate_hz, settings.pause_secs * rate_hz);
        Ok(Gate { settings, least, pause, place: 0.0, open: None })
    }

    fn push(&mut self, envelope: f64, rest: Option<f64>) -> Option<Burst> {
        let place = self.place;
        self.place += 1.0;
        let rest = rest.unwrap_or(f64::INFINITY);
        let is_above = envelope >= self.settings.lower * rest;
        let Some(open) = &mut self.open else {
            if is_above {
                let (peak, sum) = (0.0, 0.0);
                let open =
                    Open { begin: place, is_loud: false, last: place, peak, sum, sum_at_last: 0.0 };
                self.open = Some(open);
                self.follow(envelope, rest, is_above, place);
            }
            return None;
        };
        if !is_above && place - open.last > self.pause {
            return self.finish();
        }
        self.follow(envelope, rest, is_above, place);
        None
    }

    fn follow(&mut self, envelope: f64, rest: f64, is_above: bool, place: f64) {
        let Some(open) = &mut self.open else { return };
        open.sum += envelope;
        if is_above {
            open.is_loud |= envelope >= self.settings.upper * rest;
            open.peak = open.peak.max(envelope);
            (open.last, open.sum_at_last) = (place, open.sum);
        }
    }

    /// Closes the potential burst, and returns it if it is a burst.
    fn finish(&mut self) -> Option<Burst> {
        let open = self.open.take()?;
        let offset = open.last + 1.0;
        let length = offset - open.begin;
        let burst =
            Burst { onset: open.begin, offset, mean: open.sum_at_last / length, peak: open.peak };
        (open.is_loud && length >= self.least).then_some(burst)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Noise at 1000 Hz, and the factor that it is multiplied by at each time [s].
    fn noise(secs: f64, gain: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1u32 << 23) - 1.0
        };
        (0..(secs * 1000.0) as usize).map(|k| gain(k as f64 / 1000.0) * next()).collect()
    }

    fn causal(signal: &[f64]) -> Vec<Burst> {
        let mut detector = BurstDetector::new(1000.0, BurstSettings::default()).unwrap();
        signal.iter().filter_map(|&sample| detector.push(sample)).collect()
    }

    fn both(signal: &[f64]) -> [Vec<Burst>; 2] {
        [causal(signal), find_bursts(signal, 1000.0).unwrap()]
    }

    #[test]
    fn a_burst_begins_and_ends_where_it_does() {
        let loud = |secs: f64| (secs % 5.0) > 3.0 && (secs % 5.0) < 4.5;
        let signal = noise(30.0, |secs| if loud(secs) { 1.0 } else { 0.1 });
        for bursts in both(&signal) {
            assert_eq!(bursts.len(), 6);
            for (k, burst) in bursts.iter().enumerate() {
                assert!((burst.onset / 1000.0 - 3.0 - 5.0 * k as f64).abs() < 0.06, "{burst:?}");
                assert!((burst.offset / 1000.0 - 4.5 - 5.0 * k as f64).abs() < 0.12, "{burst:?}");
                assert!(burst.peak >= burst.mean && burst.mean > 0.3);
            }
        }
    }

    #[test]
    fn noise_that_stays_the_same_has_no_bursts() {
        for gain in [1e-6, 1.0, 1e9] {
            assert!(both(&noise(60.0, |_| gain)).iter().all(Vec::is_empty));
        }
    }

    #[test]
    fn a_flat_line_has_no_bursts() {
        for level in [0.0, 1e6, -3.3] {
            assert!(both(&vec![level; 20_000]).iter().all(Vec::is_empty));
        }
        assert!(causal(&vec![f64::NAN; 20_000]).is_empty());
    }

    #[test]
    fn a_click_is_too_short() {
        let mut signal = noise(20.0, |_| 0.1);
        signal[10_000] = 0.6;
        assert!(both(&signal).iter().all(Vec::is_empty));
    }

    #[test]
    fn a_muscle_that_is_silent_at_rest_has_its_bursts() {
        let signal = noise(20.0, |secs| f64::from((8.0..9.0).contains(&secs)));
        for bursts in both(&signal) {
            assert_eq!(bursts.len(), 1);
            assert!((bursts[0].onset / 1000.0 - 8.0).abs() < 0.2, "{bursts:?}");
        }
    }

    #[test]
    fn a_gap_is_not_taken_for_rest() {
        for secs in [0.5, 2.0, 20.0] {
            let mut signal = noise(60.0, |_| 1.0);
            signal[15_000..15_000 + (secs * 1000.0) as usize].fill(f64::NAN);
            for bursts in both(&signal) {
                assert!(bursts.is_empty(), "{secs} s: {bursts:?}");
            }
        }
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        for value in [f64::NAN, -1.0, f64::INFINITY, 1e9] {
            let usual = BurstSettings::default();
            for settings in [
                BurstSettings { upper: value, ..usual },
                BurstSettings { lower: value, ..usual },
                BurstSettings { least_secs: value, ..usual },
                BurstSettings { pause_secs: value, ..usual },
                BurstSettings { memory_secs: value, ..usual },
            ] {
                assert!(BurstDetector::new(1000.0, settings).is_err());
            }
            assert!(BurstDetector::new(value, usual).is_err());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn bursts_of_any_input_follow_each_other(
            signal in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -1.0..1.0], 0..3000),
            rate_hz in 100.0..400.0,
        ) {
            let mut detector = BurstDetector::new(rate_hz, BurstSettings::default()).unwrap();
            let causal: Vec<Burst> = signal.iter().filter_map(|&sample| detector.push(sample)).collect();
            for bursts in [causal, find_bursts(&signal, rate_hz).unwrap_or_default()] {
                prop_assert!(bursts.iter().all(|burst| burst.onset < burst.offset && burst.mean.is_finite()));
                prop_assert!(bursts.windows(2).all(|pair| pair[0].offset <= pair[1].onset));
                prop_assert!(bursts.iter().all(|burst| burst.offset <= signal.len() as f64));
            }
        }
    }
}
