//! Events of a session: from the study, and from any node on ROS.

mod keeper;

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::command::{Command, Sender};
use teampulse_core::commands::{CommandSettings, Commands, Refused};
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::qos::Qos;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::session::{Pace, Session};
use teampulse_core::session_streams::END;
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::StreamId;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::catalogue;
use teampulse_messages::convert::encode;
use teampulse_messages::standard::{Message, rosgraph_msgs};
use teampulse_ros::bus::{Bus, Publisher};
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::session::{
    Phase, Phases, RosCommands, RosEvents, ScheduleHandle, follow_clock,
};

use keeper::Keeper;

/// Runs a session with one source until `meanwhile` ends; returns the events.
async fn events(
    source: impl Source + 'static,
    clock: Clock,
    meanwhile: impl Future<Output = ()>,
) -> Vec<Event> {
    events_of(vec![Box::new(source)], Commands::default(), clock, meanwhile).await
}

/// The same with these sources and commands.
async fn events_of(
    sources: Vec<Box<dyn Source>>,
    commands: Commands,
    clock: Clock,
    meanwhile: impl Future<Output = ()>,
) -> Vec<Event> {
    let kept = records_of(sources, commands, clock, meanwhile).await;
    kept.iter().filter_map(event_of).collect()
}

async fn records_of(
    sources: Vec<Box<dyn Source>>,
    commands: Commands,
    clock: Clock,
    meanwhile: impl Future<Output = ()>,
) -> Vec<Record> {
    let kept = Arc::default();
    let session = Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: sources.into_iter().map(|source| ("test".to_owned(), source)).collect(),
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(&kept)))],
        workers: Vec::new(),
        encode,
        commands,
    };
    session.run(meanwhile).await;
    std::mem::take(&mut *kept.lock().expect("nobody panicked"))
}

fn event_of(record: &Record) -> Option<Event> {
    match &record.sample.data {
        Data::Event(event) => Some(Event::clone(event)),
        _ => None,
    }
}

fn publisher(bus: &MemoryBus, topic: &str, type_name: &str) -> Box<dyn Publisher> {
    let schema = catalogue::shipped(type_name).expect("a shipped type");
    bus.publish(topic, &schema, &Qos::reliable(10)).expect("a publisher")
}

async fn subscribed(publisher: &dyn Publisher) {
    while publisher.subscribers() == 0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn any_node_may_give_an_event_or_set_a_marker() {
    let monitor = MemoryBus::new("/teampulse");
    let node = monitor.join("/task");
    let events = events(RosEvents::new(monitor), Clock::host(), async move {
        let phases = publisher(&node, "/session/events", "teampulse_msgs/msg/Event");
        let markers = publisher(&node, "/session/events", "std_msgs/msg/String");
        subscribed(&*phases).await;
        subscribed(&*markers).await;
        phases.publish(&encode(&phase("two_back"))).expect("published");
        markers.publish(b"\0\x01\0\0\x05\0\0\0tea!\0").expect("published");
        for _ in 0..2 {
            markers.publish(&[0xff; 9]).expect("published");
            phases.publish(&of_unknown_kind()).expect("published");
        }
    })
    .await;
    let reported = |kind, label: &str| events.iter().any(|it| it.kind == kind && it.label == label);
    assert!(reported(EventKind::Phase, "two_back"), "{events:?}");
    assert!(reported(EventKind::Marker, "tea!"), "{events:?}");
    let faults: Vec<&Event> = events.iter().filter(|it| it.kind == EventKind::Fault).collect();
    assert_eq!(faults.len(), 2, "each is reported once: {faults:?}");
    let of_kind =
        "/session/events: failed to read kind \"phrase\": expected one of phase, marker, report, ";
    assert!(faults.iter().any(|fault| fault.label.starts_with(of_kind)), "{faults:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_end_of_another_session_ends_nothing_here() {
    let monitor = MemoryBus::new("/teampulse");
    let player = monitor.join("/teampulse_player");
    let events = events(RosEvents::new(monitor), Clock::host(), async move {
        let played = publisher(&player, "/session/events", "teampulse_msgs/msg/Event");
        subscribed(&*played).await;
        played.publish(&encode(&phase("baseline"))).expect("published");
        played.publish(&encode(&happened(EventKind::Clock, END))).expect("published");
        played.publish(&encode(&phase("task"))).expect("published");
    })
    .await;
    let labels: Vec<(EventKind, &str)> =
        events.iter().map(|event| (event.kind, event.label.as_str())).collect();
    let refused = "/session/events: failed to use `end`, an event of another session's clock; the event is ignored";
    let expected = [
        (EventKind::Phase, "baseline"),
        (EventKind::Fault, refused),
        (EventKind::Phase, "task"),
        (EventKind::Clock, END),
    ];
    assert_eq!(labels, expected);
}

/// A `std_msgs/String`.
fn text(words: &str) -> Vec<u8> {
    let length = words.len() as u32 + 1;
    [&[0, 1, 0, 0], &length.to_le_bytes()[..], words.as_bytes(), &[0]].concat()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_may_command_what_the_study_allows_and_nothing_else() {
    let monitor = MemoryBus::new("/teampulse");
    let panel = monitor.join("/panel");
    let by_hand = |name: &str| Phase {
        name: name.to_owned(),
        from_secs: None,
        to_secs: None,
        lasts_secs: None,
    };
    let phases = Phases::new(vec![by_hand("baseline"), by_hand("task")], ScheduleHandle::default());
    let commands = RosCommands::new(monitor);
    let sources: Vec<Box<dyn Source>> = vec![Box::new(phases), Box::new(commands)];
    let allowed = ["next_phase", "mark", "split", "stop"].map(str::to_owned).to_vec();
    let settings = CommandSettings { ros: allowed, ..CommandSettings::default() };
    let sent = async {
        let commands = publisher(&panel, "/session/commands", "std_msgs/msg/String");
        subscribed(&*commands).await;
        for words in ["mark tea", "abort_phase", "abort_phase", "split", "halt", "next_phase"] {
            commands.publish(&text(words)).expect("published");
        }
        commands.publish(&text("stop")).expect("published");
        // The command itself ends the session.
        std::future::pending::<()>().await;
    };
    let events = events_of(sources, Commands::new(settings), Clock::host(), sent).await;
    let labels = |kind| {
        let of_kind = events.iter().filter(move |event| event.kind == kind);
        of_kind.map(|event| event.label.as_str()).collect::<Vec<_>>()
    };
    let sent = ["ros:/panel mark tea", "ros:/panel next_phase", "ros:/panel stop"];
    assert_eq!(labels(EventKind::Command), sent);
    assert_eq!(labels(EventKind::Marker), ["tea"]);
    let faults = labels(EventKind::Fault);
    assert_eq!(faults.len(), 3, "each is reported once: {faults:?}");
    for (place, what) in [
        (0, "`abort_phase` from ros:/panel was refused: not allowed"),
        (1, "`split`"),
        (2, "no `halt`"),
    ] {
        assert!(faults[place].contains(what), "{faults:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_next_phase_begins_by_command() {
    let events = commanded(vec![Command::NextPhase]).await;
    let begins = events.iter().filter(|event| event.kind == EventKind::Phase);
    let begins: Vec<(&str, f64)> = begins.map(|each| (&*each.label, each.duration_secs)).collect();
    assert_eq!(begins, [("task", 9.0)]);
    assert!(events.iter().any(|event| event.label == "keys next_phase"), "{events:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_command_without_effect_is_noted_with_the_reason() {
    let commands = [Command::AbortPhase, Command::RepeatPhase, Command::NextPhase];
    let events = commanded(commands.to_vec()).await;
    let notes = events.iter().filter(|event| event.kind == EventKind::Report);
    let notes: Vec<&str> = notes.map(|event| &*event.label).collect();
    assert_eq!(
        notes,
        [
            "phases note `abort_phase` had no effect: no phase is running",
            "phases note `repeat_phase` had no effect: no phase has begun",
        ]
    );
}

/// The events of a session with two phases that begin by hand, until the first has begun by one of these commands.
async fn commanded(commands: Vec<Command>) -> Vec<Event> {
    struct Asks(Vec<Command>);

    #[async_trait]
    impl Source for Asks {
        async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
            for command in &self.0 {
                // The phases carry it out as soon as they run.
                while outlet.command(&Sender::keys(), command.clone()) == Err(Refused::NoReceiver) {
                    tokio::time::sleep(Duration::from_millis(1)).await;
                }
            }
            Ok(())
        }
    }
    let phase =
        Phase { name: "task".into(), from_secs: None, to_secs: None, lasts_secs: Some(9.0) };
    let schedule = ScheduleHandle::default();
    let rest = Phase { name: "rest".into(), ..phase.clone() };
    let phases = Phases::new(vec![phase, rest], schedule.clone());
    let begun = async {
        while schedule.next().as_deref() != Some("rest") {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    let sources: Vec<Box<dyn Source>> = vec![Box::new(Asks(commands)), Box::new(phases)];
    events_of(sources, Commands::default(), Clock::host(), begun).await
}

/// Begins the next two phases: the first with a click that took 5 s to arrive, the second with one made even earlier.
struct LateClicks(Time);

#[async_trait]
impl Source for LateClicks {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        for late_secs in [5, 20] {
            let at = Some(self.0 - Duration::from_secs(late_secs));
            let next = || outlet.command_at(&Sender::keys(), Command::NextPhase, at);
            while next() == Err(Refused::NoReceiver) {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_phase_begins_when_its_button_was_pressed_and_none_before_the_last() {
    let begun = Clock::host().now();
    let by_hand =
        |name: &str| Phase { name: name.into(), from_secs: None, to_secs: None, lasts_secs: None };
    let schedule = ScheduleHandle::default();
    let phases =
        Phases::new(vec![by_hand("task"), by_hand("rest"), by_hand("end")], schedule.clone());
    let both = async {
        while schedule.next().as_deref() != Some("end") {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    let sources: Vec<Box<dyn Source>> = vec![Box::new(LateClicks(begun)), Box::new(phases)];
    let records = records_of(sources, Commands::default(), Clock::host(), both).await;
    let phase = |record: &Record| {
        let event = event_of(record).filter(|event| event.kind == EventKind::Phase)?;
        Some((event.label, begun.secs_since(record.sample.measured)))
    };
    let phases: Vec<_> = records.iter().filter_map(phase).collect();
    assert_eq!(phases, [("task".to_owned(), 5.0), ("rest".to_owned(), 5.0)]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_event_of_somebody_else_commands_nothing() {
    let monitor = MemoryBus::new("/teampulse");
    let player = monitor.join("/teampulse_player");
    let events = events(RosEvents::new(monitor), Clock::host(), async move {
        let played = publisher(&player, "/session/events", "teampulse_msgs/msg/Event");
        subscribed(&*played).await;
        played.publish(&encode(&happened(EventKind::Command, "keys stop"))).expect("published");
        played.publish(&encode(&phase("task"))).expect("published");
    })
    .await;
    assert!(events.iter().all(|event| event.kind != EventKind::Command), "{events:?}");
    let refused = "/session/events: failed to use `keys stop` as a command";
    assert!(events.iter().any(|event| event.label.starts_with(refused)), "{events:?}");
}

/// An event whose kind is misspelt.
fn of_unknown_kind() -> Vec<u8> {
    let mut cdr = encode(&phase("two_back")).to_vec();
    let place = cdr.windows(5).position(|word| word == b"phase").expect("the kind");
    // Its length counts the zero at its end; a letter more fits into what is left to the next word.
    cdr[place - 4] = 7;
    cdr.splice(place..place + 6, *b"phrase\0");
    cdr.remove(place + 7);
    cdr
}

fn phase(label: &str) -> Sample {
    happened(EventKind::Phase, label)
}

fn happened(kind: EventKind, label: &str) -> Sample {
    let event = Event { kind, label: label.into(), value: f64::NAN, duration_secs: 60.0 };
    Sample {
        stream: StreamId(0),
        measured: Time::EPOCH,
        log_time: Time::EPOCH,
        device_time: None,
        source_time: None,
        period_ns: 0.0,
        index: 0,
        turn: Turn::OnTime,
        data: Data::Event(Arc::new(event)),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn phases_begin_when_the_study_says_by_the_clock_of_the_simulation() {
    let monitor = MemoryBus::new("/teampulse");
    let simulator = publisher(&monitor.join("/sim"), "/clock", "rosgraph_msgs/msg/Clock");
    let clock = Clock::settable();
    let clock_at = |secs: i32| {
        let mut cdr = vec![0, 1, 0, 0];
        cdr.extend(secs.to_le_bytes());
        cdr.extend([0; 4]);
        simulator.publish(&cdr).expect("published");
    };
    clock_at(1);
    let follow = follow_clock(&*monitor, &clock, Duration::from_secs(5));
    let (follows, ()) = tokio::join!(follow, async {
        while clock.now() == Time::EPOCH {
            clock_at(1);
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    });
    let _follows = follows.expect("a bus").expect("a clock");
    let phase = |name: &str, from_secs| Phase {
        name: name.into(),
        from_secs: Some(from_secs),
        to_secs: None,
        lasts_secs: None,
    };
    let phases = Phases::new(
        vec![phase("task", 100.0), phase("baseline", 0.0), phase("later", 1e6)],
        ScheduleHandle::default(),
    );
    let events = events(phases, clock.clone(), async {
        tokio::time::sleep(Duration::from_millis(60)).await;
        clock_at(102);
        tokio::time::sleep(Duration::from_millis(60)).await;
    })
    .await;
    let begun = events.iter().filter(|event| event.kind == EventKind::Phase);
    assert_eq!(begun.map(|event| event.label.as_str()).collect::<Vec<_>>(), ["baseline", "task"]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_clock_that_jumps_back_is_an_event_and_the_session_goes_on() {
    let monitor = MemoryBus::new("/teampulse");
    let simulator = publisher(&monitor.join("/sim"), "/clock", "rosgraph_msgs/msg/Clock");
    let clock = Clock::settable();
    let report = |secs: i32| {
        let now = rosgraph_msgs::Clock { clock: Time::from_stamp(secs, 0) };
        simulator.publish(&now.encode()).expect("published");
    };
    let follow = follow_clock(&*monitor, &clock, Duration::from_secs(5));
    let (follows, ()) = tokio::join!(follow, async {
        while clock.now() == Time::EPOCH {
            report(100);
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    });
    let follows = follows.expect("a bus").expect("a clock");
    let events = events(follows, clock.clone(), async {
        for secs in [101, 10, 11, 12] {
            report(secs);
        }
        tokio::time::sleep(Duration::from_millis(60)).await;
    })
    .await;
    assert_eq!(clock.now(), Time::from_stamp(103, 0));
    let stamp = clock.session_from_stamp(Time::from_stamp(12, 0));
    assert_eq!(stamp, Time::from_stamp(103, 0), "messages are placed beside it");
    let labels: Vec<&str> = events.iter().map(|event| event.label.as_str()).collect();
    assert_eq!(labels, ["/clock jumped back by 91.000 s", END]);
}
