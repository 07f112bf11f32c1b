//! A panic in any part of the program is on the screen, in the bag, in `summary.md` and in the exit code,
//! and all else goes on.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};

use rustix::process::{Pid, Signal, kill_process};
use teampulse_bag::Bag;
use teampulse_core::data::{Data, EventKind};
use teampulse_messages::convert::{decode, type_name};

/// What a session came to.
struct Session {
    said: String,
    status: ExitStatus,
    folder: PathBuf,
    _stage: tempfile::TempDir,
}

impl Session {
    /// Runs a session of two robots with more in its study, until `until` is said; then it is interrupted,
    /// unless it ends by itself.
    fn run(first_robot: &str, more: &str, until: Option<&str>) -> Session {
        let stage = tempfile::tempdir().expect("a test's own");
        let study = stage.path().join("study.toml");
        let text = format!(
            "[session]\nname = \"test\"\n[[sources]]\ntype = \"numbers\"\nid = \"r1\"\n{first_robot}\n\
             [[sources]]\ntype = \"numbers\"\nid = \"r2\"\n[[sinks]]\ntype = \"bag\"\n{more}\n"
        );
        fs::write(&study, text).expect("a test's own");
        let out = stage.path().join("sessions");
        let mut program = Command::new(env!("CARGO_BIN_EXE_panicking"))
            .args(["run".as_ref(), study.as_os_str(), "--out".as_ref(), out.as_os_str()])
            .env("ROS_DOMAIN_ID", "97")
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a test's own");
        let mut said = String::new();
        let mut is_interrupted = false;
        // It ends when the program has.
        for line in BufReader::new(program.stderr.take().expect("a test's own")).lines() {
            said += &line.expect("a test's own");
            said += "\n";
            if until.is_some_and(|until| said.contains(until)) && !is_interrupted {
                kill_process(Pid::from_child(&program), Signal::INT).expect("a test's own");
                is_interrupted = true;
            }
        }
        let status = program.wait().expect("a test's own");
        let mut folders = fs::read_dir(&out)
            .expect("a test's own")
            .map(|entry| entry.expect("a test's own").path());
        let folder = folders.next().expect("a test's own");
        Session { said, status, folder, _stage: stage }
    }

    fn code(&self) -> i32 {
        self.status.code().unwrap_or_else(|| panic!("{}\n{}", self.status, self.said))
    }

    fn summary(&self) -> String {
        fs::read_to_string(self.folder.join("summary.md")).expect("a test's own")
    }

    /// The faults that the bag tells.
    fn faults(&self) -> Vec<String> {
        let bag = Bag::open(&self.folder).expect("a test's own");
        let mut faults = Vec::new();
        for message in bag.messages(None) {
            let message = message.expect("a test's own");
            let stream = &bag.streams()[message.stream].stream;
            let Ok(decoded) = decode(type_name(&stream.shape), &message.cdr) else { continue };
            if let Data::Event(event) = decoded.data
                && event.kind == EventKind::Fault
            {
                faults.push(event.label.clone());
            }
        }
        faults
    }

    /// How many numbers of a robot the bag has.
    fn numbers(&self, robot: &str) -> usize {
        let bag = Bag::open(&self.folder).expect("a test's own");
        let name = format!("/{robot}/number");
        let of_it = |stream: usize| bag.streams()[stream].stream.name == name;
        bag.messages(None)
            .filter(|message| of_it(message.as_ref().expect("a test's own").stream))
            .count()
    }

    /// Whether it is said on the screen, in the bag and in the summary.
    fn names(&self, panic: &str) {
        assert!(self.said.contains(panic), "on the screen: {}", self.said);
        assert!(self.summary().contains(panic), "in summary.md: {}", self.summary());
        let faults = self.faults();
        assert!(faults.iter().any(|fault| fault.contains(panic)), "in the bag: {faults:?}");
    }
}

#[test]
fn a_session_in_which_nothing_panics_ends_well() {
    let session = Session::run("", "", Some("/r2/number"));
    assert_eq!(session.code(), 0, "{}", session.said);
    assert_eq!(session.faults(), [""; 0]);
}

#[test]
fn a_source_that_connects_and_sends_nothing_is_missing_whatever_its_type() {
    let missing = "numbers 1: it sends no samples";
    let session = Session::run("is_mute = true", "", Some(&format!("{missing} in 10 s")));
    session.names(missing);
    assert_eq!(session.code(), 5, "{}", session.said);
    assert!(session.said.contains(&format!("missing during the whole session: {missing}")));
    assert!(!session.said.contains("numbers 2:"), "{}", session.said);
    assert!(session.numbers("r2") > 0);
}

#[test]
fn a_source_that_connects_and_sends_nothing_is_no_go() {
    let stage = tempfile::tempdir().expect("a test's own");
    let study = stage.path().join("study.toml");
    let check = |is_mute: bool| {
        let text = format!("[[sources]]\ntype = \"numbers\"\nid = \"r1\"\nis_mute = {is_mute}\n");
        fs::write(&study, text).expect("a test's own");
        let answer = Command::new(env!("CARGO_BIN_EXE_panicking"))
            .args(["check".as_ref(), study.as_os_str(), "--seconds".as_ref(), "2".as_ref()])
            .args(["--out".as_ref(), stage.path().as_os_str()])
            .env("ROS_DOMAIN_ID", "97")
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .output()
            .expect("a test's own");
        (answer.status.code(), String::from_utf8_lossy(&answer.stdout).into_owned())
    };
    let (code, said) = check(true);
    assert!(said.contains("missing  numbers: it sends no samples"), "{said}");
    assert_eq!(code, Some(5), "{said}");
    let (code, said) = check(false);
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_source_that_panics_is_named_and_the_others_go_on() {
    let session = Session::run("panics = \"component\"", "", Some("stumbled"));
    session.names("the source stumbled");
    assert_eq!((session.code(), session.numbers("r1")), (1, 50), "{}", session.said);
}

#[test]
fn a_feature_that_panics_is_named_and_all_raw_data_are_kept() {
    let session = Session::run("", "[features.clumsy]\npanics = \"component\"", Some("stumbled"));
    session.names("the feature stumbled");
    assert_eq!(session.code(), 3, "{}", session.said);
    assert!(session.numbers("r1") >= 50 && session.numbers("r2") > 0);
}

#[test]
fn a_sink_that_panics_is_named_and_the_bag_goes_on() {
    let sink = "[[sinks]]\ntype = \"dropping\"\npanics = \"component\"";
    let session = Session::run("", sink, Some("stumbled"));
    session.names("the sink stumbled");
    assert_eq!(session.code(), 3, "{}", session.said);
    assert!(session.numbers("r1") >= 50);
}

#[test]
fn a_thread_of_a_component_that_panics_is_named() {
    let session = Session::run("panics = \"thread\"", "", Some("stumbled"));
    session.names("the thread stumbled");
    assert_eq!(session.code(), 1, "{}", session.said);
    assert!(session.numbers("r1") >= 50);
}

#[test]
fn a_pump_that_panics_ends_the_session_by_itself_with_a_whole_bag() {
    let sink = "[[sinks]]\ntype = \"dropping\"\npanics = \"pump\"";
    let session = Session::run("", sink, None);
    session.names("the pump stumbled");
    assert_eq!(session.code(), 1, "{}", session.said);
    assert!(session.numbers("r1") >= 49);
}
