//! Distances between people and robots.

mod pair;
mod place;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Shape, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_signal::estimate::Estimate;

use self::pair::{Pair, Second};
use self::place::Place;
use crate::context::{FeatureContext, duration_setting};
use crate::inputs::Inputs;
use crate::over::refuse;
use crate::value::window_of;
use crate::whole_seconds::WholeSeconds;

/// The family of distances.
pub(crate) const FAMILY: &str = "proximity";
/// The most pairs of a person and a robot whose distance is computed.
const MOST_PAIRS: usize = 256;
/// The frame of a robot's own odometry (REP-105): every robot has its own frame of this name.
const OWN_FRAME: &str = "odom";
/// The values of a pair; a person's nearest-robot stream has these, too.
const CHANNELS: [(&str, &str); 3] = [("distance", "m"), ("within", "1"), ("approach_speed", "m/s")];

/// Distances between people and robots.
///
/// - Measures: for each person and each robot with positions in the same frame: the shortest distance in the last
///   second, the share of that second within `within_m`, and the speed of approach (negative when they move apart);
///   for each person, the same for the nearest robot, and the number of robots with a known distance.
/// - Formula: horizontal distance (x and y) of the newest positions, ten times a second; the speed of approach is the
///   distance one second ago minus the current one.
/// - Unit: m, 1, m/s, 1.
/// - Window: 1 s, once a second. `statistics` computes windows, phases and differences from the baseline: the mean of
///   `within` is the share of time.
/// - Reference: Hall (1966), "The Hidden Dimension": personal space ends at 1.2 m (4 ft); measured
///   with robots: Takayama & Pantofaru (2009), doi:10.1109/IROS.2009.5354145.
/// - Limits: positions of people are those that the study names (`position` of the source `hri`), or those of bodies
///   detected by other programs. Frames are compared by name (`header.frame_id`), and nothing is transformed: without
///   a common frame, a distance is undefined. `odom` is local to each robot, so it is not a frame common to several.
///   Distances are between the origins of both, not between their surfaces; only the first 256 pairs are computed,
///   and a fault reports that there are more.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Proximity {
    /// The distance below which a person counts as near [m].
    pub within_m: f64,
    /// The age above which a position counts as unknown [s].
    pub stale_secs: f64,
}

impl Default for Proximity {
    fn default() -> Proximity {
        Proximity { within_m: 1.2, stale_secs: 2.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for Proximity {
    const EXAMPLE: &'static str = "within_m = 1.2";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("stale_secs", self.stale_secs)?;
        if !(self.within_m > 0.0 && self.within_m <= 1000.0) {
            let message = format!("`within_m` is {}: expected a distance above 0 m", self.within_m);
            let hint = "personal space ends at 1.2 m";
            return Err(SettingsError::new(message).with_hint(hint).at("within_m"));
        }
        Ok(Box::new(self))
    }
}

impl Feature for Proximity {
    fn accepts(&self, stream: &Stream) -> bool {
        Place::is_one(stream)
    }

    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(ProximityExtractor {
            settings: *self,
            people: BTreeMap::new(),
            robots: BTreeMap::new(),
            pairs: BTreeMap::new(),
            nearest: BTreeMap::new(),
            inputs: Inputs::default(),
            outputs: BTreeMap::new(),
            seconds: WholeSeconds::default(),
            uncomputed: Uncomputed::default(),
        })
    }
}

/// The positions of a subject, by stream.
type Places = BTreeMap<StreamId, Place>;

struct ProximityExtractor {
    settings: Proximity,
    people: BTreeMap<String, Places>,
    robots: BTreeMap<String, Places>,
    /// The pairs, by person and robot.
    pairs: BTreeMap<(String, String), Pair>,
    /// The ticks of this second in which a person was near any robot, and those in which this is known.
    nearest: BTreeMap<String, [u32; 2]>,
    inputs: Inputs,
    /// The output streams of persons and of pairs.
    outputs: BTreeMap<(String, Option<String>), OutputId>,
    seconds: WholeSeconds,
    uncomputed: Uncomputed,
}

/// The pairs beyond the limit, which are reported once.
#[derive(Default)]
enum Uncomputed {
    #[default]
    None,
    /// The stream of positions that brought the first such pair.
    New(Box<Stream>),
    Reported,
}

impl Extractor for ProximityExtractor {
    fn join(&mut self, id: StreamId, stream: &Stream, _: &mut Outputs) {
        let of = if stream.about == About::Person { &mut self.people } else { &mut self.robots };
        let Some(place) = Place::of(stream) else { return };
        of.entry(stream.id.clone()).or_default().entry(id).or_insert(place);
        self.inputs.join(stream);
        for person in self.people.keys() {
            for robot in self.robots.keys() {
                let pair = (person.clone(), robot.clone());
                if self.pairs.len() < MOST_PAIRS {
                    self.pairs.entry(pair).or_default();
                } else if matches!(self.uncomputed, Uncomputed::None)
                    && !self.pairs.contains_key(&pair)
                {
                    self.uncomputed = Uncomputed::New(Box::new(stream.clone()));
                }
            }
        }
    }

    fn push(&mut self, sample: &Sample, _: &mut Outputs) {
        let mut all = self.people.values_mut().chain(self.robots.values_mut());
        if let Some(place) = all.find_map(|places| places.get_mut(&sample.stream)) {
            place.take(sample);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        if self.pairs.is_empty() {
            return;
        }
        self.report_uncomputed(now, out);
        self.measure(now);
        if let Some(second) = self.seconds.passed(now) {
            self.declare(out);
            self.report(second, out);
        }
    }
}

impl ProximityExtractor {
    fn report_uncomputed(&mut self, now: Time, out: &mut Outputs) {
        let Uncomputed::New(stream) = &self.uncomputed else { return };
        let label = format!(
            "{FAMILY}: there are more than {MOST_PAIRS} pairs of a person and a robot: distances of further pairs are not computed"
        );
        refuse((stream, FAMILY), label, MOST_PAIRS as f64, now, out);
        self.uncomputed = Uncomputed::Reported;
    }

    /// Takes in the current distances.
    fn measure(&mut self, now: Time) {
        let stale_secs = self.settings.stale_secs;
        let is_fresh = |place: &&Place| place.is_known_at(now, stale_secs);
        let in_own = |places: &&Places| {
            places.values().filter(is_fresh).any(|place| place.frame() == OWN_FRAME)
        };
        let are_several = self.robots.values().filter(in_own).count() > 1;
        let mut near = BTreeMap::<&str, bool>::new();
        for ((person, robot), pair) in &mut self.pairs {
            let [person_s, robot_s] = [self.people.get(person), self.robots.get(robot)]
                .map(|places| places.into_iter().flat_map(BTreeMap::values).filter(is_fresh));
            let distance = distance(person_s, &robot_s.collect::<Vec<_>>(), are_several);
            let is_near = distance.ok().map(|metres| metres <= self.settings.within_m);
            if let Some(is_near) = is_near {
                *near.entry(person).or_default() |= is_near;
            }
            pair.take(distance, is_near);
        }
        for (person, is_near) in near {
            let ticks = self.nearest.entry(person.to_owned()).or_default();
            *ticks = [ticks[0] + u32::from(is_near), ticks[1] + 1];
        }
    }

    fn report(&mut self, second: Time, out: &mut Outputs) {
        let mut of_people = BTreeMap::<String, Vec<Second>>::new();
        for ((person, robot), pair) in &mut self.pairs {
            let passed = pair.pass();
            let key = (person.clone(), Some(robot.clone()));
            if let Some(output) = self.outputs.get(&key) {
                out.emit(*output, second, data(&passed, None));
            }
            of_people.entry(person.clone()).or_default().push(passed);
        }
        for (person, seconds) in of_people {
            let known = seconds.iter().filter(|each| each.distance.is_ok()).count();
            let [near, ticks] = self.nearest.remove(&person).unwrap_or_default();
            let nearest = Second::nearest(&seconds, (near, ticks));
            if let Some(output) = self.outputs.get(&(person, None)) {
                out.emit(*output, second, data(&nearest, Some(known as f64)));
            }
        }
    }

    fn declare(&mut self, out: &mut Outputs) {
        let Some(inputs) = self.inputs.take_news() else { return };
        let people: BTreeSet<&String> = self.pairs.keys().map(|(person, _)| person).collect();
        let of_people = people.into_iter().map(|person| (person.clone(), None));
        let pairs = self.pairs.keys().map(|(person, robot)| (person.clone(), Some(robot.clone())));
        let keys: Vec<_> = of_people.chain(pairs).collect();
        for key in keys {
            let stream = self.stream(&key, &inputs);
            self.outputs.insert(key, out.declare(stream));
        }
    }

    fn stream(&self, (person, robot): &(String, Option<String>), inputs: &[String]) -> Stream {
        let within_m = self.settings.within_m;
        let name = format!("/humans/persons/{person}/{FAMILY}");
        let stream =
            Stream::concluded(name, Subject::person(person.clone()), FAMILY, Shape::Feature);
        let (stream, whose) = if let Some(robot) = robot {
            (stream.below(robot).with_channels(&CHANNELS), robot.as_str())
        } else {
            let channels = [CHANNELS.as_slice(), &[("robots", "1")]].concat();
            (stream.with_channels(&channels), "the nearest robot")
        };
        Stream {
            inputs: inputs.to_vec(),
            rate_hz: 1.0,
            method: format!(
                "horizontal distance in a common frame, ten times a second: the least within a second; share of the second within \
                 {within_m} m (Hall 1966: 1.2 m); decrease per second"
            ),
            doc: format!("Distance between {person} and {whose}."),
            ..stream
        }
    }
}

/// The distance of the newest positions of both in a common frame [m].
fn distance<'a>(
    person: impl Iterator<Item = &'a Place>,
    robot: &[&Place],
    are_several: bool,
) -> Result<f64, Reason> {
    let mut newest = None;
    let mut is_seen = false;
    for place in person {
        is_seen = true;
        for other in robot.iter().filter(|other| other.frame() == place.frame()) {
            let is_common = !(are_several && place.frame() == OWN_FRAME);
            let at = place.at().min(other.at());
            if is_common && newest.is_none_or(|(known, _)| at > known) {
                newest = Some((at, place.distance_m(other)));
            }
        }
    }
    let is_known = is_seen && !robot.is_empty();
    let none = if is_known { Reason::Undefined } else { Reason::Missing };
    newest.map(|(_, metres)| metres).filter(|metres| metres.is_finite()).ok_or(none)
}

fn data(second: &Second, robots: Option<f64>) -> Data {
    let known = |number: f64| Ok(Estimate::unstated(number));
    let values: Vec<_> = second.values().into_iter().chain(robots.map(known)).collect();
    window_of(1.0, second.coverage, 1.0, &values)
}
