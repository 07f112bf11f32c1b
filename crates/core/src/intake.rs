//! Limits what features compute: one publisher must not hold up the session.
//!
//! A stream of waves states its rate, but delivers many times as many samples if its waves overlap. The excess is
//! recorded like everything else; it is counted, but not passed to features. The limits depend only on the data and on
//! log times, so a replay skips the same samples.

use crate::counted::counted;
use crate::data::Data;
use crate::stream::Stream;
use crate::time::Time;

/// The most numbers that features take from one stream: in a burst, and per second after it.
const NUMBERS: Bucket = Bucket::new(1_000_000.0, 200_000.0);
/// The most numbers that features take from all streams together: in a burst, and per second after it.
const OF_ALL: Bucket = Bucket::new(2_000_000.0, 600_000.0);
/// The most time that the samples of waves may cover, by their period: in a burst [s], and per second after it. A
/// device that sends stored samples may be far behind; waves beyond the limit overlap, and are not used.
const SPAN_SECS: Bucket = Bucket::new(60.0, 4.0);

/// How long a fault about skipped samples is reported [s].
const COMPLAINT_SECS: f64 = 10.0;

/// A token bucket: at most `most` in a burst, and `per_sec` after it.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    most: f64,
    per_sec: f64,
    left: f64,
    filled: Option<Time>,
}

impl Bucket {
    const fn new(most: f64, per_sec: f64) -> Bucket {
        Bucket { most, per_sec, left: most, filled: None }
    }

    fn fill(&mut self, now: Time) {
        let secs = self.filled.replace(now).map_or(0.0, |filled| now.secs_since(filled).max(0.0));
        self.left = (self.left + secs * self.per_sec).min(self.most);
    }
}

/// The remaining budget of all streams together.
#[derive(Debug)]
pub(crate) struct Shared(Bucket);

impl Default for Shared {
    fn default() -> Shared {
        Shared(OF_ALL)
    }
}

/// The remaining budget of a stream, and the number of skipped samples.
#[derive(Debug)]
pub(crate) struct Intake {
    numbers: Bucket,
    span_secs: Bucket,
    /// The number of skipped samples, and when the last of them arrived.
    left_out: u64,
    newest: Option<Time>,
}

impl Default for Intake {
    fn default() -> Intake {
        Intake { numbers: NUMBERS, span_secs: SPAN_SECS, left_out: 0, newest: None }
    }
}

impl Intake {
    /// Whether the budget at `now` suffices for a reading; the samples of a refused reading are counted.
    pub(crate) fn admits(
        &mut self,
        all: &mut Shared,
        stream: &Stream,
        data: &Data,
        now: Time,
    ) -> bool {
        let cost = Cost::of(stream, data);
        let costs = [cost.numbers, cost.numbers, cost.span_secs];
        let mut buckets = [&mut self.numbers, &mut all.0, &mut self.span_secs];
        for bucket in &mut buckets {
            bucket.fill(now);
        }
        // NaN never fits.
        let fits = buckets.iter().zip(costs).all(|(bucket, cost)| cost <= bucket.left);
        if fits {
            for (bucket, cost) in buckets.into_iter().zip(costs) {
                bucket.left -= cost;
            }
        } else {
            self.left_out = self.left_out.saturating_add(cost.samples);
            self.newest = Some(now);
        }
        fits
    }

    /// The current fault of the stream, if any.
    pub(crate) fn complaint(&self, now: Time) -> Option<String> {
        let is_new = self.newest.is_some_and(|newest| now.secs_since(newest) <= COMPLAINT_SECS);
        let left_out = self.left_out;
        let left_out = counted(left_out, "sample was", "samples were");
        is_new.then(|| format!("faster than its rate: {left_out} not used for features"))
    }
}

/// The cost of a reading.
struct Cost {
    samples: u64,
    numbers: f64,
    span_secs: f64,
}

impl Cost {
    fn of(stream: &Stream, data: &Data) -> Cost {
        let width = stream.channels.len().max(1) as f64;
        let single = |numbers: f64| Cost { samples: 1, numbers, span_secs: 0.0 };
        let Data::Wave(wave) = data else {
            return single(match data {
                Data::Sample(values) => values.len() as f64,
                Data::Feature(feature) => feature.values.len() as f64,
                Data::Message(_) => width,
                _ => 1.0,
            });
        };
        let samples = wave.samples.len() / wave.channels.max(1) as usize;
        let span_secs = samples as f64 * wave.period_ns / 1e9;
        // A wave costs at least its span at the declared rate: features fill its gaps with missing values.
        let declared = span_secs * stream.rate_hz * width;
        let numbers = declared.max(wave.samples.len() as f64);
        Cost { samples: samples as u64, numbers, span_secs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Wave;
    use crate::stream::{Shape, Subject};

    const MS_NS: i64 = 1_000_000;

    fn ecg() -> Stream {
        let stream = Stream::raw("/humans/persons/p1/strap/ecg", Subject::robot("r1"), Shape::Wave);
        Stream { rate_hz: 1000.0, ..stream }.with_channels(&[("ecg", "mV")])
    }

    fn wave(samples: usize, period_ns: f64) -> Data {
        Data::Wave(Wave { period_ns, channels: 1, samples: vec![0.0; samples].into() })
    }

    /// The number of waves that are admitted out of `count`, one every `every_ns` [ns].
    fn admitted(count: i64, every_ns: i64, wave: &Data) -> usize {
        let (mut intake, mut all, stream) = (Intake::default(), Shared::default(), ecg());
        let at = |k: i64| Time::from_nanos(1_700_000_000_000_000_000 + k * every_ns);
        let mut admits = |k: &i64| intake.admits(&mut all, &stream, wave, at(*k));
        let admitted = (0..count).filter(|k| admits(k)).count();
        assert_eq!(admitted == count as usize, intake.complaint(at(count)).is_none());
        assert_eq!(intake.complaint(at(count) + std::time::Duration::from_secs(11)), None);
        admitted
    }

    #[test]
    fn consecutive_waves_are_all_admitted() {
        // An hour, by a clock that is 5 % fast.
        assert_eq!(admitted(36_000, 95 * MS_NS, &wave(100, 1e6)), 36_000);
        // Samples stored for 50 s arrive at once.
        assert_eq!(admitted(500, 1, &wave(100, 1e6)), 500);
    }

    #[test]
    fn waves_that_overlap_are_cut_back_to_a_few_times_their_rate() {
        // 62,500 samples a second, said to be 1000.
        let count = admitted(60_000, 10 * MS_NS, &wave(625, 1e6));
        assert!((3840..4000).contains(&count), "{count}");
    }

    #[test]
    fn endless_numbers_are_cut_back() {
        // A hundred million a second, by any period.
        for period_ns in [0.0, 1.0, 1e3] {
            let count = admitted(2000, 10 * MS_NS, &wave(1_000_000, period_ns));
            assert!(count <= 5, "{count} at {period_ns} ns");
        }
        assert_eq!(admitted(100, 1000 * MS_NS, &wave(1, 1e300)), 0);
        assert_eq!(admitted(100, 1000 * MS_NS, &wave(2, 40e9)), 0);
    }
}
