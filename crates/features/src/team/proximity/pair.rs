//! The distances between a person and a robot within a second.

use teampulse_core::data::Reason;
use teampulse_signal::estimate::Estimate;

use crate::value::Value;

/// The number of ticks per second.
const TICKS: f64 = 10.0;

/// A person and a robot.
#[derive(Debug, Default)]
pub(super) struct Pair {
    ticks: u32,
    known: u32,
    near: u32,
    least_m: Option<f64>,
    newest: Option<Result<f64, Reason>>,
    /// The distance at the end of the previous second.
    before_m: Option<f64>,
}

/// The result of a second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Second {
    /// The shortest distance [m].
    pub distance: Result<f64, Reason>,
    /// The share of the time within the limit.
    within: Result<f64, Reason>,
    /// The speed of approach [m/s].
    approach: Result<f64, Reason>,
    /// The share of the second in which the distance is known.
    pub coverage: f64,
}

impl Pair {
    /// Takes in the distance at a tick [m], and whether it counts as near.
    pub fn take(&mut self, distance: Result<f64, Reason>, is_near: Option<bool>) {
        self.ticks += 1;
        self.newest = Some(distance);
        if let Ok(metres) = distance {
            self.known += 1;
            self.near += u32::from(is_near == Some(true));
            self.least_m = Some(self.least_m.map_or(metres, |least| least.min(metres)));
        }
    }

    /// Ends a second and returns its result.
    pub fn pass(&mut self) -> Second {
        let newest = self.newest.unwrap_or(Err(Reason::Missing));
        let why = newest.err().unwrap_or(Reason::Gap);
        let known = f64::from(self.known);
        let second = Second {
            distance: self.least_m.ok_or(why),
            within: if self.known > 0 { Ok(f64::from(self.near) / known) } else { Err(why) },
            approach: match (self.before_m, newest) {
                (_, Err(why)) => Err(why),
                (None, Ok(_)) => Err(Reason::Short),
                (Some(before_m), Ok(metres)) => Ok(before_m - metres),
            },
            coverage: (known / f64::from(self.ticks).max(TICKS)).clamp(0.0, 1.0),
        };
        *self = Pair { before_m: newest.ok(), ..Pair::default() };
        second
    }
}

impl Second {
    /// The result for the nearest of several robots; the share of time is that of being near any of them, from the
    /// ticks that were near and the known ones.
    pub fn nearest(all: &[Second], (near, known): (u32, u32)) -> Second {
        let metres = |second: &&Second| second.distance.unwrap_or(f64::INFINITY);
        let nearest = all.iter().min_by(|one, other| metres(one).total_cmp(&metres(other)));
        let none = Err(Reason::Missing);
        let nearest = nearest.copied().unwrap_or(Second {
            distance: none,
            within: none,
            approach: none,
            coverage: 0.0,
        });
        // An undefined distance is more informative than a missing one.
        let why = all
            .iter()
            .filter_map(|second| second.distance.err())
            .find(|why| *why == Reason::Undefined);
        let reasoned = |value: Result<f64, Reason>| match (value, why) {
            (Err(Reason::Missing), Some(why)) => Err(why),
            (value, _) => value,
        };
        let within =
            if known > 0 { Ok(f64::from(near) / f64::from(known)) } else { nearest.within };
        Second {
            distance: reasoned(nearest.distance),
            within: reasoned(within),
            approach: reasoned(nearest.approach),
            coverage: (f64::from(known) / TICKS).clamp(0.0, 1.0),
        }
    }

    /// Distance, share and speed of approach.
    pub fn values(&self) -> [Value; 3] {
        [self.distance, self.within, self.approach].map(|value| value.map(Estimate::unstated))
    }
}
