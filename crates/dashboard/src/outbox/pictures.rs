//! The pictures waiting for one client: the newest of each stream, with no more in flight than it can show.
//!
//! A picture is large, and every picture in flight delays the marker behind it: in the kernel, in the network, in the
//! browser. So the next one is sent only when the client has shown the earlier ones.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Bound::{Excluded, Unbounded};
use std::sync::Arc;

use teampulse_core::clock::Stopwatch;

use crate::pictures::Picture;

/// The amount in flight at first, and the bounds within which it adapts to the link [bytes]. A single picture may be
/// larger.
const FIRST_BYTES: f64 = (64 << 10) as f64;
const BOUNDS_BYTES: (f64, f64) = ((16 << 10) as f64, (1 << 20) as f64);
/// How long a picture should be in flight [s]: a marker behind it is hardly delayed.
const AIM_SECS: f64 = 0.1;
/// The factor by which a single picture changes the amount in flight.
const STEP: f64 = 1.1;
/// The most pictures of one stream in flight, so that one is drawn while the next arrives.
const MOST_EACH: usize = 2;

/// The pictures waiting for one client.
#[derive(Debug)]
pub struct Pictures {
    newest: BTreeMap<u32, Waiting>,
    /// The size of each that was sent and not yet shown [bytes], and when it was sent.
    on_their_way: BTreeMap<u32, VecDeque<(usize, Stopwatch)>>,
    bytes: usize,
    /// The amount that may be in flight [bytes].
    most_bytes: f64,
    /// The stream whose picture was sent last: the streams after it come next.
    last: u32,
    /// The time since a picture of each stream was last sent.
    sent: BTreeMap<u32, Stopwatch>,
}

/// A waiting picture.
#[derive(Debug)]
struct Waiting {
    picture: Arc<Picture>,
    /// The shortest time after the previous one [s].
    after_secs: f64,
}

impl Default for Pictures {
    fn default() -> Pictures {
        Pictures {
            newest: BTreeMap::new(),
            on_their_way: BTreeMap::new(),
            bytes: 0,
            most_bytes: FIRST_BYTES,
            last: 0,
            sent: BTreeMap::new(),
        }
    }
}

impl Pictures {
    /// Takes a picture of a stream that is shown at no more than this rate, 0 for no limit; returns whether it replaced
    /// one for which the client was too slow.
    pub fn put(&mut self, picture: Arc<Picture>, most_per_sec: f64) -> bool {
        let stream = picture.stream;
        // A tenth earlier is on time: cameras are not that regular.
        let after_secs = if most_per_sec > 0.0 { 0.9 / most_per_sec } else { 0.0 };
        let replaced = self.newest.insert(stream, Waiting { picture, after_secs });
        replaced.is_some_and(|waiting| self.is_due(stream, &waiting))
    }

    /// The next one to send. A picture that is not due yet waits until something else is sent, at most a second.
    pub fn take(&mut self) -> Option<Arc<Picture>> {
        if self.bytes as f64 >= self.most_bytes {
            return None;
        }
        let is_free =
            |stream: &u32| self.on_their_way.get(stream).is_none_or(|sent| sent.len() < MOST_EACH);
        let after = self.newest.range((Excluded(self.last), Unbounded)).chain(self.newest.iter());
        let mut next =
            after.filter(|(stream, waiting)| is_free(stream) && self.is_due(**stream, waiting));
        let stream = *next.next()?.0;
        let Waiting { picture, .. } = self.newest.remove(&stream)?;
        let size = picture.size();
        let now = Stopwatch::start();
        self.on_their_way.entry(stream).or_default().push_back((size, now));
        self.sent.insert(stream, now);
        self.bytes += size;
        self.last = stream;
        Some(picture)
    }

    fn is_due(&self, stream: u32, waiting: &Waiting) -> bool {
        let sent = self.sent.get(&stream);
        sent.is_none_or(|sent| sent.elapsed().as_secs_f64() >= waiting.after_secs)
    }

    /// Notes that the client has shown the oldest picture of a stream that was in flight.
    pub fn shown(&mut self, stream: u32) {
        let shown = self.on_their_way.get_mut(&stream).and_then(VecDeque::pop_front);
        let Some((size, sent)) = shown else { return };
        self.bytes -= size;
        self.follow(sent.elapsed().as_secs_f64());
    }

    /// Notes how long a picture was in flight [s]: if that is long, less is sent at once.
    fn follow(&mut self, secs: f64) {
        let step = (AIM_SECS / secs.max(1e-3)).clamp(1.0 / STEP, STEP);
        self.most_bytes = (self.most_bytes * step).clamp(BOUNDS_BYTES.0, BOUNDS_BYTES.1);
    }

    /// Drops the waiting pictures.
    pub fn forget(&mut self) {
        self.newest.clear();
        self.sent.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::tests::picture;

    fn put(pictures: &mut Pictures, stream: u32, t: f64, size: usize) -> bool {
        pictures.put(Arc::new(picture(stream, t, size)), 0.0)
    }

    fn taken(pictures: &mut Pictures) -> Vec<(u32, f64)> {
        std::iter::from_fn(|| pictures.take()).map(|picture| (picture.stream, picture.t)).collect()
    }

    #[test]
    fn the_newest_of_each_stream_is_sent_in_turn_while_those_before_are_shown() {
        let mut pictures = Pictures::default();
        assert!(!put(&mut pictures, 1, 0.0, 1000));
        assert!(!put(&mut pictures, 2, 0.0, 1000));
        assert!(put(&mut pictures, 1, 0.1, 1000));
        assert_eq!(taken(&mut pictures), [(1, 0.1), (2, 0.0)]);
        for t in [0.2, 0.3, 0.4] {
            put(&mut pictures, 1, t, 1000);
        }
        assert_eq!(taken(&mut pictures), [(1, 0.4)]);
        put(&mut pictures, 1, 0.5, 1000);
        assert_eq!(taken(&mut pictures), []);
        pictures.shown(1);
        assert_eq!(taken(&mut pictures), [(1, 0.5)]);
        // What was never sent can't be shown.
        (0..9).for_each(|_| pictures.shown(7));
    }

    #[test]
    fn few_bytes_are_on_their_way_and_a_large_picture_alone() {
        let mut pictures = Pictures::default();
        for stream in 1..=3 {
            put(&mut pictures, stream, 0.0, 45_000);
        }
        assert_eq!(taken(&mut pictures).len(), 2);
        (1..=2).for_each(|stream| pictures.shown(stream));
        put(&mut pictures, 9, 0.0, 1 << 20);
        assert_eq!(taken(&mut pictures), [(3, 0.0), (9, 0.0)]);
        put(&mut pictures, 1, 1.0, 10);
        assert_eq!(taken(&mut pictures), []);
    }

    #[test]
    fn what_is_on_its_way_follows_the_link() {
        let mut pictures = Pictures::default();
        (0..100).for_each(|_| pictures.follow(0.5));
        assert!((pictures.most_bytes - BOUNDS_BYTES.0).abs() < 1.0);
        (0..100).for_each(|_| pictures.follow(0.01));
        assert!((pictures.most_bytes - BOUNDS_BYTES.1).abs() < 1.0);
        // A link of 625 kB/s, whose queue holds what was sent: it settles where a picture takes a tenth of a second.
        for _ in 0..200 {
            pictures.follow(pictures.most_bytes / 625_000.0);
        }
        assert!((pictures.most_bytes - 62_500.0).abs() < 7000.0, "{}", pictures.most_bytes);
    }

    #[test]
    fn no_more_a_second_are_sent_than_are_drawn_and_the_last_one_is() {
        let mut pictures = Pictures::default();
        let mut put = |t: f64| {
            let is_missed = pictures.put(Arc::new(picture(1, t, 100)), 0.001);
            (is_missed, taken(&mut pictures))
        };
        assert_eq!(put(0.0), (false, vec![(1, 0.0)]));
        // The client is not too slow for those that it does not draw.
        assert_eq!((put(0.1), put(0.2)), ((false, vec![]), (false, vec![])));
        assert!((pictures.newest[&1].picture.t - 0.2).abs() < 1e-9);
        pictures.put(Arc::new(picture(1, 0.3, 100)), 1e9);
        assert_eq!(taken(&mut pictures), [(1, 0.3)]);
    }
}
