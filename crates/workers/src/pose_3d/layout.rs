//! Finds points among the channels of a stream.

use teampulse_core::stream::{Channel, Stream};
use teampulse_messages::hri::FRAME_CHANNELS;
use teampulse_vision::depth::{Depth, Intrinsics, Patch, Unplaced, is_alike, scaled};

/// The channels that count the points without a distance, and the points at an edge.
const COUNTS: [&str; 2] = ["holes", "edges"];

/// The points of a stream, by its channels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    points: Vec<Point>,
    /// The indices of the channels with the width and the height of the frame.
    size: Option<[usize; 2]>,
}

/// The indices of the channels of a point.
#[derive(Clone, Debug, PartialEq)]
struct Point {
    name: String,
    place: [usize; 2],
    score: Option<usize>,
}

impl Layout {
    /// The points in pixels of a stream; `None` if it has none.
    pub(super) fn of(stream: &Stream) -> Option<Layout> {
        let point = |(x, channel): (usize, &Channel)| {
            let name = channel.name.strip_suffix("_x").filter(|_| channel.unit == "px")?;
            let y = stream.place_of(&format!("{name}_y"))?;
            // The points of a face or a palm share one score.
            let score = stream.place_of(&format!("{name}_score"));
            let score = score.or_else(|| stream.place_of("score"));
            Some(Point { name: name.to_owned(), place: [x, y], score })
        };
        let points: Vec<Point> = stream.channels.iter().enumerate().filter_map(point).collect();
        let [width, height] = FRAME_CHANNELS.map(|name| stream.place_of(name));
        let size = width.zip(height).map(|(width, height)| [width, height]);
        (!points.is_empty()).then_some(Layout { points, size })
    }

    /// The channels of the same points in space.
    pub(super) fn channels(&self) -> Vec<Channel> {
        let each = |point: &Point| {
            [("x", "m"), ("y", "m"), ("z", "m"), ("score", "1")]
                .map(|(part, unit)| Channel::new(format!("{}_{part}", point.name), unit))
        };
        let counts = COUNTS.map(|name| Channel::new(name, "1"));
        self.points.iter().flat_map(each).chain(counts).collect()
    }

    /// The points of a frame in space, and how many were left out. Fails with the size of the frame [px] if the depth
    /// picture can't show the same view.
    pub(super) fn in_space(
        &self,
        values: &[f64],
        depth: &Depth,
        intrinsics: &Intrinsics,
        patch: &Patch,
    ) -> Result<Vec<f64>, [f64; 2]> {
        let number = |place: usize| values.get(place).copied().unwrap_or(f64::NAN);
        // Without a size, points are in pixels of the depth picture.
        let frame = self.size.map_or(depth.size(), |size| size.map(number));
        if !is_alike(frame, depth.size()) {
            return Err(frame);
        }
        let (mut holes, mut edges) = (0_u32, 0_u32);
        let mut numbers = Vec::with_capacity(4 * self.points.len() + COUNTS.len());
        for point in &self.points {
            let place = point.place.map(number);
            let place = scaled(place, frame, depth.size());
            let is_known = place.iter().all(|side| side.is_finite());
            let distance = is_known.then(|| patch.distance(depth, place));
            match distance {
                Some(Ok(distance)) => {
                    numbers.extend(intrinsics.in_space(place, distance));
                    numbers.push(point.score.map_or(1.0, number));
                    continue;
                }
                Some(Err(Unplaced::Hole)) => holes += 1,
                Some(Err(Unplaced::Edge)) => edges += 1,
                None => {}
            }
            numbers.extend([f64::NAN, f64::NAN, f64::NAN, 0.0]);
        }
        numbers.extend([holes, edges].map(f64::from));
        Ok(numbers)
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use teampulse_core::stream::{Shape, Subject};
    use teampulse_messages::standard::Message as _;
    use teampulse_messages::standard::sensor_msgs::Image;

    use super::*;
    use crate::pose_3d::tests::info;

    const PATCH: Patch = Patch { side: 3, most_spread_m: 0.1 };

    fn stream(channels: &[(&str, &str)]) -> Stream {
        let stream = Stream::raw("/p/rtmpose", Subject::person("p001"), Shape::Sample);
        stream.with_channels(channels)
    }

    fn pose() -> Layout {
        let channels = [
            ("nose_x", "px"),
            ("nose_y", "px"),
            ("nose_score", "1"),
            ("hip_x", "px"),
            ("hip_y", "px"),
            ("hip_score", "1"),
            ("frame_width", "px"),
            ("frame_height", "px"),
        ];
        Layout::of(&stream(&channels)).unwrap()
    }

    /// 40 × 30 pixels: 2 m on the left and 3 m on the right, and nothing in the last ten columns.
    fn depth() -> Depth {
        let at = |column: u16| match column {
            0..20 => 2000_u16,
            20..30 => 3000,
            _ => 0,
        };
        let row: Vec<u8> = (0..40).flat_map(|column| at(column).to_le_bytes()).collect();
        let (encoding, data) = ("16UC1".to_owned(), row.repeat(30));
        let image = Image { encoding, width: 40, height: 30, step: 80, data, ..Image::default() };
        Depth::read(&image.encode()).unwrap()
    }

    fn placed(values: &[f64]) -> Result<Vec<f64>, [f64; 2]> {
        let info: Bytes = info([40, 30], [40.0, 40.0, 19.5, 14.5]);
        pose().in_space(values, &depth(), &Intrinsics::read(&info).unwrap(), &PATCH)
    }

    fn assert_near(is: &[f64], expected: &[f64]) {
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9 || (a.is_nan() && b.is_nan());
        assert!(is.len() == expected.len() && is.iter().zip(expected).all(is_near), "{is:?}");
    }

    const NAN: f64 = f64::NAN;

    #[test]
    fn points_keep_their_names_and_scores() {
        let names: Vec<(String, String)> =
            pose().channels().into_iter().map(|it| (it.name, it.unit)).collect();
        let of = |place: usize| (names[place].0.as_str(), names[place].1.as_str());
        assert_eq!([of(0), of(2), of(3)], [("nose_x", "m"), ("nose_z", "m"), ("nose_score", "1")]);
        assert_eq!((of(7), of(8), of(9)), (("hip_score", "1"), ("holes", "1"), ("edges", "1")));
        let seen = placed(&[9.5, 14.5, 0.75, 25.5, 4.5, 0.5, 40.0, 30.0]).unwrap();
        assert_near(&seen, &[-0.5, 0.0, 2.0, 0.75, 0.45, -0.75, 3.0, 0.5, 0.0, 0.0]);
    }

    #[test]
    fn points_in_a_hole_at_an_edge_or_unknown_have_no_place_and_no_score() {
        let seen = placed(&[20.0, 14.5, 0.75, 35.0, 4.5, 0.5, 40.0, 30.0]).unwrap();
        assert_near(&seen, &[NAN, NAN, NAN, 0.0, NAN, NAN, NAN, 0.0, 1.0, 1.0]);
        let seen = placed(&[NAN, NAN, 0.75, 1e300, -1e300, 0.5, 40.0, 30.0]).unwrap();
        assert_near(&seen, &[NAN, NAN, NAN, 0.0, NAN, NAN, NAN, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_frame_of_another_size_is_the_same_view_and_one_of_other_proportions_is_not() {
        let seen = placed(&[19.5, 29.5, 0.75, 51.5, 9.5, 0.5, 80.0, 60.0]).unwrap();
        assert_near(&seen[..4], &[-0.5, 0.0, 2.0, 0.75]);
        for [width, height] in [[848.0, 480.0], [0.0, 0.0], [NAN, 30.0], [1e300, 1e300]] {
            let refused = placed(&[9.5, 14.5, 0.75, 25.5, 4.5, 0.5, width, height]);
            assert!(refused.is_err(), "{width} × {height}");
        }
    }

    #[test]
    fn what_has_no_points_in_pixels_is_not_taken() {
        assert_eq!(Layout::of(&stream(&[("nose_x", "m"), ("nose_y", "m")])), None);
        assert_eq!(Layout::of(&stream(&[("nose_x", "px"), ("brightness", "1")])), None);
        let face = [("left", "px"), ("score", "1"), ("nose_x", "px"), ("nose_y", "px")];
        let face = Layout::of(&stream(&face)).unwrap();
        assert_eq!((face.points[0].score, face.size), (Some(1), None));
    }
}
