//! Aggregates over the samples of a window.

use super::cell::absent;
use super::policy::Aggregate;
use super::row::{Origin, Validity};
use super::source::Source;
use super::watermark::Presence;

/// The samples measured in (row − length, row].
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub row: i64,
    pub length_nanos: i64,
    pub aggregate: Aggregate,
}

impl Source {
    pub(super) fn window(&self, window: &Window, available: bool, values: &mut [f64]) -> Origin {
        let begin = window.row.saturating_sub(window.length_nanos);
        let time = |place: usize| self.samples.time(place);
        let first = (0..self.samples.len()).find(|&place| time(place) > Some(begin));
        let first = first.unwrap_or(self.samples.len());
        let inside = |&place: &usize| time(place).is_some_and(|time| time <= window.row);
        let end = (first..self.samples.len()).take_while(inside).last().map_or(first, |k| k + 1);
        if end == first && window.aggregate != Aggregate::Count {
            return self.none(window.row, available, values);
        }
        for (channel, value) in values.iter_mut().enumerate() {
            let inside = (first..end).map(|place| self.samples.values(place)[channel]);
            *value = window.aggregate.of(inside.filter(|value| !value.is_nan()));
        }
        let newest = end.checked_sub(1).and_then(time).filter(|&newest| newest <= window.row);
        let awaited = matches!(self.watermark.presence, Presence::Awaited | Presence::Behind);
        let sure = self.is_complete(window.row) || (available && awaited);
        if newest.is_none() && !sure {
            return absent(values, None, self.unawaited());
        }
        Origin { newest, validity: if sure { Validity::Fresh } else { self.unawaited() } }
    }
}

impl Aggregate {
    fn of(self, values: impl Iterator<Item = f64>) -> f64 {
        match self {
            Aggregate::Mean => {
                let (sum, count) =
                    values.fold((0.0, 0_u32), |(sum, n), value| (sum + value, n + 1));
                sum / f64::from(count)
            }
            Aggregate::Min => values.fold(f64::NAN, f64::min),
            Aggregate::Max => values.fold(f64::NAN, f64::max),
            Aggregate::Last => values.last().unwrap_or(f64::NAN),
            Aggregate::Count => values.count() as f64,
        }
    }
}
