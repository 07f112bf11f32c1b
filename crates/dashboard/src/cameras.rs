//! The state of each camera: its newest picture, or why none can be shown; for video, all frames that the newest one
//! depends on; and, while a detector finds points in its pictures, those of the last two seconds, as points arrive
//! later than their picture.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::pictures::{Picture, Place, Unshown};

/// The longest run of video frames that is kept [bytes]; a longer run is dropped until the next key frame.
const RUN_BYTES: usize = 16 << 20;
/// How long a picture is kept for its points [s], and the memory for the kept pictures of a camera [bytes].
const KEPT_SECS: f64 = 2.0;
const KEPT_BYTES: usize = 16 << 20;
/// How long pictures wait for their points [s]: this long after the last points, plus the interval between the last
/// two, but no longer than the second constant.
const AWAITED_SECS: f64 = 2.0;
const LONGEST_SECS: f64 = 5.0;
/// Half the assumed frame period of a camera with only one kept picture [s].
const HALF_PERIOD_SECS: f64 = 1.0 / 60.0;

/// The state of each camera.
#[derive(Debug, Default)]
pub struct Cameras(BTreeMap<u32, Camera>);

#[derive(Debug, Default)]
struct Camera {
    newest: Option<Arc<Picture>>,
    unshown: Option<Unshown>,
    /// The frames of video from the last key frame on.
    run: Vec<Arc<Picture>>,
    run_bytes: usize,
    /// The pictures of the last two seconds, if a detector finds points in them.
    kept: VecDeque<Arc<Picture>>,
    kept_bytes: usize,
    /// The time of the newest picture whose points have arrived [s].
    looked: Option<f64>,
    /// The time to that picture from the previous one with points [s].
    pace_secs: f64,
    /// The newest picture that was matched with its points.
    found: Option<Arc<Picture>>,
}

/// The viewers to whom a picture is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// All viewers.
    Now,
    /// Viewers who don't draw points; for the others, the picture waits for its points.
    ToAwait,
    /// Viewers who draw points, as the points have arrived.
    Found,
}

impl Cameras {
    /// Takes a camera's picture, or the reason why it can't be shown; returns to whom the picture is sent.
    pub fn take(&mut self, id: u32, picture: Result<Arc<Picture>, Unshown>) -> Option<Due> {
        let camera = self.0.entry(id).or_default();
        match picture {
            Ok(picture) => Some(camera.take(picture)),
            Err(unshown) => {
                camera.unshown = Some(unshown);
                None
            }
        }
    }

    /// Why a camera's pictures can't be shown; `None` if they can, or if nothing has arrived from it.
    pub fn unshown(&self, id: u32) -> Option<&Unshown> {
        self.0.get(&id)?.unshown.as_ref()
    }

    /// Whether anything has arrived from a camera.
    pub fn has(&self, id: u32) -> bool {
        self.0.contains_key(&id)
    }

    /// Notes that points have arrived for a camera's picture of this time [s]. Returns the picture if it is kept and no
    /// points as new have arrived before.
    pub fn look(&mut self, id: u32, t: f64) -> Option<Arc<Picture>> {
        self.0.get_mut(&id)?.look(t)
    }

    /// The pictures for a viewer who starts to watch a camera, with or without points: for video, all frames that the
    /// newest one depends on.
    pub fn start(&self, id: u32, with_points: bool) -> Vec<Arc<Picture>> {
        let Some(camera) = self.0.get(&id) else { return Vec::new() };
        let Some(newest) = &camera.newest else { return Vec::new() };
        if newest.place != Place::Alone {
            return camera.run.clone();
        }
        let found = camera.found.as_ref().filter(|_| with_points && camera.is_awaited(newest.t));
        vec![Arc::clone(found.unwrap_or(newest))]
    }
}

impl Camera {
    fn take(&mut self, picture: Arc<Picture>) -> Due {
        let due = match picture.place {
            Place::Alone if self.is_awaited(picture.t) => Due::ToAwait,
            _ => Due::Now,
        };
        match picture.place {
            Place::Alone if self.looked.is_some() => self.keep(&picture),
            Place::Alone => {}
            Place::First => {
                self.run = vec![Arc::clone(&picture)];
                self.run_bytes = picture.held_bytes();
            }
            Place::Next => self.go_on(&picture),
        }
        (self.newest, self.unshown) = (Some(picture), None);
        due
    }

    fn go_on(&mut self, picture: &Arc<Picture>) {
        if self.run.is_empty() {
            return;
        }
        self.run_bytes += picture.held_bytes();
        self.run.push(Arc::clone(picture));
        if self.run_bytes > RUN_BYTES {
            self.run = Vec::new();
        }
    }

    fn keep(&mut self, picture: &Arc<Picture>) {
        self.kept_bytes += picture.held_bytes();
        self.kept.push_back(Arc::clone(picture));
        let is_over = |oldest: &Arc<Picture>, bytes: usize| {
            (oldest.t - picture.t).abs() > KEPT_SECS || bytes > KEPT_BYTES
        };
        while self.kept.front().is_some_and(|oldest| is_over(oldest, self.kept_bytes)) {
            self.kept_bytes -= self.kept.pop_front().map_or(0, |oldest| oldest.held_bytes());
        }
    }

    /// Whether the points of a picture of this time [s] may still arrive.
    fn is_awaited(&self, t: f64) -> bool {
        let most = (AWAITED_SECS + self.pace_secs).min(LONGEST_SECS);
        self.looked.is_some_and(|looked| (t - looked).abs() < most)
    }

    fn look(&mut self, t: f64) -> Option<Arc<Picture>> {
        // The points of a slower detector are drawn on the pictures that a faster one has already released.
        let is_new = self.looked.is_none_or(|looked| t > looked || looked - t > KEPT_SECS);
        if !is_new {
            return None;
        }
        let since = self.looked.replace(t).map_or(0.0, |looked| t - looked);
        self.pace_secs = since.clamp(0.0, LONGEST_SECS);
        let off = |picture: &Arc<Picture>| (picture.t - t).abs();
        let nearest = (0..self.kept.len())
            .min_by(|a, b| off(&self.kept[*a]).total_cmp(&off(&self.kept[*b])))?;
        let found = &self.kept[nearest];
        let beside = [nearest.checked_sub(1), Some(nearest + 1)].into_iter().flatten();
        let period = beside.filter_map(|place| Some((self.kept.get(place)?.t - found.t).abs()));
        let half_secs = period.reduce(f64::min).map_or(HALF_PERIOD_SECS, |period| period / 2.0);
        if off(found) > half_secs {
            return None;
        }
        self.found = Some(Arc::clone(found));
        self.found.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::tests::{frame_of_video, picture};

    fn times(pictures: &[Arc<Picture>]) -> Vec<f64> {
        pictures.iter().map(|picture| picture.t).collect()
    }

    fn take(cameras: &mut Cameras, t: f64) -> Due {
        cameras.take(1, Ok(picture(1, t, 1000).into())).unwrap()
    }

    #[test]
    fn a_picture_is_found_by_the_time_of_its_points_within_half_a_period() {
        let mut cameras = Cameras::default();
        assert_eq!(take(&mut cameras, 0.0), Due::Now);
        // Nothing was kept, as nothing looked.
        assert!(cameras.look(1, 0.0).is_none());
        for k in 1..=10 {
            assert_eq!(take(&mut cameras, f64::from(k) / 10.0), Due::ToAwait);
        }
        let mut found = |t: f64| cameras.look(1, t).map(|picture| picture.t);
        assert_eq!((found(0.3), found(0.3)), (Some(0.3), None));
        assert_eq!((found(0.52), found(0.6 - 1e-6)), (Some(0.5), Some(0.6)));
        assert_eq!((found(0.66), found(0.64)), (Some(0.7), None));
        assert_eq!(found(1.06), None);
        assert_eq!(
            (times(&cameras.start(1, true)), times(&cameras.start(1, false))),
            (vec![0.7], vec![1.0])
        );
        // Nothing looks any more.
        assert_eq!(take(&mut cameras, 3.0), Due::ToAwait);
        assert_eq!(take(&mut cameras, 3.6), Due::Now);
        assert_eq!(times(&cameras.start(1, true)), [3.6]);
        assert!(cameras.look(7, 3.6).is_none());
    }

    #[test]
    fn pictures_are_kept_for_two_seconds_and_in_bounded_memory() {
        let mut cameras = Cameras::default();
        take(&mut cameras, 0.0);
        cameras.look(1, 0.0);
        for k in 1..100 {
            take(&mut cameras, f64::from(k) / 10.0);
        }
        let kept = |cameras: &Cameras| (cameras.0[&1].kept.len(), cameras.0[&1].kept_bytes);
        assert_eq!(kept(&cameras), (21, 21_000));
        for k in 0..30 {
            let large = picture(1, 10.0 + f64::from(k) / 100.0, 1 << 20);
            cameras.take(1, Ok(large.into()));
        }
        assert!(kept(&cameras).1 <= KEPT_BYTES && kept(&cameras).0 >= 15);
    }

    #[test]
    fn who_begins_to_look_at_video_gets_all_frames_that_the_newest_needs() {
        let mut cameras = Cameras::default();
        let take = |cameras: &mut Cameras, t: f64, place: Place, size: usize| {
            assert_eq!(
                cameras.take(1, Ok(frame_of_video(1, t, size, place).into())),
                Some(Due::Now)
            );
        };
        take(&mut cameras, 0.0, Place::Next, 10);
        assert!(cameras.has(1) && cameras.start(1, false).is_empty());
        for (t, place) in
            [(1.0, Place::First), (2.0, Place::Next), (3.0, Place::First), (4.0, Place::Next)]
        {
            take(&mut cameras, t, place, 10);
        }
        assert_eq!(times(&cameras.start(1, true)), [3.0, 4.0]);
        take(&mut cameras, 5.0, Place::Next, RUN_BYTES);
        take(&mut cameras, 6.0, Place::Next, 10);
        assert!(cameras.start(1, true).is_empty());
        take(&mut cameras, 7.0, Place::First, 10);
        assert_eq!(times(&cameras.start(1, true)), [7.0]);
    }

    #[test]
    fn what_can_be_shown_again_has_no_reason_any_more() {
        let mut cameras = Cameras::default();
        assert_eq!(cameras.take(1, Err(Unshown::Large(9))), None);
        assert_eq!(cameras.unshown(1), Some(&Unshown::Large(9)));
        take(&mut cameras, 1.0);
        assert_eq!(cameras.unshown(1), None);
    }
}
