//! The types of the front end.

use ts_rs::{Config, TS};

use super::declared::{ChannelList, Declared, Description, StreamRow, Whose};
use super::from_browser::{FromBrowser, History, Wanted};
use super::from_server::{
    Alert, Column, Echo, Ended, Event, Feature, FromServer, Hello, HistoryReply, Marker, Mode,
    PhasePlan, Pong, Refused, Request, Right, Sample, Status, StreamHealth, Viewer,
};
use super::machine::{Machine, Missed, Recording, RecordingStage, Unmet};
use super::network::{Bus, Computer};
use super::replay::{Absence, Gap, Playback, Timeline};
use super::stream::{Channel, Span, Stream};
use super::{MOST_WANTED, PROTOCOL};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../web/src/wire.ts");

macro_rules! declared {
    ($($name:ident),* $(,)?) => {
        [$(declaration::<$name>()),*].concat()
    };
}

/// A type with its documentation, as TypeScript.
fn declaration<T: TS>() -> String {
    // Counts are far below 2^53.
    let config = Config::new().with_large_int("number");
    format!("{}export {}\n\n", T::docs().unwrap_or_default(), T::decl(&config))
}

fn written() -> String {
    let head = "// Generated from crates/dashboard/src/wire.rs: `TEAMPULSE_WRITE=1 cargo test -p teampulse-dashboard wire`.\n\n";
    let constants = format!(
        "export const PROTOCOL = {PROTOCOL};\nexport const MOST_WANTED = {MOST_WANTED};\n\
         /** The length of the header before the samples of a binary frame [bytes]. */\n\
         export const WAVE_HEAD_BYTES = {};\n\
         /** The length of the header before the file of a picture [bytes]. */\n\
         export const PICTURE_HEAD_BYTES = {};\n",
        super::waves::HEAD_BYTES,
        super::pictures::HEAD_BYTES
    );
    let types = declared![
        FromServer,
        Hello,
        Mode,
        Viewer,
        Right,
        Marker,
        PhasePlan,
        Declared,
        Whose,
        ChannelList,
        StreamRow,
        Description,
        Stream,
        Channel,
        Span,
        Status,
        StreamHealth,
        Feature,
        Sample,
        Event,
        Request,
        Alert,
        Recording,
        RecordingStage,
        Machine,
        Computer,
        Bus,
        Missed,
        Unmet,
        Pong,
        Echo,
        HistoryReply,
        Column,
        Refused,
        Ended,
        Playback,
        Timeline,
        Absence,
        Gap,
        FromBrowser,
        Wanted,
        History,
    ];
    format!("{head}{types}{constants}")
}

#[test]
#[expect(
    clippy::disallowed_methods,
    reason = "a test that writes the file that it checks, on request"
)]
fn the_front_end_has_these_types() {
    let written = written();
    if std::env::var("TEAMPULSE_WRITE").is_ok() {
        std::fs::write(FILE, &written).unwrap();
    }
    let kept = std::fs::read_to_string(FILE).unwrap_or_default();
    assert!(kept == written, "web/src/wire.ts is out of date: see its first line");
}
