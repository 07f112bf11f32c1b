//! The pictures waiting for one client: the newest of each camera or, for video, every frame up to the newest. They are
//! sent only as fast as the client shows them.
//!
//! A picture is large, and every picture in flight delays the marker behind it: in the kernel, in the network, in the
//! browser. So the next one is sent only when the client has shown the previous ones. A frame of video is of no use
//! without the earlier ones: a client that is too slow for them continues with the next key frame.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Bound::{Excluded, Unbounded};
use std::sync::Arc;

use teampulse_core::clock::Stopwatch;

use crate::pictures::{Picture, Place};

/// The initial amount in flight, and the bounds within which it adapts to the link [bytes]. A single picture may be
/// larger.
const FIRST_BYTES: f64 = (64 << 10) as f64;
const BOUNDS_BYTES: (f64, f64) = ((16 << 10) as f64, (1 << 20) as f64);
/// How long a picture should be in flight [s], so that a marker behind it is hardly delayed.
const AIM_SECS: f64 = 0.1;
/// The largest factor by which a single picture changes the amount in flight.
const STEP: f64 = 1.1;
/// The maximum number of pictures of one stream in flight, so that one is drawn while the next one arrives; video has a
/// higher limit, as its frames are small and each is needed.
const MOST_EACH: usize = 2;
const MOST_FRAMES: usize = 16;
/// The time after which waiting frames of video are dropped, up to the next key frame [s].
const LATE_SECS: f64 = 2.0;

/// The pictures waiting for one client.
#[derive(Debug)]
pub struct Pictures {
    queues: BTreeMap<u32, Queue>,
    /// The size of each picture that was sent and not yet shown [bytes], and the time since.
    on_their_way: BTreeMap<u32, VecDeque<(usize, Stopwatch)>>,
    bytes: usize,
    /// The amount that may be in flight [bytes].
    most_bytes: f64,
    /// The stream whose picture was sent last; the streams after it are served next.
    last: u32,
    /// The time since a picture of each stream was last sent.
    sent: BTreeMap<u32, Stopwatch>,
}

/// The waiting pictures of a stream, oldest first; at most one unless they are frames of video.
#[derive(Debug, Default)]
struct Queue {
    waiting: VecDeque<(Arc<Picture>, Stopwatch)>,
    /// The shortest time since the previous picture [s].
    after_secs: f64,
    /// Whether frames of video were dropped since the last key frame.
    is_cut: bool,
    /// Whether a key frame of video has arrived.
    has_first: bool,
}

impl Default for Pictures {
    fn default() -> Pictures {
        Pictures {
            queues: BTreeMap::new(),
            on_their_way: BTreeMap::new(),
            bytes: 0,
            most_bytes: FIRST_BYTES,
            last: 0,
            sent: BTreeMap::new(),
        }
    }
}

impl Queue {
    /// Drops the waiting pictures; returns how many.
    fn cut(&mut self) -> u64 {
        let cut = self.waiting.len() as u64;
        self.waiting.clear();
        cut
    }

    /// Takes a frame of video; returns how many were dropped.
    fn put_frame(&mut self, picture: Arc<Picture>) -> u64 {
        let oldest = self.waiting.front();
        let is_late = oldest.is_some_and(|(_, since)| since.elapsed().as_secs_f64() > LATE_SECS);
        let mut cut = if is_late { self.cut() } else { 0 };
        self.is_cut |= is_late;
        if picture.place == Place::First {
            (self.has_first, self.is_cut) = (true, false);
        }
        if self.is_cut {
            cut += 1;
        } else if self.has_first {
            self.waiting.push_back((picture, Stopwatch::start()));
        }
        cut
    }
}

impl Pictures {
    /// Takes a picture, of whose stream at most `most_per_sec` pictures per second are shown (0 for all of them);
    /// returns how many were dropped because the client was too slow. All frames of video are shown.
    pub fn put(&mut self, picture: Arc<Picture>, most_per_sec: f64) -> u64 {
        let stream = picture.stream;
        if picture.place != Place::Alone {
            return self.queues.entry(stream).or_default().put_frame(picture);
        }
        let is_due = self.queues.get(&stream).is_some_and(|queue| self.is_due(stream, queue));
        let queue = self.queues.entry(stream).or_default();
        let replaced = queue.cut();
        queue.waiting.push_back((picture, Stopwatch::start()));
        // A tenth earlier still counts as on time, as cameras are not perfectly regular.
        queue.after_secs = if most_per_sec > 0.0 { 0.9 / most_per_sec } else { 0.0 };
        if is_due { replaced } else { 0 }
    }

    /// The next picture to send. A picture that is not due yet waits until something else is sent, for at most a
    /// second.
    pub fn take(&mut self) -> Option<Arc<Picture>> {
        if self.bytes as f64 >= self.most_bytes {
            return None;
        }
        let after = self.queues.range((Excluded(self.last), Unbounded)).chain(self.queues.iter());
        let mut next = after.filter(|(stream, queue)| self.is_free(**stream, queue));
        let stream = *next.next()?.0;
        let (picture, _) = self.queues.get_mut(&stream)?.waiting.pop_front()?;
        let size = picture.size();
        let now = Stopwatch::start();
        self.on_their_way.entry(stream).or_default().push_back((size, now));
        self.sent.insert(stream, now);
        self.bytes += size;
        self.last = stream;
        Some(picture)
    }

    /// Whether the next picture of a stream may be sent.
    fn is_free(&self, stream: u32, queue: &Queue) -> bool {
        let Some((picture, _)) = queue.waiting.front() else { return false };
        let most = if picture.place == Place::Alone { MOST_EACH } else { MOST_FRAMES };
        let on_their_way = self.on_their_way.get(&stream).map_or(0, VecDeque::len);
        on_their_way < most && self.is_due(stream, queue)
    }

    fn is_due(&self, stream: u32, queue: &Queue) -> bool {
        let sent = self.sent.get(&stream);
        sent.is_none_or(|sent| sent.elapsed().as_secs_f64() >= queue.after_secs)
    }

    /// Notes that the client has shown the oldest picture of a stream that was in flight.
    pub fn shown(&mut self, stream: u32) {
        let shown = self.on_their_way.get_mut(&stream).and_then(VecDeque::pop_front);
        let Some((size, sent)) = shown else { return };
        self.bytes -= size;
        self.follow(sent.elapsed().as_secs_f64());
    }

    /// Adapts the amount in flight to how long a picture was in flight [s]: the longer, the less is sent at once.
    fn follow(&mut self, secs: f64) {
        let step = (AIM_SECS / secs.max(1e-3)).clamp(1.0 / STEP, STEP);
        self.most_bytes = (self.most_bytes * step).clamp(BOUNDS_BYTES.0, BOUNDS_BYTES.1);
    }

    /// Drops the waiting pictures.
    pub fn forget(&mut self) {
        self.queues.clear();
        self.sent.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::tests::{frame_of_video, picture};

    fn put(pictures: &mut Pictures, stream: u32, t: f64, size: usize) -> u64 {
        pictures.put(Arc::new(picture(stream, t, size)), 0.0)
    }

    fn taken(pictures: &mut Pictures) -> Vec<(u32, f64)> {
        std::iter::from_fn(|| pictures.take()).map(|picture| (picture.stream, picture.t)).collect()
    }

    #[test]
    fn the_newest_of_each_stream_is_sent_in_turn_while_those_before_are_shown() {
        let mut pictures = Pictures::default();
        assert_eq!(put(&mut pictures, 1, 0.0, 1000), 0);
        assert_eq!(put(&mut pictures, 2, 0.0, 1000), 0);
        assert_eq!(put(&mut pictures, 1, 0.1, 1000), 1);
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
            let missed = pictures.put(Arc::new(picture(1, t, 100)), 0.001);
            (missed, taken(&mut pictures))
        };
        assert_eq!(put(0.0), (0, vec![(1, 0.0)]));
        // The client is not too slow for those that it does not draw.
        assert_eq!((put(0.1), put(0.2)), ((0, vec![]), (0, vec![])));
        assert!((pictures.queues[&1].waiting[0].0.t - 0.2).abs() < 1e-9);
        pictures.put(Arc::new(picture(1, 0.3, 100)), 1e9);
        assert_eq!(taken(&mut pictures), [(1, 0.3)]);
    }

    #[test]
    fn each_frame_of_video_is_sent_and_a_slow_client_goes_on_where_none_before_is_needed() {
        let mut pictures = Pictures::default();
        let put = |pictures: &mut Pictures, t: f64, place| {
            pictures.put(Arc::new(frame_of_video(1, t, 100, place)), 10.0)
        };
        // Of one who begins to look in between, nothing is missed.
        assert_eq!((put(&mut pictures, 0.0, Place::Next), taken(&mut pictures)), (0, vec![]));
        put(&mut pictures, 1.0, Place::First);
        (2..30).for_each(|t| assert_eq!(put(&mut pictures, f64::from(t), Place::Next), 0));
        let sent = taken(&mut pictures);
        assert_eq!((sent.len(), sent[0], sent[15]), (MOST_FRAMES, (1, 1.0), (1, 16.0)));
        assert_eq!(pictures.queues[&1].waiting.len(), 13);
        // It was too slow: what waits and what follows is left out.
        pictures.queues.get_mut(&1).unwrap().is_cut = true;
        assert_eq!(pictures.queues.get_mut(&1).unwrap().cut(), 13);
        assert_eq!(put(&mut pictures, 30.0, Place::Next), 1);
        (0..16).for_each(|_| pictures.shown(1));
        assert_eq!(taken(&mut pictures), []);
        assert_eq!(put(&mut pictures, 31.0, Place::First), 0);
        assert_eq!(put(&mut pictures, 32.0, Place::Next), 0);
        assert_eq!(taken(&mut pictures), [(1, 31.0), (1, 32.0)]);
    }
}
