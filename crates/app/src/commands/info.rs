//! `teampulse info`: lists the contents of a bag.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use teampulse_bag::{
    Bag, BagStream, CONTINUES_NOTE, DAMAGE_NOTE, Damage, ENDED_NOTE, Unread, absent_text,
};
use teampulse_core::counted::counted;
use teampulse_core::stream::Origin;
use teampulse_core::time::Time;
use teampulse_messages::convert::schema_of;

use crate::commands::replay::RETIMED;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{self, pasted};

/// Shows the contents of a bag: its streams with their types, counts, rates and losses.
#[derive(Debug, Args)]
pub struct Info {
    /// The bags: each a folder, or one of its .mcap files
    #[arg(required = true, value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Reads all of each bag, which also finds damage inside chunks, and fails (exit code 1) if there is any; takes as
    /// long as reading the bag
    #[arg(long)]
    check: bool,
    /// Prints one JSON object, or an array of them for several bags
    #[arg(long)]
    json: bool,
}

/// The message on a bag that was opened during its recording.
const BEING_RECORDED: &str = "still being recorded: what has been written so far is read";

/// The limit of a check without checksums.
pub const NO_CHECKSUMS: &str = "without checksums, so changed bytes can't be found";

/// A bag as reported.
#[derive(Debug, Serialize)]
struct BagInfo {
    path: String,
    messages: u64,
    /// Null for a bag without messages.
    start_secs: Option<f64>,
    duration_secs: f64,
    /// Whether `retime` computed the times, so that each time also depends on later data.
    two_sided: bool,
    /// Whether the bag is still being recorded: its last second may be missing.
    being_recorded: bool,
    #[serde(skip)]
    can_be_repaired: bool,
    damage: Vec<String>,
    notes: BTreeMap<String, String>,
    streams: Vec<Row>,
}

/// A stream as reported.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    #[serde(rename = "type")]
    type_name: String,
    origin: &'static str,
    messages: u64,
    /// Null if fewer than two messages, or no time between them, leave it unknown.
    rate_hz: Option<f64>,
    /// Messages lost in transit and in our own queue; null if unknown, as in a damaged bag.
    lost: Option<u64>,
}

impl Info {
    /// Runs the command.
    pub fn run(self) -> Result<Exit, Failure> {
        if !self.json {
            return self.show();
        }
        let (mut bags, mut exit) = (Vec::new(), Exit::Fine);
        for path in self.bags() {
            let bag = self.opened(path)?;
            exit = self.after(&bag, exit);
            bags.push(describe(&bag));
        }
        match bags.as_slice() {
            [one] => output::json(one),
            several => output::json(&several),
        }
        Ok(exit)
    }

    /// Prints each bag as soon as it is opened.
    fn show(&self) -> Result<Exit, Failure> {
        let mut exit = Exit::Fine;
        for (place, path) in self.bags().into_iter().enumerate() {
            let bag = self.opened(path)?;
            exit = self.after(&bag, exit);
            if place > 0 {
                output::line("");
            }
            show(&describe(&bag));
            if self.check && damage(&bag).is_empty() {
                output::line(format!("checked: {}", verdict(&bag)));
            }
        }
        Ok(exit)
    }

    /// Returns the bags among the paths, without folders of exported tables, which a shell pattern may match, too.
    fn bags(&self) -> Vec<&PathBuf> {
        let is_export = |path: &&PathBuf| path.is_dir() && path.extension() == Some("csv".as_ref());
        let (exports, bags): (Vec<&PathBuf>, Vec<&PathBuf>) = self.bags.iter().partition(is_export);
        if bags.is_empty() {
            return exports;
        }
        for path in exports {
            output::note(format!("{} holds exported tables, not a bag", path.display()));
        }
        bags
    }

    /// Returns the exit code after a bag: a damaged bag fails a check; missing files are lost data.
    fn after(&self, bag: &Bag, exit: Exit) -> Exit {
        match exit {
            _ if self.check && !damage(bag).is_empty() => Exit::Failed,
            Exit::Fine if !bag.absent().is_empty() => Exit::DataLost,
            exit => exit,
        }
    }

    /// Opens a bag, and reads all of it if a check is requested.
    fn opened(&self, path: &std::path::Path) -> Result<Bag, Failure> {
        let mut bag = open(path)?;
        if self.check {
            bag.check();
        }
        Ok(bag)
    }
}

/// Opens a bag, or explains why it can't be opened.
pub fn open(path: &std::path::Path) -> Result<Bag, Failure> {
    Bag::open(path).map_err(|error| Failure::to(&error).hint(error.hint()))
}

/// Prints the damage in a bag on standard error before the bag is read.
pub fn warn_of_damage(bag: &Bag) {
    if bag.is_being_recorded() {
        output::note(format!("{} is {BEING_RECORDED}", bag.path().display()));
    }
    for each in damage(bag) {
        output::note(format!("damaged: {each}"));
    }
}

/// Describes the result of checking an undamaged bag.
fn verdict(bag: &Bag) -> String {
    let (count, lacks) = (bag.messages_count(), bag.lacks_checksums());
    let found = match (count, lacks) {
        (1, false) => "its message is intact".to_owned(),
        (_, false) => format!("all {count} messages are intact"),
        (1, true) => "its message can be read".to_owned(),
        (_, true) => format!("all {count} messages can be read"),
    };
    if lacks { format!("{found}; {NO_CHECKSUMS}") } else { found }
}

/// Returns the exit code of a command that has read a bag: damage means lost data.
pub fn after_reading(bag: &Bag, unread: &Unread, exit: Exit) -> Exit {
    let is_whole = damage(bag).is_empty() && unread.is_empty();
    if exit == Exit::Fine && !is_whole { Exit::DataLost } else { exit }
}

/// Describes the known damage in a bag; complete only after a check.
pub fn damage(bag: &Bag) -> Vec<String> {
    let places =
        bag.damage().map(|(path, each)| format!("{}: {}", path.display(), damage_text(each)));
    let missing = (bag.missing() > 0).then(|| {
        let (path, missing) = (bag.path().display(), bag.missing());
        let of = bag.messages_count() + missing;
        format!("{path}: {missing} of {} missing", counted(of, "message is", "messages are"))
    });
    let files = bag
        .absent()
        .iter()
        .map(|file| format!("{}: {}", bag.path().display(), absent_text(file, bag.files_count())));
    files.chain(places).chain(missing).collect()
}

/// Describes damage and its place.
pub fn damage_text(damage: &Damage) -> String {
    let Damage { offset, lost_bytes, reason, .. } = damage;
    match lost_bytes {
        0 => format!("at byte {offset}: {reason}"),
        _ => format!(
            "at byte {offset}: {reason}; {} can't be read",
            counted(*lost_bytes, "byte", "bytes")
        ),
    }
}

fn describe(bag: &Bag) -> BagInfo {
    let (first, last) = bag.bounds().unwrap_or_default();
    let duration_secs = last.secs_since(first);
    let mut streams: Vec<Row> =
        bag.streams().iter().map(|stream| row(bag, stream, duration_secs)).collect();
    if bag.lost_to_damage().is_some() {
        // It is unknown which streams the lost messages belonged to.
        for row in &mut streams {
            row.lost = None;
        }
    }
    streams.sort_by(|a, b| a.name.cmp(&b.name));
    let before = bag.notes().get(DAMAGE_NOTE).map(|note| format!("repaired; {note}"));
    BagInfo {
        path: bag.path().display().to_string(),
        messages: bag.messages_count(),
        start_secs: bag.bounds().map(|(first, _)| first.secs()),
        duration_secs,
        two_sided: bag.notes().contains_key(RETIMED),
        being_recorded: bag.is_being_recorded(),
        can_be_repaired: bag.damage().next().is_some() && bag.can_be_repaired(),
        damage: damage(bag).into_iter().chain(before).collect(),
        notes: bag.notes().clone(),
        streams,
    }
}

fn row(bag: &Bag, known: &BagStream, duration_secs: f64) -> Row {
    let noted = |what: &str| bag.notes().get(&format!("{what}:{}", known.stream.name));
    let counted = |what: &str| noted(what).and_then(|text| text.parse::<u64>().ok());
    let lost = counted("lost_source").map(|lost| lost + counted("lost_queue").unwrap_or(0));
    Row {
        name: known.stream.name.clone(),
        type_name: schema_of(&known.stream.shape).name.clone(),
        origin: if known.stream.origin == Origin::Raw { "raw" } else { "derived" },
        messages: known.messages,
        rate_hz: rate_hz(known.messages, duration_secs),
        lost,
    }
}

/// Messages per second; `None` if unknown.
fn rate_hz(messages: u64, duration_secs: f64) -> Option<f64> {
    (messages > 1 && duration_secs > 0.0).then(|| messages as f64 / duration_secs)
}

/// States whether and why a recording ended before its session, and which bag it continues.
fn how_it_ended(notes: &BTreeMap<String, String>) -> impl Iterator<Item = String> {
    let noted = |note: &str, what: &str| notes.get(note).map(|text| format!("{what}: {text}"));
    let ended = noted(ENDED_NOTE, "ended before its session");
    ended.into_iter().chain(noted(CONTINUES_NOTE, "continues"))
}

fn show(info: &BagInfo) {
    output::line(format!("{}  {}", info.path, counted(info.messages, "message", "messages")));
    if let Some(start_secs) = info.start_secs {
        let start = Time::from_nanos((start_secs * 1e9) as i64);
        output::line(format!("from {start} for {:.1} s", info.duration_secs));
    }
    if info.two_sided {
        output::line(
            "times are two-sided: `teampulse retime` computed them from all data about each clock",
        );
    }
    output::lines(how_it_ended(&info.notes));
    if info.being_recorded {
        output::line(BEING_RECORDED);
    }
    output::lines(info.damage.iter().map(|each| format!("damaged: {each}")));
    if info.can_be_repaired {
        let path = pasted(Path::new(&info.path));
        output::line(format!("repair it with `teampulse recover {path}`"));
    }
    output::line("");
    output::lines(table(&info.streams));
}

/// Formats the streams as a table with a header; columns are as wide as their widest cell.
fn table(streams: &[Row]) -> impl Iterator<Item = String> {
    let widest = |least: usize, text: fn(&Row) -> &str| {
        streams.iter().map(|row| text(row).chars().count()).fold(least, usize::max)
    };
    let name_width = widest(44, |row| &row.name);
    let type_width = widest(36, |row| &row.type_name);
    let line = move |[name, type_name, origin, messages, rate, lost]: [&str; 6]| {
        format!(
            "{name:<name_width$} {type_name:<type_width$} {origin:<8} {messages:>9} {rate:>9} {lost:>6}"
        )
    };
    let head = line(["stream", "type", "origin", "messages", "per s", "lost"]);
    let rows = streams.iter().map(move |row| {
        let lost = match (row.origin, row.lost) {
            (_, Some(lost)) => lost.to_string(),
            ("raw", None) => "?".into(),
            _ => String::new(),
        };
        let rate = row.rate_hz.map_or_else(|| "?".into(), |rate_hz| format!("{rate_hz:.2}"));
        line([&row.name, &row.type_name, row.origin, &row.messages.to_string(), &rate, &lost])
    });
    std::iter::once(head).chain(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_state_why_a_recording_ended_early_and_which_one_it_continues() {
        let notes = [(ENDED_NOTE, "the disk is full"), (CONTINUES_NOTE, "a_bag")];
        let notes = notes.map(|(note, text)| (note.to_owned(), text.to_owned()));
        let lines: Vec<String> = how_it_ended(&BTreeMap::from(notes)).collect();
        assert_eq!(lines, ["ended before its session: the disk is full", "continues: a_bag"]);
        assert_eq!(how_it_ended(&BTreeMap::new()).count(), 0);
    }

    #[test]
    fn columns_stay_aligned_with_long_names() {
        let row = |name: &str| Row {
            name: name.to_owned(),
            type_name: "teampulse_msgs/msg/Feature".to_owned(),
            origin: "derived",
            messages: 4,
            rate_hz: Some(0.5),
            lost: None,
        };
        let long = format!("/humans/persons/{}", "p".repeat(60));
        let lines: Vec<String> = table(&[row("/odom"), row(&long)]).collect();
        assert!(lines[2].starts_with(&long));
        let types: Vec<Option<usize>> = lines[1..].iter().map(|line| line.find("team")).collect();
        assert_eq!(types, [lines[0].find("type"); 2]);
    }

    #[test]
    fn one_message_or_no_duration_gives_no_rate() {
        assert_eq!(rate_hz(1, 0.0), None);
        assert_eq!(rate_hz(1, 60.0), None);
        assert_eq!(rate_hz(5, 0.0), None);
        assert_eq!(rate_hz(600, 60.0), Some(10.0));
    }
}
