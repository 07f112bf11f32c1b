//! Values in order, from which any can be taken out again.

/// Most values of a bucket: few enough that moving them is cheap, enough that buckets are few.
const MOST: usize = 512;
/// Values that are looked for among so many first.
const NEAR: usize = 16;

/// Values in ascending order, in buckets that split and join as values come and go.
///
/// A change moves the values of the buckets that it touches, however many others there are; ranks are
/// found by counting buckets. All that is told is exact, and the same whatever order the values came in.
#[derive(Clone, Debug, Default)]
pub(super) struct Ordered {
    /// None is empty.
    buckets: Vec<Vec<f64>>,
    count: usize,
    /// Room for the bucket that is being changed.
    room: Vec<f64>,
}

impl Ordered {
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Lets go of values that were taken in before, and takes in others; all are finite. Both are put
    /// in order.
    pub(super) fn change(&mut self, gone: &mut [f64], new: &mut [f64]) {
        for values in [&mut *gone, &mut *new] {
            // There is one zero.
            for value in values.iter_mut() {
                *value += 0.0;
            }
            values.sort_unstable_by(f64::total_cmp);
        }
        let (mut gone, mut new) = (&*gone, &*new);
        let old = std::mem::take(&mut self.buckets);
        self.buckets.reserve(old.len() + 1);
        let last = old.len().saturating_sub(1);
        self.count = 0;
        for (place, mut bucket) in old.into_iter().enumerate() {
            let greatest = bucket.last().copied().unwrap_or(f64::NEG_INFINITY);
            let bound = if place == last { f64::MAX } else { greatest };
            let touches = |values: &[f64]| values.first().is_some_and(|first| *first <= bound);
            if touches(gone) || touches(new) {
                self.room.clear();
                (gone, new) = changed(&bucket, bound, (gone, new), &mut self.room);
                std::mem::swap(&mut bucket, &mut self.room);
            }
            self.keep(bucket);
        }
        if !new.is_empty() {
            self.keep(new.to_vec());
        }
    }

    /// Keeps a bucket behind the others: in parts when it is large, joined to the last when both are small.
    fn keep(&mut self, bucket: Vec<f64>) {
        self.count += bucket.len();
        match self.buckets.last_mut() {
            Some(last) if last.len() + bucket.len() <= MOST / 2 => last.extend(bucket),
            _ if bucket.len() > MOST => {
                self.buckets.extend(bucket.chunks(MOST / 2).map(<[f64]>::to_vec));
            }
            _ if bucket.is_empty() => {}
            _ => self.buckets.push(bucket),
        }
    }

    pub(super) fn clear(&mut self) {
        *self = Ordered::default();
    }

    pub(super) fn least(&self) -> Option<f64> {
        self.buckets.first()?.first().copied()
    }

    pub(super) fn greatest(&self) -> Option<f64> {
        self.buckets.last()?.last().copied()
    }

    /// Median and median absolute deviation from it, not scaled. `None` without a value.
    pub(super) fn median_and_mad(&self) -> Option<(f64, f64)> {
        let ranks = Ranks::of(self);
        let [lower, upper] = middle(self.count)?;
        let median = ranks.value(lower).midpoint(ranks.value(upper));
        let place = self.bucket_of(median);
        let below = match self.buckets.get(place) {
            Some(bucket) => ranks.first[place] + rank_in(bucket, median),
            None => self.count,
        };
        let deviations = Deviations { ranks: &ranks, median, below, count: self.count };
        Some((median, deviations.ranked(lower).midpoint(deviations.ranked(upper))))
    }

    /// The first bucket whose greatest value is not below a value.
    fn bucket_of(&self, value: f64) -> usize {
        self.buckets.partition_point(|bucket| bucket.last().is_some_and(|last| *last < value))
    }
}

/// A bucket without what is gone and with what is new of up to `bound`, put into `room`; gives what of
/// both is left for later buckets.
fn changed<'a>(
    mut bucket: &[f64],
    bound: f64,
    (mut gone, mut new): (&'a [f64], &'a [f64]),
    room: &mut Vec<f64>,
) -> (&'a [f64], &'a [f64]) {
    // Behind the last value stands one that is beyond every bound.
    let first = |values: &[f64]| values.first().copied().unwrap_or(f64::INFINITY);
    loop {
        let (next_gone, next_new) = (first(gone), first(new));
        let next = next_gone.min(next_new);
        if next > bound {
            break;
        }
        let (before, after) = bucket.split_at(rank_near(bucket, next));
        room.extend_from_slice(before);
        bucket = after;
        if next_gone <= next_new {
            // Of many equal values the others stand in the next bucket.
            let Some((_, after)) = bucket.split_first() else { break };
            (bucket, gone) = (after, &gone[1..]);
        } else {
            room.push(next);
            new = &new[1..];
        }
    }
    room.extend_from_slice(bucket);
    (gone, new)
}

/// How many values of a bucket are below a value.
fn rank_in(bucket: &[f64], value: f64) -> usize {
    bucket.partition_point(|held| *held < value)
}

/// The same, sooner where few are.
fn rank_near(bucket: &[f64], value: f64) -> usize {
    let mut reach = NEAR;
    while bucket.get(reach).is_some_and(|held| *held < value) {
        reach *= NEAR / 4;
    }
    rank_in(&bucket[..bucket.len().min(reach)], value)
}

/// The ranks of the middle one or two of so many.
fn middle(count: usize) -> Option<[usize; 2]> {
    let last = count.checked_sub(1)?;
    Some([last / 2, count / 2])
}

/// Values by their ranks.
struct Ranks<'a> {
    ordered: &'a Ordered,
    /// The rank of the first value of each bucket.
    first: Vec<usize>,
}

impl Ranks<'_> {
    fn of(ordered: &Ordered) -> Ranks<'_> {
        let mut count = 0;
        let mut first = Vec::with_capacity(ordered.buckets.len());
        for bucket in &ordered.buckets {
            first.push(count);
            count += bucket.len();
        }
        Ranks { ordered, first }
    }

    /// The value of a rank that there is.
    fn value(&self, rank: usize) -> f64 {
        let place = self.first.partition_point(|first| *first <= rank) - 1;
        self.ordered.buckets[place][rank - self.first[place]]
    }
}

/// Distances from the median, ascending to both sides of it.
struct Deviations<'a> {
    ranks: &'a Ranks<'a>,
    median: f64,
    /// How many values are below the median.
    below: usize,
    count: usize,
}

impl Deviations<'_> {
    fn to_below(&self, number: usize) -> f64 {
        self.median - self.ranks.value(self.below - 1 - number)
    }

    fn to_above(&self, number: usize) -> f64 {
        self.ranks.value(self.below + number) - self.median
    }

    /// The distance before which `rank` others stand in order.
    fn ranked(&self, rank: usize) -> f64 {
        let above = self.count - self.below;
        // How many of those that stand before it are below the median: the fewest of which the next is
        // not nearer than the last of those above.
        let (mut few, mut many) = (rank.saturating_sub(above), rank.min(self.below));
        while few < many {
            let half = few.midpoint(many);
            if self.to_below(half) >= self.to_above(rank - half - 1) {
                many = half;
            } else {
                few = half + 1;
            }
        }
        let next_below = if few < self.below { self.to_below(few) } else { f64::INFINITY };
        let next_above = if rank - few < above { self.to_above(rank - few) } else { f64::INFINITY };
        next_below.min(next_above)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::robust::{mad, median};

    fn filled(values: &[f64]) -> Ordered {
        let mut ordered = Ordered::default();
        ordered.change(&mut [], &mut values.to_vec());
        ordered
    }

    #[test]
    fn nothing_has_no_order() {
        let mut ordered = filled(&[7.0]);
        ordered.change(&mut [7.0], &mut []);
        assert_eq!((ordered.count(), ordered.median_and_mad()), (0, None));
        assert_eq!((ordered.least(), ordered.greatest()), (None, None));
        assert!(ordered.buckets.is_empty());
    }

    #[test]
    fn buckets_stay_few_when_values_drift() {
        let mut ordered = filled(&(0..1000).map(f64::from).collect::<Vec<_>>());
        for k in (0..100_000).step_by(10) {
            let mut gone: Vec<f64> = (k..k + 10).map(f64::from).collect();
            let mut new: Vec<f64> = gone.iter().map(|value| value + 1000.0).collect();
            ordered.change(&mut gone, &mut new);
        }
        assert_eq!(ordered.count(), 1000);
        assert!(ordered.buckets.len() < 20, "{}", ordered.buckets.len());
    }

    #[test]
    fn all_but_a_few_leave_few_buckets() {
        let mut ordered = filled(&(0..50_000).map(f64::from).collect::<Vec<_>>());
        let mut gone: Vec<f64> = (0..50_000).filter(|k| k % 500 != 0).map(f64::from).collect();
        ordered.change(&mut gone, &mut []);
        assert_eq!(ordered.count(), 100);
        assert!(ordered.buckets.len() < 10, "{}", ordered.buckets.len());
        assert_eq!(ordered.median_and_mad(), Some((24_750.0, 12_500.0)));
    }

    proptest! {
        #[test]
        fn what_is_left_has_the_statistics_of_what_is_left(
            values in prop::collection::vec(
                prop_oneof![(-30i32..30).prop_map(f64::from), -1e9..1e9f64, Just(-0.0)], 1..9000,
            ),
            gone in prop::collection::vec(any::<bool>(), 9000),
        ) {
            let (first, second) = values.split_at(values.len() / 2);
            let mut ordered = filled(first);
            let of = |range: std::ops::Range<usize>, leaves: bool| -> Vec<f64> {
                range.filter(|k| gone[*k] == leaves).map(|k| values[k]).collect()
            };
            ordered.change(&mut of(0..first.len(), true), &mut second.to_vec());
            ordered.change(&mut of(first.len()..values.len(), true), &mut []);
            let left = of(0..values.len(), false);
            prop_assert_eq!(ordered.count(), left.len());
            prop_assert_eq!(ordered.median_and_mad(), median(&left).zip(mad(&left)));
            prop_assert_eq!(ordered.least(), left.iter().copied().reduce(f64::min));
            prop_assert_eq!(ordered.greatest(), left.iter().copied().reduce(f64::max));
        }
    }
}
