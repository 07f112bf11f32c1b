//! What a stream shows of a person, as given by the names of its channels, and the messages to which it is converted.

use teampulse_core::stream::{Signal, Stream};
use teampulse_core::time::Time;
use teampulse_messages::hri::{FRAME_CHANNELS, Frame};
use teampulse_messages::standard::hri_msgs::{
    ACTION_UNITS, BODY_POINTS, EXPRESSIONS, Expression, FACE_POINTS, FacialActionUnits,
    FacialLandmarks, Gaze, LANDMARKS, NormalizedPointOfInterest2D, NormalizedRegionOfInterest2D,
    SKELETON, Skeleton2D,
};
use teampulse_messages::standard::std_msgs::Header;

use super::Message;

/// The names of face points in `hri_msgs`, each with a name that models use.
const FACE_ALIASES: [(&str, &str); 6] = [
    ("right_pupil", "right_eye"),
    ("left_pupil", "left_eye"),
    ("mouth_outer_right", "right_mouth_corner"),
    ("mouth_outer_left", "left_mouth_corner"),
    ("mouth_outer_right", "mouth_right"),
    ("mouth_outer_left", "mouth_left"),
];
/// The names of expressions that models use, each with the name in `hri_msgs`.
const WORDS: [(&str, &str); 8] = [
    ("anger", "angry"),
    ("disgust", "disgusted"),
    ("fear", "scared"),
    ("fearful", "scared"),
    ("happiness", "happy"),
    ("sadness", "sad"),
    ("surprise", "surprised"),
    ("tiredness", "tired"),
];
const NECK: usize = 1;
const SHOULDERS: [usize; 2] = [2, 5];

/// The part of a person that is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// A face.
    Face,
    /// A body.
    Body,
}

impl Part {
    /// The topic below a person that states the id of this part.
    pub fn id_topic(self) -> &'static str {
        match self {
            Part::Face => "face_id",
            Part::Body => "body_id",
        }
    }

    fn group(self) -> &'static str {
        match self {
            Part::Face => "faces",
            Part::Body => "bodies",
        }
    }
}

/// A stream about a person, in the terms of REP-155.
#[derive(Debug)]
pub(super) struct View {
    /// The part of the person that the stream shows.
    pub part: Part,
    /// The id of the face or body.
    pub id: String,
    person: String,
    shows: Shows,
    frame: Option<Frame>,
    /// The indices of the channels with the size of the frame.
    size: [Option<usize>; 2],
    has_reported: bool,
}

/// The kind of values, and the indices of their channels.
#[derive(Debug)]
enum Shows {
    /// Points in the order of `hri_msgs`, and the region around all of them.
    Points { points: Vec<Option<Place>>, region: Option<[usize; 5]> },
    /// The probability of each word, and valence and arousal.
    Expression { words: Vec<(usize, Option<&'static str>)>, dimensions: [Option<usize>; 2] },
    /// The intensity and score of each action unit, by code.
    Units(Vec<(usize, usize, Option<usize>)>),
    /// Yaw and pitch, and the largest angle at which the person looks at the robot [rad].
    Gaze { angles: [usize; 2], within_rad: f64 },
}

/// The channels of a point.
#[derive(Clone, Copy, Debug)]
struct Place {
    x: usize,
    y: usize,
    score: Option<usize>,
}

impl Place {
    fn of(stream: &Stream, name: &str) -> Option<Place> {
        let channel = |part: &str| stream.place_of(&format!("{name}_{part}"));
        Some(Place { x: channel("x")?, y: channel("y")?, score: channel("score") })
    }
}

impl View {
    /// Returns the view of a stream; `None` if it shows nothing of this kind.
    pub fn of(
        stream: &Stream,
        id: String,
        (frame, within_rad): (Option<Frame>, f64),
    ) -> Option<View> {
        let (part, shows) = match stream.signal {
            Signal::Face => (Part::Face, points(stream, &LANDMARKS)),
            Signal::Body => (Part::Body, points(stream, &SKELETON)),
            Signal::Expression => (Part::Face, Some(expression(stream))),
            _ => (Part::Face, units(stream).or_else(|| gaze(stream, within_rad))),
        };
        let size = FRAME_CHANNELS.map(|name| stream.place_of(name));
        let person = stream.id.clone();
        Some(View { part, id, person, shows: shows?, frame, size, has_reported: false })
    }

    /// Returns the messages for the values of a picture; none if nothing was found. An error, whose text follows the
    /// stream's name, is returned only once.
    pub fn messages(&mut self, at: Time, numbers: &[f64]) -> Result<Vec<Message>, &'static str> {
        let header = Header::at(at);
        let number = |place: usize| numbers.get(place).copied().unwrap_or(f64::NAN);
        let topic = |leaf: &str| format!("{}/{}/{leaf}", self.part.group(), self.id);
        let found = match &self.shows {
            Shows::Points { points, region } => {
                let Some(frame) = self.frame(&number) else {
                    if std::mem::replace(&mut self.has_reported, true) {
                        return Ok(Vec::new());
                    }
                    return Err(
                        "is not published: it does not state the size of its frames; set `frame`",
                    );
                };
                let scored = region.map(|region| number(region[4]));
                let seen = placed(points, frame, scored, &number);
                let region = region.map(|region| region.map(number));
                let region = region.and_then(|region| framed(&header, region, frame));
                let region = region.map(|region| Message::new(topic("roi"), &region));
                let seen = seen.map(|seen| match self.part {
                    Part::Face => {
                        Message::new(topic("landmarks"), &landmarks(header, &seen, frame))
                    }
                    Part::Body => Message::new(topic("skeleton2d"), &skeleton(header, &seen)),
                });
                return Ok(region.into_iter().chain(seen).collect());
            }
            Shows::Expression { words, dimensions } => {
                let dimensions = dimensions.map(|place| place.map_or(f64::NAN, number));
                let seen = expressed(header, words, dimensions, &number);
                seen.map(|seen| Message::new(topic("expression"), &seen))
            }
            Shows::Units(units) => {
                let seen = intensities(header, units, &number);
                seen.map(|seen| Message::new(topic("facs"), &seen))
            }
            Shows::Gaze { angles, within_rad } => {
                let [yaw, pitch] = angles.map(number);
                // The angle between the gaze and straight ahead.
                let off_rad = (yaw.cos() * pitch.cos()).clamp(-1.0, 1.0).acos();
                let sender = self.person.clone();
                let gaze = Gaze { header, sender, receiver: String::new() };
                let topic = "interactions/gazing".to_owned();
                (off_rad <= *within_rad).then(|| Message::new(topic, &gaze))
            }
        };
        Ok(found.into_iter().collect())
    }

    /// Returns the size of the frame, from the values or else from the settings.
    fn frame(&self, number: &impl Fn(usize) -> f64) -> Option<[f64; 2]> {
        let stated = match self.size {
            [Some(width), Some(height)] => [width, height].map(number),
            _ => self.frame?.map(f64::from),
        };
        Some(stated).filter(|sides| sides.iter().all(|side| (1.0..=1e6).contains(side)))
    }
}

fn points(stream: &Stream, names: &[&str]) -> Option<Shows> {
    let point = |name: &&str| {
        let mut aliases = FACE_ALIASES.iter().filter(|(known, _)| known == name);
        Place::of(stream, name).or_else(|| aliases.find_map(|(_, alias)| Place::of(stream, alias)))
    };
    let points: Vec<Option<Place>> = names.iter().map(point).collect();
    let sides = ["left", "top", "width", "height", "score"].map(|name| stream.place_of(name));
    let region = match sides {
        [Some(left), Some(top), Some(width), Some(height), Some(score)] => {
            Some([left, top, width, height, score])
        }
        _ => None,
    };
    let is_any = region.is_some() || points.iter().any(Option::is_some);
    is_any.then_some(Shows::Points { points, region })
}

fn expression(stream: &Stream) -> Shows {
    let dimension = |name: &str| {
        stream.channels.iter().position(|channel| channel.name.eq_ignore_ascii_case(name))
    };
    let word = |name: &str| {
        let name = name.to_lowercase();
        let alias = WORDS.iter().find(|(alias, _)| *alias == name).map(|(_, word)| *word);
        alias.or_else(|| EXPRESSIONS.into_iter().find(|word| *word == name))
    };
    let is_class =
        |name: &str| !["valence", "arousal", "dominance"].contains(&name.to_lowercase().as_str());
    let channels = stream.channels.iter().enumerate();
    let classes = channels.filter(|(_, channel)| is_class(&channel.name));
    Shows::Expression {
        words: classes.map(|(place, channel)| (place, word(&channel.name))).collect(),
        dimensions: ["valence", "arousal"].map(dimension),
    }
}

/// Returns the action units in channels such as `AU12`, `au12_r` or `AU12_intensity`; their scores are in `AU12_score`.
fn units(stream: &Stream) -> Option<Shows> {
    let place = |(place, name): (usize, &str)| {
        let (code, rest) = code(name)?;
        let score = stream.place_of(&format!("{}_score", name.strip_suffix(rest)?));
        ["", "_r", "_intensity"].contains(&rest).then_some((code, place, score))
    };
    let names = stream.channels.iter().map(|channel| channel.name.as_str());
    let units: Vec<_> = names.enumerate().filter_map(place).collect();
    (!units.is_empty()).then_some(Shows::Units(units))
}

/// Returns the code of an action unit in the name of a channel, and what follows the code.
fn code(name: &str) -> Option<(usize, &str)> {
    let (head, rest) = name.split_at_checked(2)?;
    let digits = rest.len() - rest.trim_start_matches(|each: char| each.is_ascii_digit()).len();
    let code: usize = rest[..digits].parse().ok()?;
    (head.eq_ignore_ascii_case("au") && code < ACTION_UNITS).then_some((code, &rest[digits..]))
}

fn gaze(stream: &Stream, within_rad: f64) -> Option<Shows> {
    let angle = |name: &str| stream.place_of(name).filter(|at| stream.channels[*at].unit == "rad");
    Some(Shows::Gaze { angles: [angle("yaw")?, angle("pitch")?], within_rad })
}

/// Returns the points of a picture; `None` if none was found. Points without a score get the score of their region.
fn placed(
    points: &[Option<Place>],
    frame: [f64; 2],
    region_score: Option<f64>,
    number: &impl Fn(usize) -> f64,
) -> Option<Vec<NormalizedPointOfInterest2D>> {
    let point = |place: &Option<Place>| {
        let place = (*place)?;
        let (x, y) = (number(place.x) / frame[0], number(place.y) / frame[1]);
        let score = place.score.map(number).or(region_score).unwrap_or(1.0);
        let is_found = x.is_finite() && y.is_finite() && score > 0.0;
        let c = score.clamp(0.0, 1.0) as f32;
        is_found.then_some(NormalizedPointOfInterest2D { x: x as f32, y: y as f32, c })
    };
    let points: Vec<_> = points.iter().map(point).collect();
    let is_any = points.iter().any(Option::is_some);
    is_any.then(|| points.into_iter().map(Option::unwrap_or_default).collect())
}

fn framed(
    header: &Header,
    [left, top, width, height, score]: [f64; 5],
    frame: [f64; 2],
) -> Option<NormalizedRegionOfInterest2D> {
    let sides = [left / frame[0], top / frame[1], width / frame[0], height / frame[1], score];
    let inside = |part: f64| part.clamp(0.0, 1.0) as f32;
    sides.iter().all(|side| side.is_finite()).then(|| NormalizedRegionOfInterest2D {
        header: header.clone(),
        xmin: inside(sides[0]),
        ymin: inside(sides[1]),
        xmax: inside(sides[0] + sides[2]),
        ymax: inside(sides[1] + sides[3]),
        c: inside(score),
    })
}

fn landmarks(
    header: Header,
    points: &[NormalizedPointOfInterest2D],
    [width, height]: [f64; 2],
) -> FacialLandmarks {
    let landmarks: [NormalizedPointOfInterest2D; FACE_POINTS] =
        std::array::from_fn(|place| points.get(place).copied().unwrap_or_default());
    FacialLandmarks { header, landmarks, height: height as u32, width: width as u32 }
}

/// Converts a body. A missing neck is placed midway between the shoulders, as `hri_body_detect` does.
fn skeleton(header: Header, points: &[NormalizedPointOfInterest2D]) -> Skeleton2D {
    let mut skeleton: [NormalizedPointOfInterest2D; BODY_POINTS] =
        std::array::from_fn(|place| points.get(place).copied().unwrap_or_default());
    let [right, left] = SHOULDERS.map(|place| skeleton[place]);
    if skeleton[NECK].c == 0.0 && right.c > 0.0 && left.c > 0.0 {
        skeleton[NECK] = NormalizedPointOfInterest2D {
            x: f32::midpoint(right.x, left.x),
            y: f32::midpoint(right.y, left.y),
            c: right.c.min(left.c),
        };
    }
    Skeleton2D { header, skeleton }
}

/// Returns what a face expresses: the most probable word, if `hri_msgs` has it, with valence and arousal; `None` if
/// none of them is known.
fn expressed(
    header: Header,
    words: &[(usize, Option<&'static str>)],
    [valence, arousal]: [f64; 2],
    number: &impl Fn(usize) -> f64,
) -> Option<Expression> {
    let known = words.iter().map(|(place, word)| (number(*place), *word));
    let best = known.filter(|(share, _)| share.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0));
    let word = best.and_then(|(share, word)| Some((share, word?)));
    let is_known = word.is_some() || valence.is_finite() || arousal.is_finite();
    let dimension = |number: f64| {
        if number.is_finite() { number.clamp(-1.0, 1.0) as f32 } else { 0.0 }
    };
    is_known.then(|| Expression {
        header,
        expression: word.map(|(_, word)| word.to_owned()).unwrap_or_default(),
        valence: dimension(valence),
        arousal: dimension(arousal),
        confidence: word.map_or(0.0, |(share, _)| share.clamp(0.0, 1.0) as f32),
    })
}

fn intensities(
    header: Header,
    units: &[(usize, usize, Option<usize>)],
    number: &impl Fn(usize) -> f64,
) -> Option<FacialActionUnits> {
    let mut seen = FacialActionUnits { header, ..FacialActionUnits::default() };
    let mut is_any = false;
    for (code, place, score) in units {
        let (intensity, score) = (number(*place), score.map_or(1.0, number));
        if intensity.is_finite() {
            is_any = true;
            seen.intensity[*code] = intensity as f32;
            seen.confidence[*code] =
                if score.is_finite() { score.clamp(0.0, 1.0) as f32 } else { 0.0 };
        }
    }
    is_any.then_some(seen)
}
