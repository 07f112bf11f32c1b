//! The text of the summary.

use std::fmt;
use std::path::Path;

use teampulse_core::counted::counted;
use teampulse_core::phases::Phase;
use teampulse_core::reports::SCALE;
use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Subject;
use teampulse_core::time::Time;

use super::Summary;
use super::stream_summary::{Complaint, StreamSummary, Usable};
use super::table::Table;
use crate::tidy::file::on_one_line;
use crate::tidy::intervals::Kept;
use crate::tidy::timeline::{SHORTEST_SECS, Timeline};
use crate::tidy::{events, features, phases};

/// The maximum number of reasons listed per stream, the longest first.
const REASONS: usize = 4;
/// The maximum number of faults listed; further faults are only counted.
const FAULTS: usize = 20;

/// The heading of what was lost or wrong.
pub const LOST_OR_WRONG: &str = "## What was lost or wrong";
/// The only line below that heading if nothing was lost or wrong.
pub const NOTHING_NOTICED: &str = "Nothing was noticed.";
/// The line for a session in which no stream was received.
const NO_STREAM: &str = "- No stream of a person or a robot was received.";
/// The remark on a bag that began in a running session.
const JOINED: &str = "- The session was already running when this bag began: times count from there, and so does a phase \
                      that had begun before, such as the baseline. The streams in the bag compare with the whole \
                      phase.";
/// The meaning of the columns of the tables of streams.
const COLUMNS: &str = "\
rate: the median over the seconds in which samples arrived. usable: the share of each phase with data good enough
for values, or else the mean share over the windows in the phase, at most the share of the phase with data; for the
session, the mean over its phases if they cover it, or else over all windows, at most the share of time in which
samples arrived. * = without windows: the share of time in which the stream arrived as it should. - = a silence
would mean nothing, as for a key or the battery of a wearable. lost: on the way here and in our own queue; ? =
unknown. ± : how far a time may be off (95 %); - = unknown, as neither a model of its clock nor the computer that
stamps such a stream states it.
";

/// A summary with its context.
pub(super) struct Page<'a> {
    /// The folder of the bag.
    pub(super) folder: &'a Path,
    /// The name of the session.
    pub(super) session: &'a str,
    pub(super) timeline: &'a Timeline,
    pub(super) summary: &'a Summary,
    pub(super) intervals: &'a [Kept],
}

impl fmt::Display for Page<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.head(f)?;
        self.phases(f)?;
        self.usable(f)?;
        self.alerts(f)?;
        self.wrong(f)?;
        self.files(f)
    }
}

impl Page<'_> {
    fn head(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Page { session, timeline, .. } = self;
        let lasted = duration(timeline.secs(timeline.now()));
        let (began, ended) = (second(timeline.began()), second(timeline.now()));
        writeln!(f, "# {}\n\n{began} to {ended} (UTC), {lasted}.", on_one_line(session))?;
        let counts = &self.summary.counts;
        let (markers, reports) = (counts.markers, counts.reports);
        let interventions = counts.interventions;
        let unused = self.unused();
        let notes = match counts.notes {
            0 => String::new(),
            notes => format!(" Notes: {notes}."),
        };
        writeln!(
            f,
            "Markers: {markers} in {SESSION_EVENTS}, {} in other streams. Self-reports: {reports}{unused}.{notes} \
             Interventions: {interventions}.\n",
            counts.other_markers
        )
    }

    /// The number of self-reports that were not used, with reasons.
    fn unused(&self) -> String {
        let counts = &self.summary.counts;
        let (least, most) = (SCALE.start(), SCALE.end());
        let off_scale = format!("off the scale from {least} to {most}");
        let unused = [
            (counts.off_scale, off_scale.as_str()),
            (counts.no_number, "not a number"),
            (counts.about_nobody, "about an unknown person"),
        ];
        let reasons = unused.iter().filter(|(count, _)| *count > 0);
        let reasons: Vec<String> = reasons.map(|(count, why)| format!("{count} {why}")).collect();
        if reasons.is_empty() {
            String::new()
        } else {
            format!(" (not used: {})", reasons.join(", "))
        }
    }

    fn phases(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "## Phases\n")?;
        let head = ["of", "phase", "from [s]", "to [s]", "length [s]"].map(str::to_owned);
        let mut table = Table::new(head, 2);
        let of_all = self.timeline.phases_of(&Subject::session());
        self.phases_of("all", of_all, &mut table);
        for subject in self.subjects() {
            let own = self.timeline.phases_of(subject);
            if own != of_all {
                self.phases_of(&subject.id, own, &mut table);
            }
        }
        if table.is_empty() {
            return match of_all.len() {
                0 => writeln!(f, "None was recorded.\n"),
                short => writeln!(
                    f,
                    "None lasted a second: the {short} shorter ones are in events.tsv only.\n"
                ),
            };
        }
        writeln!(f, "{table}")?;
        match of_all.iter().filter(|phase| !lasts(phase)).count() {
            0 => Ok(()),
            1 => writeln!(f, "One lasted less than a second: it is in {} only.\n", events::NAME),
            short => {
                writeln!(
                    f,
                    "{short} lasted less than a second: they are in {} only.\n",
                    events::NAME
                )
            }
        }
    }

    fn phases_of(&self, of: &str, phases: &[Phase], table: &mut Table) {
        for phase in phases.iter().filter(|phase| lasts(phase)) {
            let secs = |at| self.timeline.tenths(at);
            let (end, length) = match phase.end {
                Some(end) => (secs(end), format!("{:.1}", end.secs_since(phase.begin))),
                None => ("-".into(), "-".into()),
            };
            table.push([of.to_owned(), phase.label.clone(), secs(phase.begin), end, length]);
        }
    }

    fn usable(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "## What is usable\n")?;
        for subject in self.subjects() {
            let name = if subject.id.is_empty() { "everyone" } else { &subject.id };
            writeln!(f, "### {name}\n\n{}", self.streams_of(subject))?;
        }
        writeln!(f, "{COLUMNS}")
    }

    fn streams_of(&self, subject: &Subject) -> Table {
        let mut labels: Vec<&str> = Vec::new();
        for phase in self.timeline.phases_of(subject).iter().filter(|phase| lasts(phase)) {
            if !labels.contains(&phase.label.as_str()) {
                labels.push(&phase.label);
            }
        }
        let head = ["stream", "rate [Hz]", "usable"].into_iter().chain(labels.iter().copied());
        let mut table = Table::new(head.chain(["lost", "± [ms]"]).map(str::to_owned), 1);
        let own = self.summary.watched.iter().filter(|((of, _), _)| of == subject);
        for ((_, name), watched) in own {
            let mut row = vec![name.clone(), rate(watched), percent(watched.usable())];
            row.extend(labels.iter().map(|label| percent(watched.usable_in(label))));
            let counted = watched.last.as_ref().filter(|_| self.summary.damage.is_none());
            row.extend([lost(counted), uncertainty(watched.last.as_ref())]);
            table.push(row);
        }
        table
    }

    fn alerts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = self.summary.alerts.lines(self.timeline.now());
        let lines: Vec<String> =
            lines.iter().map(|line| format!("- {}\n", on_one_line(line))).collect();
        if lines.is_empty() { Ok(()) } else { writeln!(f, "## Alerts\n\n{}", lines.concat()) }
    }

    fn wrong(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{LOST_OR_WRONG}\n")?;
        let streams = self.summary.watched.iter();
        let bad = streams.filter_map(|((_, name), watched)| {
            let complaints = watched.complaints();
            let reasons =
                complaints.iter().take(REASONS).map(|complaint| said(complaint, &complaints));
            let reasons: Vec<String> = reasons.collect();
            let secs = watched.not_fine_secs;
            let reasons = reasons.join("; ");
            (secs > 0).then(|| format!("- {name}: {secs} s not as it should be ({reasons})"))
        });
        let faults = self.summary.faults.kinds();
        let shown = faults.iter().take(FAULTS).map(|&(label, at, count)| {
            let often = if count > 1 { format!(", {count} times") } else { String::new() };
            format!("- at {} s: {}{often}", self.timeline.tenths(at), on_one_line(label))
        });
        let mut lines: Vec<String> = shown.collect();
        if let Some(cut_off) = self.timeline.cut_off() {
            lines.insert(0, format!("- {cut_off}"));
        }
        if self.timeline.has_joined {
            lines.insert(0, JOINED.to_owned());
        }
        if let Some(damage) = &self.summary.damage {
            let damage = on_one_line(damage);
            lines.insert(0, format!("- The bag that was replayed is damaged: {damage}."));
        }
        let unlisted = faults.len().saturating_sub(FAULTS) as u64 + self.summary.faults.others();
        if unlisted > 0 {
            let more = counted(unlisted, "more fault", "more faults");
            lines.push(format!("- and {more}: see {}", events::NAME));
        }
        lines.extend(bad);
        if self.summary.is_empty() {
            lines.push(NO_STREAM.to_owned());
        }
        if lines.is_empty() {
            lines.push(NOTHING_NOTICED.into());
        }
        writeln!(f, "{}\n", lines.join("\n"))
    }

    fn files(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (events, phases, features) = (events::NAME, phases::NAME, features::NAME);
        writeln!(
            f,
            "## Where the rest is\n\n\
             - {events}: phases, markers, reports, faults and all other events, in BIDS \
             format; beats are in\n  the intervals' files.\n\
             - {phases}: a row for each phase of each subject, a column for each measure; begin here.\n\
             - {features}: each value with its unit, or the reason why there is none; for windows \
             that do not overlap,\n  and for each phase as a whole.\n\
             - The .json beside a table describes its columns and measures, and how they are \
             computed. Times are\n  seconds since {}.",
            self.timeline.began()
        )?;
        for Kept { name, person, device, signal, count, gaps, corrected } in self.intervals {
            let missing = match gaps {
                0 | 1 => String::new(),
                2 => "; data are missing in 1 place".to_owned(),
                _ => format!("; data are missing in {} places", gaps - 1),
            };
            let intervals = counted(*count, "interval", "intervals");
            let of_device = if device.is_empty() { String::new() } else { format!(" of {device}") };
            writeln!(
                f,
                "- {name}.csv: {intervals} between heartbeats of {person} ({signal}{of_device}) with their times and\n  phases, as detected; those that the \
                 features correct are marked ({corrected}){missing}.\n- {name}.txt: the same for Kubios HRV: \
                 time of the beat and interval [s], nothing corrected."
            )?;
        }
        let bag = self.folder.file_name().unwrap_or_default().to_string_lossy();
        writeln!(
            f,
            "- Everything, every sample and the windows of each second: in the bag, which is this \
             folder.\n  `teampulse info` lists its contents, `teampulse export` exports it as tables, `teampulse recover`\n  writes these files again if this page is deleted. The bag is {bag}."
        )
    }

    /// All subjects with streams, people first.
    fn subjects(&self) -> Vec<&Subject> {
        let mut subjects: Vec<&Subject> = self.summary.watched.keys().map(|(of, _)| of).collect();
        subjects.dedup();
        subjects
    }
}

/// Whether a phase is long enough to be listed: a phase of the session begins slightly before a person's own.
fn lasts(phase: &Phase) -> bool {
    phase.end.is_none_or(|end| end.secs_since(phase.begin) >= SHORTEST_SECS)
}

/// A complaint about a stream, with its duration if there are others.
fn said(complaint: &Complaint, all: &[&Complaint]) -> String {
    let Complaint { state, reason, secs } = complaint;
    let reason = match on_one_line(reason) {
        reason if reason.is_empty() => reason,
        reason => format!(": {reason}"),
    };
    if all.len() > 1 { format!("{secs} s {state}{reason}") } else { format!("{state}{reason}") }
}

/// Formats a time to the second, without the time zone, which follows it.
fn second(time: Time) -> String {
    time.to_string()[..19].replace('T', " ")
}

/// A duration in words.
fn duration(secs: f64) -> String {
    let tenths = (10.0 * secs.max(0.0)).round();
    if tenths < 600.0 {
        return format!("{:.1} s", tenths / 10.0);
    }
    // Rounded before it is split: 119.7 s are 2 min 0 s.
    let whole = secs.round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, minutes, secs) => format!("{minutes} min {secs} s"),
        (hours, minutes, secs) => format!("{hours} h {minutes} min {secs} s"),
    }
}

fn rate(watched: &StreamSummary) -> String {
    watched.rate_hz().map_or("-".into(), |rate_hz| format!("{rate_hz:.1}"))
}

fn percent(usable: Option<Usable>) -> String {
    let Some(Usable { share, is_by_state }) = usable else { return "-".into() };
    let star = if is_by_state { "*" } else { "" };
    format!("{:.0} %{star}", 100.0 * share)
}

fn lost(last: Option<&StreamStatus>) -> String {
    let lost = last.and_then(|last| Some(last.lost_source? + last.lost_queue));
    lost.map_or("?".into(), |lost| lost.to_string())
}

fn uncertainty(last: Option<&StreamStatus>) -> String {
    let millis = last.map_or(f64::NAN, |last| 1e3 * last.uncertainty_secs());
    if millis.is_nan() { "-".into() } else { format!("{millis:.1}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_less_than_60_of_a_unit() {
        let shown = [0.04, 59.94, 59.96, 119.7, 90.4, 3599.5, 7384.2].map(duration);
        let expected = [
            "0.0 s",
            "59.9 s",
            "1 min 0 s",
            "2 min 0 s",
            "1 min 30 s",
            "1 h 0 min 0 s",
            "2 h 3 min 4 s",
        ];
        assert_eq!(shown, expected);
    }
}
