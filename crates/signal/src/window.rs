//! The newest points of a stream.

use std::collections::VecDeque;

/// The points of the newest `length_ns` of a stream, in order of their own times.
///
/// The memory is bounded: the window is divided into a fixed number of slots, aligned to time zero, each of which holds
/// one point. Its content therefore depends on the points alone, not on the order or the batches of their arrival.
/// Points later than the end are held until time reaches them; those more than one length ahead are rejected.
#[derive(Clone, Debug)]
pub struct Window<T> {
    length_ns: i64,
    slot_ns: i64,
    end_ns: Option<i64>,
    points: VecDeque<(i64, T)>,
}

impl<T> Window<T> {
    /// An empty window of `length_ns` [ns], with at most `most` points in it.
    pub fn new(length_ns: i64, most: usize) -> Window<T> {
        let length_ns = length_ns.max(1);
        let slots = i64::try_from(most.max(2) - 1).unwrap_or(i64::MAX);
        let slot_ns = (length_ns - 1) / slots + 1;
        Window { length_ns, slot_ns, end_ns: None, points: VecDeque::new() }
    }

    /// Inserts a point in order; of two in one slot, the earlier one stays.
    pub fn insert(&mut self, at_ns: i64, value: T) {
        self.insert_or(at_ns, value, |held, at_ns, value| {
            if at_ns < held.0 {
                *held = (at_ns, value);
            }
        });
    }

    /// Inserts a point in order; of two in one slot, `merge` makes one at the earlier time. It must be
    /// commutative.
    pub fn insert_merged(&mut self, at_ns: i64, value: T, merge: impl FnOnce(&mut T, T)) {
        self.insert_or(at_ns, value, |held, at_ns, value| {
            held.0 = held.0.min(at_ns);
            merge(&mut held.1, value);
        });
    }

    /// Moves the end of the window to `end_ns` and drops the points before its start.
    pub fn advance(&mut self, end_ns: i64) {
        self.end_ns = Some(end_ns);
        let begin_ns = end_ns.saturating_sub(self.length_ns);
        let gone = self.points.partition_point(|(at_ns, _)| *at_ns <= begin_ns);
        self.points.drain(..gone);
        self.points.truncate(self.points.partition_point(|(at_ns, _)| !self.is_ahead(*at_ns)));
    }

    /// The points between start and end, with their times [ns].
    pub fn iter(&self) -> impl Iterator<Item = (i64, &T)> {
        let end_ns = self.end_ns.unwrap_or(i64::MAX);
        let until = move |point: &&(i64, T)| point.0 <= end_ns;
        self.points.iter().take_while(until).map(|(at_ns, value)| (*at_ns, value))
    }

    fn insert_or(&mut self, at_ns: i64, value: T, merge: impl FnOnce(&mut (i64, T), i64, T)) {
        let end_ns = *self.end_ns.get_or_insert(at_ns);
        if at_ns <= end_ns.saturating_sub(self.length_ns) || self.is_ahead(at_ns) {
            return;
        }
        let slot = at_ns.div_euclid(self.slot_ns);
        let place = self.points.partition_point(|held| held.0.div_euclid(self.slot_ns) < slot);
        match self.points.get_mut(place) {
            Some(held) if held.0.div_euclid(self.slot_ns) == slot => merge(held, at_ns, value),
            _ => self.points.insert(place, (at_ns, value)),
        }
    }

    fn is_ahead(&self, at_ns: i64) -> bool {
        self.end_ns.is_some_and(|end_ns| at_ns > end_ns.saturating_add(self.length_ns))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn times(window: &Window<u32>) -> Vec<i64> {
        window.iter().map(|(at_ns, _)| at_ns).collect()
    }

    #[test]
    fn the_beginning_is_outside_and_the_end_inside() {
        let mut window = Window::new(10, 100);
        window.advance(10);
        (0..=20).for_each(|at_ns| window.insert(at_ns, 0));
        window.advance(20);
        assert_eq!(times(&window), (11..=20).collect::<Vec<_>>());
    }

    #[test]
    fn a_late_point_takes_its_true_place() {
        let mut window = Window::new(100, 1000);
        for at_ns in [10, 30, 20] {
            window.insert(at_ns, 0);
        }
        window.advance(40);
        assert_eq!(times(&window), [10, 20, 30]);
    }

    #[test]
    fn a_point_ahead_of_time_waits_for_it() {
        let mut window = Window::new(100, 1000);
        window.advance(0);
        window.insert(50, 0);
        window.insert(i64::MAX, 0);
        assert_eq!(times(&window), []);
        window.advance(60);
        assert_eq!(times(&window), [50]);
    }

    #[test]
    fn a_first_point_from_far_ahead_is_let_go_when_time_is_known() {
        let mut window = Window::new(100, 1000);
        window.insert(i64::MAX, 0);
        window.advance(0);
        assert!(window.points.is_empty());
        window.insert(0, 0);
        assert_eq!(times(&window), [0]);
    }

    #[test]
    fn merging_keeps_what_a_full_slot_would_drop() {
        let mut window = Window::new(1000, 11);
        for (at_ns, value) in [(1, 2), (3, 9), (2, 4)] {
            window.insert_merged(at_ns, value, |held, new| *held = new.max(*held));
        }
        assert_eq!(window.iter().collect::<Vec<_>>(), [(1, &9)]);
    }

    proptest! {
        #[test]
        fn it_never_holds_more_than_it_may(
            points in prop::collection::vec(any::<i64>(), 0..300),
            length_ns in 1i64..1_000_000,
            most in 2usize..20,
            end_ns in any::<i64>(),
        ) {
            let mut window = Window::new(length_ns, most);
            window.advance(end_ns);
            for at_ns in points {
                window.insert(at_ns, 0);
            }
            (0..300).for_each(|k| window.insert(end_ns.saturating_add(k * length_ns / 300), 0));
            window.advance(end_ns.saturating_add(length_ns));
            prop_assert!(window.iter().count() <= most, "{:?}", window);
            prop_assert!(window.points.len() <= 2 * most, "{:?}", window);
        }

        #[test]
        fn the_order_of_arrival_does_not_matter(
            mut points in prop::collection::vec((0i64..1000, any::<u32>()), 0..100),
        ) {
            points.sort_unstable();
            points.dedup_by_key(|point| point.0);
            let fill = |points: &mut dyn Iterator<Item = &(i64, u32)>| {
                let mut window = Window::new(1000, 40);
                window.advance(999);
                points.for_each(|&(at_ns, value)| window.insert(at_ns, value));
                window.iter().map(|(at_ns, &value)| (at_ns, value)).collect::<Vec<_>>()
            };
            prop_assert_eq!(fill(&mut points.iter()), fill(&mut points.iter().rev()));
        }
    }
}
