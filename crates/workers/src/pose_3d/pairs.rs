//! Pairs frames of points with the depth pictures from the same time.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::stream::StreamId;
use teampulse_core::time::Time;

/// How long a frame waits for its depth picture, after it was taken [s].
const PATIENCE_SECS: f64 = 1.0;
/// How long depth pictures are held for the frames of a slow model [s].
const HOLD_SECS: f64 = 5.0;
/// The most depth pictures that are held [bytes].
const MOST_BYTES: usize = 256 << 20;
/// The most frames that wait.
const MOST_FRAMES: usize = 1024;

/// The points of a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    /// The stream of the points.
    pub stream: StreamId,
    /// When the frame was taken.
    pub taken: Time,
    /// The numbers of the stream.
    pub values: Arc<[f64]>,
}

/// Waiting frames, and depth pictures.
pub(super) struct Pairs {
    within_secs: f64,
    frames: VecDeque<Frame>,
    depths: VecDeque<(Time, Bytes)>,
    bytes: usize,
    newest: Option<Time>,
}

impl Pairs {
    /// Starts without frames. A depth picture fits a frame if their times differ by at most `within_secs`.
    pub(super) fn new(within_secs: f64) -> Pairs {
        let (frames, depths) = (VecDeque::new(), VecDeque::new());
        Pairs { within_secs, frames, depths, bytes: 0, newest: None }
    }

    /// Takes in the message with a depth picture.
    pub(super) fn push_depth(&mut self, taken: Time, message: Bytes) {
        self.bytes += message.len();
        self.depths.push_back((taken, message));
        self.newest = Some(self.newest.map_or(taken, |newest| newest.max(taken)));
        let is_old = |(oldest, _): &(Time, Bytes)| taken.secs_since(*oldest) > HOLD_SECS;
        while self.depths.len() > 1
            && (self.bytes > MOST_BYTES || self.depths.front().is_some_and(is_old))
        {
            let dropped = self.depths.pop_front();
            self.bytes -= dropped.map_or(0, |(_, message)| message.len());
        }
    }

    /// Takes in a frame. Returns the oldest frame if there are too many.
    pub(super) fn push_frame(&mut self, frame: Frame) -> Option<Frame> {
        self.frames.push_back(frame);
        (self.frames.len() > MOST_FRAMES).then(|| self.frames.pop_front()).flatten()
    }

    /// Takes out the frames that need not wait any longer: a depth picture from the same or a later time has arrived,
    /// or they have waited too long at `now`. Without a calibration, all frames wait for as long as possible.
    pub(super) fn settled(&mut self, now: Time, has_calibration: bool) -> Vec<Frame> {
        let patience = PATIENCE_SECS + self.within_secs;
        let newest = self.newest.filter(|_| has_calibration);
        let is_settled = |frame: &Frame| {
            newest.is_some_and(|newest| newest >= frame.taken)
                || now.secs_since(frame.taken) > patience
        };
        let (settled, waiting): (Vec<Frame>, Vec<Frame>) =
            self.frames.drain(..).partition(is_settled);
        self.frames = waiting.into();
        settled
    }

    /// The depth picture nearest to a time, if it is close enough.
    pub(super) fn nearest(&self, taken: Time) -> Option<&Bytes> {
        let apart = |(time, _): &&(Time, Bytes)| time.nanos().abs_diff(taken.nanos());
        let (time, message) = self.depths.iter().min_by_key(apart)?;
        (taken.secs_since(*time).abs() <= self.within_secs).then_some(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL: bool = true;

    fn ms(ms: i64) -> Time {
        Time::from_nanos(1_000_000_000_000 + ms * 1_000_000)
    }

    fn frame(at_ms: i64) -> Frame {
        Frame { stream: StreamId(1), taken: ms(at_ms), values: Arc::new([]) }
    }

    fn taken(frames: Vec<Frame>) -> Vec<Time> {
        frames.into_iter().map(|frame| frame.taken).collect()
    }

    fn depth(number: u8) -> Bytes {
        Bytes::from(vec![number])
    }

    #[test]
    fn a_frame_waits_for_the_depth_picture_of_its_time() {
        let mut pairs = Pairs::new(0.05);
        pairs.push_depth(ms(0), depth(0));
        pairs.push_frame(frame(20));
        assert_eq!(taken(pairs.settled(ms(30), FULL)), []);
        pairs.push_depth(ms(33), depth(1));
        assert_eq!(taken(pairs.settled(ms(40), FULL)), [ms(20)]);
        assert_eq!(taken(pairs.settled(ms(9000), FULL)), []);
        assert_eq!(pairs.nearest(ms(20)), Some(&depth(1)));
        assert_eq!(pairs.nearest(ms(16)), Some(&depth(0)));
    }

    #[test]
    fn a_depth_picture_of_another_time_is_not_taken() {
        let mut pairs = Pairs::new(0.05);
        assert_eq!(pairs.nearest(ms(0)), None);
        pairs.push_depth(ms(0), depth(0));
        assert_eq!((pairs.nearest(ms(51)), pairs.nearest(ms(-51))), (None, None));
        assert_eq!(pairs.nearest(ms(-50)), Some(&depth(0)));
    }

    #[test]
    fn a_frame_whose_depth_picture_never_comes_is_given_up_after_a_second() {
        let mut pairs = Pairs::new(0.05);
        pairs.push_frame(frame(0));
        assert_eq!(taken(pairs.settled(ms(1050), FULL)), []);
        assert_eq!(taken(pairs.settled(ms(1051), FULL)), [ms(0)]);
    }

    #[test]
    fn without_a_calibration_frames_wait_as_long_as_they_may() {
        let mut pairs = Pairs::new(0.05);
        pairs.push_frame(frame(0));
        pairs.push_depth(ms(0), depth(0));
        assert_eq!(taken(pairs.settled(ms(1000), false)), []);
        assert_eq!(taken(pairs.settled(ms(1000), true)), [ms(0)]);
    }

    #[test]
    fn depth_pictures_are_held_for_slow_models_and_no_longer() {
        let mut pairs = Pairs::new(0.05);
        for at in 0..100 {
            pairs.push_depth(ms(at * 100), depth(at as u8));
        }
        assert_eq!(pairs.nearest(ms(4900)), Some(&depth(49)));
        assert_eq!((pairs.nearest(ms(4800)), pairs.bytes), (None, 51));
        let large = Bytes::from(vec![0; MOST_BYTES / 2 + 1]);
        pairs.push_depth(ms(9900), large.clone());
        pairs.push_depth(ms(9901), large);
        assert_eq!((pairs.depths.len(), pairs.bytes), (1, MOST_BYTES / 2 + 1));
    }

    #[test]
    fn no_more_frames_wait_than_there_is_room_for() {
        let mut pairs = Pairs::new(0.05);
        let pushed_out: Vec<Frame> =
            (0..MOST_FRAMES as i64 + 2).filter_map(|at| pairs.push_frame(frame(at))).collect();
        assert_eq!(taken(pushed_out), [ms(0), ms(1)]);
    }
}
