//! The last half minute of each wave as received, for clients that start to draw it.

use std::collections::{BTreeMap, VecDeque};

use crate::wire::waves::Wave;

/// How long waves are kept [s].
const KEPT_SECS: f64 = 30.0;
/// The memory for all kept waves [bytes]; beyond it, the stream that uses most of it drops the older half of its waves.
const KEPT_BYTES: usize = 16 << 20;

/// The newest waves of each stream.
#[derive(Debug, Default)]
pub struct Recent {
    waves: BTreeMap<u32, VecDeque<Wave>>,
    bytes: usize,
}

impl Recent {
    /// Keeps a wave, and drops those that are too old or too many.
    pub fn keep(&mut self, wave: Wave) {
        let Wave { stream, start, .. } = wave;
        self.bytes += bytes(&wave);
        self.waves.entry(stream).or_default().push_back(wave);
        self.forget(stream, |oldest| oldest.start < start - KEPT_SECS);
        while self.bytes > KEPT_BYTES {
            let largest =
                self.waves.iter().max_by_key(|(_, waves)| waves.iter().map(bytes).sum::<usize>());
            let Some((&largest, _)) = largest else { break };
            let half = self.waves[&largest].len().div_ceil(2);
            for _ in 0..half {
                let dropped = self.waves.get_mut(&largest).and_then(VecDeque::pop_front);
                self.bytes -= dropped.as_ref().map_or(0, bytes);
            }
        }
    }

    /// Returns the newest waves of a stream, encoded and oldest first, with at most `points_per_sec` points per second
    /// and at most `most_bytes` in total.
    pub fn of(&self, stream: u32, points_per_sec: f64, most_bytes: usize) -> Vec<Vec<u8>> {
        let newest_first = self.waves.get(&stream).into_iter().flatten().rev();
        let mut left = most_bytes;
        let frames = newest_first.map(|wave| wave.thinned(points_per_sec).encode());
        let fitting = frames.take_while(|frame| {
            let fits = frame.len() <= left;
            left = left.saturating_sub(frame.len());
            fits
        });
        let mut frames: Vec<Vec<u8>> = fitting.collect();
        frames.reverse();
        frames
    }

    fn forget(&mut self, stream: u32, is_over: impl Fn(&Wave) -> bool) {
        let Some(waves) = self.waves.get_mut(&stream) else { return };
        while waves.front().is_some_and(&is_over) {
            self.bytes -= waves.pop_front().as_ref().map_or(0, bytes);
        }
    }
}

fn bytes(wave: &Wave) -> usize {
    size_of::<Wave>() + size_of_val(&*wave.samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(stream: u32, start: f64, count: usize) -> Wave {
        Wave { stream, channels: 1, start, period: 0.01, samples: vec![1.0; count] }
    }

    #[test]
    fn half_a_minute_is_kept_and_the_newest_of_it_is_given() {
        let mut recent = Recent::default();
        for secs in 0..100 {
            recent.keep(wave(1, f64::from(secs), 100));
        }
        assert_eq!(recent.of(1, 0.0, usize::MAX).len(), 31);
        let few = recent.of(1, 0.0, 1000);
        assert_eq!(few.len(), 2);
        assert_eq!(few[1][8..16], 99.0_f64.to_le_bytes());
        assert!(recent.of(2, 0.0, usize::MAX).is_empty());
    }

    #[test]
    fn a_large_stream_takes_no_more_than_the_bound() {
        let mut recent = Recent::default();
        recent.keep(wave(1, 0.0, 10));
        for place in 0..100 {
            recent.keep(wave(2, f64::from(place) * 0.1, 1 << 18));
        }
        assert!(recent.bytes <= KEPT_BYTES, "{}", recent.bytes);
        assert_eq!(recent.of(1, 0.0, usize::MAX).len(), 1);
    }
}
