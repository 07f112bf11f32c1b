//! A simulated person as a source: the sensors, the actions, and the ground truth.

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::data::{Data, Event, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::StreamId;
use teampulse_core::time::Time;
use teampulse_emulators::body::{self, Body, Moment, Rates, Record, Traits, Truth};
use teampulse_emulators::task::{Happening, Operator, OperatorOutput, What};

use super::settings::SimulatedTeam;
use super::worn::Worn;
use crate::emulated::EmulatedWearable;

/// The length of each chunk of a signal [s], which is one sample of the slowest signal.
const CHUNK_SECS: f64 = 0.25;
/// The interval between checks for due chunks.
const LOOK: Duration = Duration::from_millis(5);

/// A person who performs a task and wears sensors. The signals are waves of a quarter of a second, offered when the
/// last sample was taken. The same seed gives the same signals, at any speed.
pub struct SimulatedPerson {
    id: String,
    operator: Operator,
    rates: Rates,
    until_secs: Option<f64>,
    /// The clock that the body runs on, if it is shared with devices.
    lives: Option<Stopwatch>,
}

impl SimulatedPerson {
    /// Returns the people of a team, by id: `p001` and so on. The settings must have been checked.
    pub fn of(team: &SimulatedTeam) -> Vec<(String, Box<dyn Source>)> {
        SimulatedPerson::wearing(team, &[], None)
    }

    /// Returns the same people, without the sensors of the wearables that they also wear; those measure the same body
    /// at the same time.
    pub fn wearing(
        team: &SimulatedTeam,
        wearables: &[EmulatedWearable],
        lives: Option<Stopwatch>,
    ) -> Vec<(String, Box<dyn Source>)> {
        let person = |number| {
            let person = SimulatedPerson { lives, ..SimulatedPerson::new(team, number, wearables) };
            (format!("person {}", person.id), Box::new(person) as Box<dyn Source>)
        };
        (1..=team.people).map(person).collect()
    }

    fn new(team: &SimulatedTeam, number: u32, wearables: &[EmulatedWearable]) -> SimulatedPerson {
        let id = format!("p{number:03}");
        let own = wearables.iter().filter(|wearable| wearable.person() == id);
        let rates =
            own.fold(team.body.rates.clone(), |rates, wearable| rates.without(wearable.senses()));
        let model = team.model();
        let seed = model.seed_of_person(number);
        let settings = body::Settings { rates: rates.clone(), ..team.body.clone() };
        let body = Body::wearing(&Traits::of_seed(seed), seed, &settings);
        let body = body.expect("the settings have been checked");
        let operator = Operator::new(body, model.task_of_person(number));
        let until_secs = team.steps.map(f64::from);
        SimulatedPerson { id, operator, rates, until_secs, lives: None }
    }
}

#[async_trait]
impl Source for SimulatedPerson {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let lived = self.lives.map_or(Duration::ZERO, |lives| lives.elapsed());
        let start = outlet.clock().now() - lived;
        let streams = Streams::declare(&self.id, &self.rates, outlet);
        tokio::select! {
            () = self.live(start, &streams, outlet) => {}
            () = outlet.closed() => {}
        }
        Ok(())
    }
}

impl SimulatedPerson {
    /// Offers every chunk when it ends; returns after the last step.
    async fn live(&mut self, start: Time, streams: &Streams, outlet: &Outlet) {
        for chunk in 1_u64.. {
            let secs = chunk as f64 * CHUNK_SECS;
            until(outlet.clock(), after(start, secs)).await;
            let OperatorOutput { happened, record } = self.operator.until(secs);
            let outlet = PersonOutlet { start, streams, outlet };
            outlet.offer_signals(record);
            outlet.offer_truth(&record.truth);
            for happening in happened {
                outlet.offer_happening(happening);
            }
            if self.until_secs.is_some_and(|until_secs| secs >= until_secs) {
                return;
            }
        }
    }
}

fn after(start: Time, secs: f64) -> Time {
    start + Duration::from_secs_f64(secs.max(0.0))
}

async fn until(clock: &Clock, due: Time) {
    while clock.now() < due {
        tokio::time::sleep(LOOK).await;
    }
}

/// The streams of a person.
struct Streams([Option<StreamId>; Worn::ALL.len()]);

impl Streams {
    fn declare(id: &str, rates: &Rates, outlet: &Outlet) -> Streams {
        Streams(Worn::ALL.map(|worn| Some(outlet.declare(worn.stream(id, rates)?))))
    }

    /// Returns the stream; `None` if the sensor is not worn.
    fn of(&self, worn: Worn) -> Option<StreamId> {
        self.0[Worn::ALL.iter().position(|each| *each == worn)?]
    }
}

/// Offers a person's readings to the session.
struct PersonOutlet<'a> {
    start: Time,
    streams: &'a Streams,
    outlet: &'a Outlet,
}

impl PersonOutlet<'_> {
    fn offer_signals(&self, record: &Record) {
        // A sensor without values sends nothing, as if its battery were empty.
        let is_there = |samples: &[f64]| samples.iter().any(|sample| !sample.is_nan());
        for wave in record.waves().filter(|wave| is_there(&wave.samples)) {
            let data = Data::Wave(Wave {
                period_ns: 1e9 / wave.rate_hz,
                channels: wave.sensor.channels().len() as u32,
                samples: wave.samples.as_slice().into(),
            });
            self.offer(Worn::Sensor(wave.sensor), wave.first_secs(), data);
        }
    }

    fn offer_truth(&self, truth: &Truth) {
        for moment in &truth.moments {
            self.offer(Worn::TrueState, moment.secs, Data::Sample(Arc::new(numbers(moment))));
        }
        for beat in &truth.beats {
            self.happen(Worn::TrueBeats, beat.secs, "beat", (f64::NAN, 0.0));
        }
        for each in &truth.responses {
            self.happen(Worn::TrueResponses, each.onset_secs, "response", (each.amplitude_us, 0.0));
        }
        for breath in &truth.breaths {
            self.happen(Worn::TrueBreaths, breath.exhale_secs, "breath", (breath.depth, 0.0));
        }
    }

    fn offer_happening(&self, Happening { at_secs, what }: &Happening) {
        let moment = |value| (value, 0.0);
        let happen = |worn, label: &str, value| self.happen(worn, *at_secs, label, value);
        match *what {
            What::Begins { phase, lasts_secs } => {
                happen(Worn::Phases, phase, (f64::NAN, lasts_secs));
            }
            What::Stimulus { letter, .. } => {
                happen(Worn::Stimuli, letter.encode_utf8(&mut [0; 4]), moment(f64::NAN));
            }
            What::Press { says_match, reaction_secs, .. } => {
                let key = if says_match { "match" } else { "no match" };
                happen(Worn::Presses, key, moment(reaction_secs));
            }
            What::Command { robot } => {
                happen(Worn::Commands, "command", moment(f64::from(robot + 1)));
            }
            What::Report { isa } => happen(Worn::Reports, "isa", moment(f64::from(isa))),
            What::Ends { .. } | What::Demands { .. } | What::Reaches { .. } => {}
        }
    }

    /// Offers an event, with its number and its duration [s].
    fn happen(&self, worn: Worn, at_secs: f64, label: &str, (value, duration_secs): (f64, f64)) {
        let (kind, label) = (worn.happens(), label.to_owned());
        let event = Event { kind, label, value, duration_secs };
        self.offer(worn, at_secs, Data::Event(Arc::new(event)));
    }

    fn offer(&self, worn: Worn, at_secs: f64, data: Data) {
        let source_time = Some(after(self.start, at_secs));
        let Some(stream) = self.streams.of(worn) else { return };
        self.outlet.offer(Reading { index: None, stream, device_time: None, source_time, data });
    }
}

/// Returns the values of [`Worn::TrueState`].
fn numbers(moment: &Moment) -> [f64; 7] {
    [
        moment.state.workload,
        moment.state.arousal,
        moment.state.valence,
        moment.heart_rate_bpm,
        moment.breaths_per_min,
        moment.skin_level_us,
        moment.temperature_c,
    ]
}

#[cfg(test)]
mod tests {
    use teampulse_core::outlet::Queue;
    use teampulse_core::stream::{About, Origin, Shape};
    use teampulse_core::streams;
    use teampulse_emulators::body::Sensor;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_person_ends_with_the_last_step_and_is_declared_with_all_that_is_worn() {
        let team = SimulatedTeam { people: 1, steps: Some(3), ..SimulatedTeam::default() };
        team.check().unwrap();
        let [(name, person)] = &mut SimulatedPerson::of(&team)[..] else { panic!("not one") };
        assert_eq!(name, "person p001");
        let outlet = Queue::new().outlet(Clock::settable(), streams::Streams::default());
        let clock = outlet.clock().clone();
        let passing = async {
            for tenth in 0..=30 {
                clock.set(after(Time::EPOCH, f64::from(tenth) / 10.0));
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
        };
        let (lived, ()) = tokio::join!(person.run(&outlet), passing);
        lived.unwrap();
        let declared = outlet.streams().all();
        assert_eq!(declared.len(), Worn::ALL.len());
        assert!(declared.iter().all(|(_, stream)| {
            (stream.about, stream.origin, stream.id.as_str())
                == (About::Person, Origin::Raw, "p001")
        }));
        let (_, ecg) = outlet.streams().find("/humans/persons/p001/simulated/ecg").unwrap();
        assert_eq!((&ecg.shape, ecg.channels[0].unit.as_str()), (&Shape::Wave, "mV"));
    }

    #[test]
    fn what_a_wearable_measures_is_not_worn_twice_and_the_body_is_the_same() {
        let wearables = |type_name: &str| -> Vec<EmulatedWearable> {
            let of = |person| format!("type = \"{type_name}\"\nperson = \"{person}\"");
            vec![toml::from_str(&of("p001")).unwrap(), toml::from_str(&of("p002")).unwrap()]
        };
        let team = SimulatedTeam { people: 1, ..SimulatedTeam::default() };
        let mut bare = SimulatedPerson::new(&team, 1, &[]);
        let worn = [
            ("polar_h10", Sensor::Ecg),
            ("polar_verity_sense", Sensor::Ppg),
            ("polar_oh1", Sensor::Ppg),
            ("myo", Sensor::Emg),
        ];
        for (type_name, gone) in worn {
            let mut worn = SimulatedPerson::new(&team, 1, &wearables(type_name));
            let left = Sensor::ALL.into_iter().filter(|sensor| worn.rates.of(*sensor) > 0.0);
            assert!(left.eq(Sensor::ALL.into_iter().filter(|sensor| *sensor != gone)));
            bare = SimulatedPerson::new(&team, 1, &[]);
            let beats = |person: &mut SimulatedPerson| {
                let truth = &person.operator.until(30.0).record.truth;
                truth.beats.iter().map(|beat| beat.secs).collect::<Vec<_>>()
            };
            assert_eq!(beats(&mut worn), beats(&mut bare), "{type_name}");
        }
        assert!(Sensor::ALL.into_iter().all(|sensor| bare.rates.of(sensor) > 0.0));
    }

    #[test]
    fn the_truth_has_a_channel_for_each_of_its_numbers() {
        let state = Worn::TrueState.stream("p001", &Rates::NONE).unwrap();
        let moment = Body::new(&Traits::of_seed(1), 1).until(1.0).truth.moments[0];
        assert_eq!(state.channels.len(), numbers(&moment).len());
    }

    #[test]
    fn every_sensor_that_is_worn_is_reported() {
        assert!(Worn::Sensor(Sensor::Ecg).stream("p001", &Rates::NONE).is_none());
        for sensor in Sensor::ALL {
            assert!(Worn::ALL.contains(&Worn::Sensor(sensor)), "{sensor:?}");
        }
    }
}
