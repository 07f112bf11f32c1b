//! `teampulse check`: reports go or no-go before a recording.

mod heard;
mod lacks;
mod lsl;
mod unheard;
mod unnamed;
mod workers;
mod worn;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use teampulse_core::counted::counted;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{About, Origin, Shape, Stream};
use teampulse_ros::buses::Buses;
use teampulse_sources::robots::{Finding, Robot, conformity};

use self::workers::Workers;
use crate::commands::run::seconds;
use crate::commands::simulate::team;
use crate::computers;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::machine;
use crate::network;
use crate::notes;
use crate::output;
use crate::required::{Requirements, no_person, no_robot};
use crate::setup::{Parts, Setup};
use crate::stop::Stop;
use crate::study::Study;
use crate::supplies::Unsupplied;

use heard::{Heard, Listener};

/// Reports go or no-go before a recording.
///
/// Reads the study, receives everything in it for a while without recording, and compares each robot with the robot
/// profile. The result is no-go if a required stream is missing; if two devices publish the same signal of one person;
/// if a wearable sends no samples, has no contact with the skin or has a battery that will not last through the phases
/// of the study; if any other device can't be opened; or if none of the study's robots and people is present. Robots
/// that are present but not named in the study are listed, too.
#[derive(Debug, Args)]
pub struct Check {
    /// The study
    study: PathBuf,
    /// How long to listen
    #[arg(long, value_name = "SECS", default_value = "6", value_parser = seconds)]
    seconds: f64,
    /// Where the bag would be created
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    out: PathBuf,
}

impl Check {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let study = Study::read(&self.study)?;
        let required = Requirements::of(&study)?;
        let workers = Workers::of(&study)?;
        team(&study)?;
        let (notes, publish) = (notes::of_study(&study), study.general.publish.clone());
        let alerts = study.general.alerts.clone();
        let phases = study.general.phases.clone();
        let lsl = lsl::Wanted::of(&study)?;
        let messages = study.general.session.messages.clone();
        let buses = network::buses_with_messages("teampulse", messages.as_deref());
        let setup = Setup::new(study, buses).await?;
        let sources = setup.sources()?;
        if sources.is_empty() {
            return Err(setup.without("sources", "nothing is watched").into());
        }
        drop((setup.features()?, setup.sinks(&setup.bag_folder(&self.out))?, setup.workers()?));
        output::line(format!("study    ok    {}", self.study.display()));
        output::lines(notes.iter().map(|note| format!("note     {note}")));
        output::lines(machine::check(&self.out));
        let (buses, room) = (Arc::clone(&setup.buses), setup.room(&self.out));
        // The features must run before it is known what they compute, which alerts may watch.
        let features = if alerts.is_empty() { Vec::new() } else { setup.features()? };
        let parts = Parts { sources, features, ..Parts::default() };
        let Listened { heard, computed, unsupplied } = listen(setup, parts, self.seconds).await?;
        let Heard { streams: heard, own_phases, worn, faults } = heard;
        let width = heard.iter().map(|(_, status)| status.name.len()).max().unwrap_or(0);
        output::lines(heard.iter().map(|(stream, status)| stream_line(stream, status, width)));
        output::lines(machine::crowded(messages_per_sec(&heard)));
        output::lines(computers::lines(&buses, &heard));
        let of_robots = heard.iter().filter(|(stream, _)| stream.about == About::Robot);
        let robots = conformity(of_robots.map(|(stream, status)| (&**stream, status)));
        output::lines(robots.iter().map(robot_line));
        let received: Vec<_> = heard.iter().map(|(stream, _)| &**stream).collect();
        let absent = required.absent_robots(&received).into_iter();
        output::lines(absent.map(|each| format!("robot    none  {}", no_robot(each))));
        output::lines(person_lines(&heard));
        let absent_lsl = lsl.look().await;
        let worn = worn::found(&worn, worn::planned_secs(&phases));
        output::lines(worn.lines);
        let away = required.absent_people(&received).into_iter();
        output::lines(away.map(|each| format!("person   none  {}", no_person(each))));
        let mut idle = notes::matching_nothing(&publish, &workers.streams, &received);
        idle.extend(notes::alerting_of_nothing(&alerts, &received, &computed));
        let overruled = lacks::overruled(!phases.is_empty(), &own_phases);
        let lacking = lacking(&required, &heard, &buses);
        let notes = idle.iter().chain(&overruled).chain(&lacking).chain(&room.instead);
        output::lines(notes.map(|note| format!("note     {note}")));
        let unmet = unsupplied.added_to(required.missing(&heard)).into_iter();
        output::lines(faults.iter().map(|fault| format!("fault    {fault}")));
        let mut missing: Vec<String> = unmet.map(|unmet| unmet.what).collect();
        missing.extend(absent_lsl);
        missing.extend(worn.missing);
        let is_all_there = missing.is_empty();
        missing.extend(workers.unread());
        missing.extend(room.unfit.into_iter().chain(room.unfit_fallback));
        // Like `run`, which does not start if nothing can be recorded.
        let exit = if is_all_there { Exit::Failed } else { Exit::DeviceMissing };
        Ok(if is_go(&missing) { Exit::Fine } else { exit })
    }
}

/// Prints what is missing, and whether the result is go.
fn is_go(missing: &[String]) -> bool {
    output::lines(missing.iter().map(|what| format!("missing  {what}")));
    output::line(if missing.is_empty() { "go" } else { "no-go" });
    missing.is_empty()
}

/// Returns notes on what the streams and robots of the study lack, and on what is present but not in the study.
fn lacking(
    required: &Requirements,
    heard: &[(Arc<Stream>, StreamStatus)],
    buses: &Buses,
) -> Vec<String> {
    let streams = || heard.iter().map(|(stream, _)| &**stream);
    let mut notes = lacks::notes(streams());
    notes.extend(unheard::notes(&required.robots, streams()));
    notes.extend(unheard::unpublished_topics(&required.topics, streams()));
    notes.extend(unnamed::notes(
        &required.robots,
        &required.people,
        &required.kinds,
        (&unnamed::topics(buses), heard),
    ));
    notes
}

/// Returns the rate of all messages received from other programs [1/s].
fn messages_per_sec(heard: &[(Arc<Stream>, StreamStatus)]) -> f64 {
    let messages = heard.iter().filter(|(stream, _)| matches!(stream.shape, Shape::Message(_)));
    messages.map(|(_, status)| status.rate_hz).sum()
}

/// What was received and computed.
struct Listened {
    heard: Heard,
    computed: Vec<Arc<Stream>>,
    unsupplied: Unsupplied,
}

/// Receives from a study's sources for a while.
async fn listen(setup: Setup, mut parts: Parts, duration_secs: f64) -> Result<Listened, Failure> {
    let listener = Listener::default();
    parts.sinks.push(Box::new(listener.clone()));
    let asked = Stop::default().asked(setup.clock.clone(), Some(duration_secs));
    let supplies = setup.supplies.clone();
    let session = setup.session(parts);
    let streams = session.streams.clone();
    let outcome = session.run(asked).await;
    if let Some((name, error)) = outcome.sources.into_iter().next() {
        return Err(Failure::new(format!("{name}: failed to {error}")));
    }
    let streams = streams.all().into_iter().map(|(_, stream)| stream);
    let computed = streams.filter(|stream| stream.origin == Origin::Derived).collect();
    let unsupplied = Unsupplied { unopened: outcome.unopened, supplies };
    Ok(Listened { heard: listener.heard(), computed, unsupplied })
}

fn stream_line(stream: &Stream, status: &StreamStatus, width: usize) -> String {
    let ty = match &stream.shape {
        Shape::Message(schema) => schema.name.as_str(),
        _ => "",
    };
    let reason = if status.reason.is_empty() { "" } else { "  " };
    format!(
        "stream   {:<10} {:<width$} {}  {ty}{reason}{}",
        status.state,
        status.name,
        rate(status.rate_hz),
        status.reason
    )
}

/// Formats a rate; below one message in twenty seconds it can't be measured in such a short time.
fn rate(rate_hz: f64) -> String {
    if rate_hz < 0.05 { format!("{:>7}   ", "-") } else { format!("{rate_hz:>7.1} Hz") }
}

/// Formats the line about a robot: which parts of the robot profile it meets.
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

/// Formats a line for each person present, with the number of their streams.
fn person_lines(heard: &[(Arc<Stream>, StreamStatus)]) -> impl Iterator<Item = String> {
    let mut people = BTreeMap::<&str, usize>::new();
    for (stream, _) in heard.iter().filter(|(stream, _)| stream.about == About::Person) {
        *people.entry(&stream.id).or_default() += 1;
    }
    people
        .into_iter()
        .map(|(id, count)| format!("person   {id}  {}", counted(count, "stream", "streams")))
}
