//! `teampulse check`: go or no-go before a recording.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use clap::Args;
use teampulse_core::data::Data;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{About, Origin, Shape, Stream};
use teampulse_sources::people::People;
use teampulse_sources::robots::{Finding, Robot, Robots, conformity};

use crate::commands::run::seconds;
use crate::computers;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::machine;
use crate::network;
use crate::output;
use crate::setup::{Parts, Setup, Sources};
use crate::stop::Stop;
use crate::study::Study;

/// Says go or no-go before a recording.
///
/// Reads the study, listens to everything in it for a while without recording, and holds each robot
/// against the robot profile. It is no-go where something required is missing, and where nobody is
/// there: neither a robot nor a person that the study watches.
#[derive(Debug, Args)]
pub struct Check {
    /// The study
    study: PathBuf,
    /// How long to listen
    #[arg(long, value_name = "SECS", default_value = "6", value_parser = seconds)]
    seconds: f64,
    /// Where the bag would be made
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
}

impl Check {
    /// Does it.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::read(&self.study)?;
        let wanted: Vec<Robots> = study.settings_of("sources", "robots")?;
        let people: Vec<People> = study.settings_of("sources", "people")?;
        let messages = study.general.session.messages.clone();
        let buses = network::buses_with_messages("teampulse", messages.as_deref());
        let setup = Setup::new(study, buses).await?;
        let sources = setup.sources()?;
        drop((setup.features()?, setup.sinks(&setup.bag_folder(&self.out))?));
        output::line(format!("study    ok    {}", self.study.display()));
        output::lines(machine::check(&self.out));
        let buses = Arc::clone(&setup.buses);
        let heard = listen(setup, sources, self.seconds).await?;
        output::lines(heard.iter().map(|(stream, status)| stream_line(stream, status)));
        output::lines(computers::lines(&buses, &heard));
        let of_robots = heard.iter().filter(|(stream, _)| stream.about == About::Robot);
        let robots = conformity(of_robots.map(|(stream, status)| (&**stream, status)));
        output::lines(robots.iter().map(robot_line));
        let absent: Vec<&Robots> = wanted.iter().filter(|each| !is_there(each, &heard)).collect();
        output::lines(absent.iter().map(|each| format!("robot    none  {}", no_robot(each))));
        output::lines(person_lines(&heard));
        let away: Vec<&People> = people.iter().filter(|each| !are_there(each, &heard)).collect();
        output::lines(away.iter().map(|each| format!("person   none  {}", no_person(each))));
        let mut missing = missing(&wanted, &robots);
        let is_nobody = absent.len() == wanted.len() && away.len() == people.len();
        missing.extend(absent.into_iter().filter(|each| is_nobody || requires(each)).map(no_robot));
        missing.extend(away.into_iter().filter(|_| is_nobody).map(no_person));
        missing.extend(missing_fields(&wanted, &heard));
        missing.extend(machine::unfit(&self.out));
        if missing.is_empty() {
            output::line("go");
            return Ok(Exit::Fine);
        }
        output::lines(missing.iter().map(|what| format!("missing  {what}")));
        output::line("no-go");
        Ok(Exit::DeviceMissing)
    }
}

/// Listens to a study's sources; gives every raw stream with its last status.
async fn listen(
    setup: Setup,
    sources: Sources,
    duration_secs: f64,
) -> Result<Vec<(Arc<Stream>, StreamStatus)>, Failure> {
    let heard = Heard::default();
    let parts = Parts {
        sources,
        features: Vec::new(),
        sinks: vec![Box::new(Listener(Arc::clone(&heard)))],
    };
    let asked = Stop::default().asked(setup.clock.clone(), Some(duration_secs));
    let outcome = setup.run(parts, asked).await;
    if let Some((name, error)) = outcome.sources.into_iter().next() {
        return Err(Failure::new(format!("{name}: failed to {error}")));
    }
    let heard = std::mem::take(&mut *heard.lock().unwrap_or_else(PoisonError::into_inner));
    Ok(heard.into_values().collect())
}

type Heard = Arc<Mutex<BTreeMap<String, (Arc<Stream>, StreamStatus)>>>;

/// Keeps the last status of every raw stream.
struct Listener(Heard);

impl Sink for Listener {
    fn name(&self) -> &'static str {
        "check"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(|stream| stream.shape == Shape::Status))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    let streams = inbox.streams().all();
                    let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
                    for record in batch.iter() {
                        let Data::Status(status) = &record.sample.data else { continue };
                        let of_name = |(_, stream): &&(_, Arc<Stream>)| {
                            stream.name == status.name && stream.origin == Origin::Raw
                        };
                        if let Some((_, stream)) = streams.iter().find(of_name) {
                            let entry = (Arc::clone(stream), StreamStatus::clone(status));
                            heard.insert(status.name.clone(), entry);
                        }
                    }
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

fn stream_line(stream: &Stream, status: &StreamStatus) -> String {
    let ty = match &stream.shape {
        Shape::Message(schema) => schema.name.as_str(),
        _ => "",
    };
    let reason = if status.reason.is_empty() { "" } else { "  " };
    format!(
        "stream   {:<10} {:<34} {:>7.1} Hz  {ty}{reason}{}",
        status.state, status.name, status.rate_hz, status.reason
    )
}

/// What a robot meets of the robot profile.
fn robot_line(robot: &Robot) -> String {
    let findings = robot.findings.iter().map(|(norm, finding)| match finding {
        Finding::Met(rate_hz) => format!("{} {rate_hz:.1} Hz", norm.parameter),
        Finding::Slow(rate_hz) => {
            format!("{} {rate_hz:.1} Hz (at least {} Hz)", norm.parameter, norm.least_hz)
        }
        Finding::Absent if norm.essential => format!("no {}", norm.parameter),
        Finding::Absent => format!("no {} (optional)", norm.parameter),
    });
    let verdict = if robot.conforms() { "meets the profile" } else { "falls short" };
    format!("robot    {}  {verdict}: {}", robot.id, findings.collect::<Vec<_>>().join(", "))
}

/// The fields that the study reads, of topics that do not have them.
fn missing_fields(wanted: &[Robots], heard: &[(Arc<Stream>, StreamStatus)]) -> Vec<String> {
    let mut missing = Vec::new();
    for field in wanted.iter().flat_map(Robots::fields) {
        let Some(path) = &field.field else { continue };
        let lacks =
            |stream: &&Arc<Stream>| stream.device == field.topic && !stream.channels.contains(path);
        let lacking = heard.iter().map(|(stream, _)| stream).filter(lacks);
        missing.extend(lacking.map(|stream| format!("field `{path}` of {}", stream.name)));
    }
    missing
}

/// Whether any stream of the robots that are wanted was heard of.
fn is_there(wanted: &Robots, heard: &[(Arc<Stream>, StreamStatus)]) -> bool {
    heard.iter().any(|(stream, _)| stream.about == About::Robot && wanted.describe(stream))
}

fn no_robot(wanted: &Robots) -> String {
    format!("no robot matches {}", wanted.namespace)
}

/// Whether any stream of the people that are wanted was heard of.
fn are_there(wanted: &People, heard: &[(Arc<Stream>, StreamStatus)]) -> bool {
    heard.iter().any(|(stream, _)| wanted.describe(stream))
}

fn no_person(wanted: &People) -> String {
    format!("no person matches {}", wanted.namespace.text())
}

/// Who is there, and how many streams there are of each.
fn person_lines(heard: &[(Arc<Stream>, StreamStatus)]) -> impl Iterator<Item = String> {
    let mut people = BTreeMap::<&str, usize>::new();
    for (stream, _) in heard.iter().filter(|(stream, _)| stream.about == About::Person) {
        *people.entry(&stream.id).or_default() += 1;
    }
    people.into_iter().map(|(id, count)| format!("person   {id}  {count} streams"))
}

/// Whether there is no go without robots.
fn requires(wanted: &Robots) -> bool {
    !(wanted.required.is_empty() && wanted.robots.is_empty())
}

/// What the study requires of robots and they do not offer.
fn missing(wanted: &[Robots], robots: &[Robot]) -> Vec<String> {
    let mut missing = Vec::new();
    for wanted in wanted {
        for id in &wanted.robots {
            if robots.iter().all(|robot| robot.id != *id) {
                missing.push(format!("robot {id}"));
            }
        }
        for robot in robots {
            let absent = wanted.required.iter().filter(|parameter| !robot.offers(parameter));
            missing.extend(absent.map(|parameter| format!("{parameter} of robot {}", robot.id)));
        }
    }
    missing
}
