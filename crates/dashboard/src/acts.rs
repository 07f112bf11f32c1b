//! Actions of viewers, each of which becomes an event of the session.

use std::collections::BTreeSet;
use std::sync::Arc;

use teampulse_core::command::{Command, Sender};
use teampulse_core::data::{Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::reports::{ISA, SCALE};
use teampulse_core::stream::About;
use teampulse_core::time::Time;

use crate::client::Client;
use crate::history::STORED_SECS;
use crate::hub::{Awaited, Hub};
use crate::joining::show;
use crate::wire::{
    Description, FromBrowser, FromServer, HistoryReply, HistoryRequest, MOST_WANTED, Right,
};

/// The longest note, and the longest label of an acknowledged event [bytes].
const LONGEST_TEXT: usize = 1000;
/// The longest reference of a message, and the longest name of a scale or a person [bytes].
const LONGEST_WORD: usize = 100;
/// The largest number of columns in an answer.
const MOST_POINTS: u32 = 4000;
/// How long ago an action may have happened, as it may have waited for a connection, and how far in the future its time
/// may be [s].
const AGES_SECS: (f64, f64) = (60.0, 1.0);

/// Why an action was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Whether the action was invalid or not allowed.
    pub cause: Cause,
    /// The reason.
    pub reason: String,
    /// What the user can do; may be empty.
    pub hint: String,
}

/// The cause of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The action has a value that can't be recorded.
    Invalid,
    /// This viewer, or this session, does not allow the action.
    NotAllowed,
}

impl Refusal {
    /// A refusal of an action that has an invalid value.
    pub fn new(reason: impl Into<String>, hint: &str) -> Refusal {
        Refusal { cause: Cause::Invalid, reason: reason.into(), hint: hint.to_owned() }
    }

    fn not_allowed(reason: impl Into<String>, hint: &str) -> Refusal {
        Refusal { cause: Cause::NotAllowed, ..Refusal::new(reason, hint) }
    }
}

/// Returns the reference that a client gave its message; `None` for a kind of message without one.
pub fn reference(asked: &FromBrowser) -> Option<&str> {
    match asked {
        FromBrowser::Ping { .. } | FromBrowser::Want { .. } | FromBrowser::Shown { .. } => None,
        FromBrowser::History(HistoryRequest { reference, .. })
        | FromBrowser::Describe { reference, .. }
        | FromBrowser::Command { reference, .. }
        | FromBrowser::Note { reference, .. }
        | FromBrowser::Annotate { reference, .. }
        | FromBrowser::Acknowledge { reference, .. }
        | FromBrowser::Report { reference, .. }
        | FromBrowser::ShowEstimates { reference }
        | FromBrowser::Play { reference, .. } => Some(reference),
    }
}

/// Carries out a client's message; returns the answer if there is one immediately.
pub fn act(
    hub: &Hub,
    client: &Arc<Client>,
    asked: FromBrowser,
) -> Result<Option<FromServer>, Refusal> {
    if reference(&asked).is_some_and(|reference| reference.len() > LONGEST_WORD) {
        return Err(Refusal::new("the reference of the message is too long", ""));
    }
    let doer = Doer {
        hub,
        right: client.grant.right,
        sender: client.grant.sender(),
        client: Some(client.number),
    };
    match asked {
        FromBrowser::Ping { .. } => {}
        FromBrowser::Want { streams } if streams.len() > MOST_WANTED => {
            let reason = format!("{} streams can't be drawn at once", streams.len());
            return Err(Refusal::new(reason, "choose at most 256"));
        }
        FromBrowser::Want { streams } => client.want(&streams, &hub.known()),
        FromBrowser::Shown { streams } => {
            for stream in streams {
                client.outbox.shown(stream);
            }
        }
        FromBrowser::History(asked) => {
            return history(hub, client, asked).map(|reply| Some(FromServer::History(reply)));
        }
        FromBrowser::Describe { stream, .. } => {
            let known = hub.known();
            let stream = known.streams.get(&stream).map(|it| (stream, it));
            let (stream, described) =
                stream.ok_or_else(|| Refusal::new("there is no such stream", ""))?;
            let (method, doc) = (described.method.clone(), described.doc.clone());
            return Ok(Some(FromServer::Description(Description { stream, method, doc })));
        }
        FromBrowser::Command { reference, text, at } => doer.command(&text, at, reference)?,
        FromBrowser::Note { reference, text, at } => doer.note(&text, at, reference)?,
        FromBrowser::Annotate { reference, text, from, to } => {
            doer.annotate(&text, (from, to), reference)?;
        }
        FromBrowser::Acknowledge { reference, alert, at } => {
            doer.acknowledge(&alert, at, reference)?;
        }
        FromBrowser::Report { reference, subject, scale, value, at } => {
            doer.report(&scale, subject.as_deref(), (value, at), reference)?;
        }
        FromBrowser::ShowEstimates { reference } => {
            doer.show_estimates(reference)?;
            client.unblind();
            show(&hub.known(), client);
        }
        FromBrowser::Play { t, rate, paused, .. } => play(hub, client, t, rate, paused)?,
    }
    Ok(None)
}

/// Changes the playback of a recording for all viewers: the position [s], the rate, or whether it is paused.
fn play(
    hub: &Hub,
    client: &Client,
    t: Option<f64>,
    rate: Option<f64>,
    paused: Option<bool>,
) -> Result<(), Refusal> {
    let Some(playhead) = &hub.context.playhead else {
        return Err(Refusal::not_allowed(
            "this is a live session",
            "`teampulse play BAG` shows a recording",
        ));
    };
    if client.grant.right < Right::Control {
        let hint = "open the dashboard with a token for `control`";
        return Err(Refusal::not_allowed("this viewer may only watch", hint));
    }
    if [t, rate].into_iter().flatten().any(|number| !number.is_finite()) {
        return Err(Refusal::new("the position or the rate is not a number", ""));
    }
    if let Some(secs) = t {
        // The clamp prevents an overflow; the playhead limits the position to the recording.
        let nanos = (secs.clamp(-1e9, 1e9) * 1e9) as i64;
        playhead.jump(Time::from_nanos(hub.began().nanos().saturating_add(nanos)));
    }
    if let Some(rate) = rate {
        playhead.set_rate(rate);
    }
    if let Some(is_paused) = paused {
        playhead.set_paused(is_paused);
    }
    Ok(())
}

fn history(hub: &Hub, client: &Client, asked: HistoryRequest) -> Result<HistoryReply, Refusal> {
    let HistoryRequest { reference, stream, from, to, points } = asked;
    if !(from.is_finite() && to.is_finite()) {
        return Err(Refusal::new("the times of the request are not numbers", ""));
    }
    let known = hub.known();
    if !known.shows(stream, client.is_blind()) {
        return Err(Refusal::not_allowed(
            "the stream is hidden from this viewer",
            "choose to show estimates; the choice is recorded",
        ));
    }
    let track = known.tracks.get(&stream);
    let track = track.ok_or_else(|| Refusal::new("no data of this stream is stored", ""))?;
    let excerpt = track.excerpt(from, to, points.min(MOST_POINTS));
    let (from, step, channels) = (excerpt.from, excerpt.step, excerpt.channels);
    Ok(HistoryReply { reference, stream, from, step, channels })
}

/// The author of actions: a viewer, or a program through `/api`.
pub struct Doer<'a> {
    /// The session.
    pub hub: &'a Hub,
    /// The right of the viewer or program.
    pub right: Right,
    /// The name of the viewer or program in the bag.
    pub sender: Sender,
    /// The number of the client that gets the echo; `None` for a program.
    pub client: Option<u64>,
}

impl Doer<'_> {
    /// Sends a command that is given as text.
    pub fn command(&self, text: &str, at: Option<f64>, reference: String) -> Result<(), Refusal> {
        let command = text.parse().map_err(|error| Refusal::new(format!("failed to {error}"), ""));
        self.send(command?, at, reference)
    }

    /// Sets a marker.
    pub fn mark(&self, label: &str, at: Option<f64>, reference: String) -> Result<(), Refusal> {
        self.send(Command::Mark(recordable(label)?.to_owned()), at, reference)
    }

    fn send(&self, command: Command, at: Option<f64>, reference: String) -> Result<(), Refusal> {
        let kind = match &command {
            Command::Mark(_) => EventKind::Marker,
            _ => EventKind::Command,
        };
        let right = if kind == EventKind::Marker { Right::Mark } else { Right::Control };
        let outlet = self.allowed(right)?;
        let at = self.expect(kind, at, reference)?;
        let verb = command.verb();
        outlet.command_at(&self.sender, command, Some(at)).map_err(|refused| {
            self.hub.forget_awaited(at);
            Refusal::not_allowed(format!("`{verb}` was refused: {refused}"), "")
        })
    }

    /// Writes a note.
    pub fn note(&self, text: &str, at: Option<f64>, reference: String) -> Result<(), Refusal> {
        self.write("note", text, at, reference)
    }

    /// Labels a span of the signals [s] with a marker that has a duration.
    pub fn annotate(
        &self,
        text: &str,
        (from, to): (f64, f64),
        reference: String,
    ) -> Result<(), Refusal> {
        let text = recordable(text)?;
        let outlet = self.allowed(Right::Mark)?;
        let (now, from) = (self.hub.now(), from.max(0.0));
        if !(from >= now - STORED_SECS && to <= now + AGES_SECS.1) {
            let hint = "choose a span of the last ten minutes";
            return Err(Refusal::new("the span is outside the stored data", hint));
        }
        if to <= from {
            let hint = "drag over the signals, or use [ and ] at the cursor";
            return Err(Refusal::new("the span has no length", hint));
        }
        let begin = self.hub.moment(Some(from));
        let duration_secs = to - self.hub.secs(begin);
        self.await_echo(EventKind::Marker, begin, true, reference);
        outlet.annotate(&self.sender, text.to_owned(), begin, duration_secs).map_err(|refused| {
            self.hub.forget_awaited(begin);
            Refusal::not_allowed(format!("the label was refused: {refused}"), "")
        })
    }

    /// Records that an alert or a fault was seen.
    pub fn acknowledge(
        &self,
        alert: &str,
        at: Option<f64>,
        reference: String,
    ) -> Result<(), Refusal> {
        self.write("acknowledge", alert, at, reference)
    }

    /// Reports a rating on a scale; `subject` names the person if there are several.
    pub fn report(
        &self,
        scale: &str,
        subject: Option<&str>,
        (value, at): (f64, Option<f64>),
        reference: String,
    ) -> Result<(), Refusal> {
        let is_word = |word: &str| {
            let is_part = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
            (1..=LONGEST_WORD).contains(&word.len()) && word.chars().all(is_part)
        };
        if !is_word(scale) || !subject.is_none_or(is_word) || !value.is_finite() {
            let hint =
                "scale and person are words of letters, digits, - and _; the value is a number";
            return Err(Refusal::new("the scale, the person or the value is invalid", hint));
        }
        if let Some(refusal) = self.unused(scale, subject, value) {
            return Err(refusal);
        }
        let subject = subject.map(|subject| format!(" {subject}")).unwrap_or_default();
        self.happen(format!("{scale}{subject}"), value, (Right::Mark, at), reference)
    }

    /// Refuses a report that nothing would use: an Instantaneous Self-Assessment off its scale or about an unknown
    /// person.
    fn unused(&self, scale: &str, subject: Option<&str>, value: f64) -> Option<Refusal> {
        if !scale.eq_ignore_ascii_case(ISA) {
            return None;
        }
        let (least, most) = (SCALE.start(), SCALE.end());
        if !SCALE.contains(&value) {
            let hint = format!("report a value from {least} (idle) to {most} (too much)");
            return Some(Refusal::new(format!("ISA {value} is off the scale"), &hint));
        }
        let others = self.others_than(subject?)?;
        let reason =
            format!("the ISA of {} can't be used: nobody with that name is known", subject?);
        Some(Refusal::new(reason, &format!("known people: {others}")))
    }

    /// Returns the known people, separated by commas, if `subject` is not among them; `None` if it is, or if nobody is
    /// known yet.
    pub fn others_than(&self, subject: &str) -> Option<String> {
        let known = self.hub.known();
        let people = known.streams.values().filter(|stream| stream.about == About::Person);
        let people: BTreeSet<&str> = people.map(|stream| &*stream.id).collect();
        let is_unknown = !people.is_empty() && !people.contains(subject);
        is_unknown.then(|| people.into_iter().collect::<Vec<_>>().join(", "))
    }

    fn show_estimates(&self, reference: String) -> Result<(), Refusal> {
        let label = format!("{} show_estimates", self.sender);
        self.happen(label, f64::NAN, (Right::Control, None), reference)
    }

    fn write(
        &self,
        verb: &str,
        text: &str,
        at: Option<f64>,
        reference: String,
    ) -> Result<(), Refusal> {
        let text = recordable(text)?;
        self.happen(
            format!("{} {verb} {text}", self.sender),
            f64::NAN,
            (Right::Mark, at),
            reference,
        )
    }

    fn happen(
        &self,
        label: String,
        value: f64,
        (right, at): (Right, Option<f64>),
        reference: String,
    ) -> Result<(), Refusal> {
        let outlet = self.allowed(right)?;
        let kind = EventKind::Report;
        let at = self.expect(kind, at, reference)?;
        outlet.happen_at(Event { kind, label, value, duration_secs: 0.0 }, Some(at));
        Ok(())
    }

    fn allowed(&self, right: Right) -> Result<&Outlet, Refusal> {
        if self.right < right {
            let right = if right == Right::Mark { "mark" } else { "control" };
            let hint = format!("open the dashboard with a token for `{right}`");
            return Err(Refusal::not_allowed("this viewer may not do that", &hint));
        }
        self.hub.outlet.as_ref().ok_or_else(|| {
            Refusal::not_allowed(
                "this is a recording: nothing can be added to it",
                "`teampulse run` records events",
            )
        })
    }

    /// Returns the time of an action, and awaits the action's event. Fails if the time is not allowed.
    fn expect(&self, kind: EventKind, at: Option<f64>, reference: String) -> Result<Time, Refusal> {
        at.map_or(Ok(()), |at| check_time(at, self.hub.now()))?;
        let (is_timed, at) = (at.is_some(), self.hub.moment(at));
        self.await_echo(kind, at, is_timed, reference);
        Ok(at)
    }

    fn await_echo(&self, kind: EventKind, at: Time, is_timed: bool, reference: String) {
        if let Some(client) = self.client {
            self.hub.expect(Awaited { client, reference, kind, at, is_timed });
        }
    }
}

/// Returns the earliest and the latest time that an action may have [s].
pub fn times(now: f64) -> (f64, f64) {
    let (old, ahead) = AGES_SECS;
    ((now - old).max(0.0), now + ahead)
}

/// Fails if an action can't have happened at this time [s]: before the session, more than a minute ago, or more than a
/// second ahead.
fn check_time(at: f64, now: f64) -> Result<(), Refusal> {
    let (first, last) = times(now);
    if (first..=last).contains(&at) {
        return Ok(());
    }
    let at = if at.abs() < 1e9 { format!("{at:.1}") } else { format!("{at:e}") };
    let reason = if at.starts_with('-') {
        format!("a time of {at} s is before the session began")
    } else {
        format!("a time of {at} s is not within the last minute of the session")
    };
    let hint = format!(
        "expected seconds since the session began, {first:.1} to {now:.1}; omit the time for now"
    );
    Err(Refusal::new(reason, &hint))
}

/// Returns the trimmed text. Fails if it is empty or too long to be recorded.
fn recordable(text: &str) -> Result<&str, Refusal> {
    let text = text.trim();
    match text.len() {
        0 => Err(Refusal::new("the text is empty", "write 1 to 1000 bytes")),
        1..=LONGEST_TEXT => Ok(text),
        bytes => {
            let reason = format!("a text of {bytes} bytes can't be recorded");
            Err(Refusal::new(reason, "write 1 to 1000 bytes"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_action_happened_during_the_session_and_within_the_last_minute() {
        for (at, now) in [(0.0, 5.0), (5.9, 5.0), (40.0, 100.0), (100.0, 100.0)] {
            assert_eq!(check_time(at, now), Ok(()), "{at} at {now}");
        }
        for (at, now, reason) in [
            (-5.0, 20.0, "a time of -5.0 s is before the session began"),
            (-1e300, 20.0, "a time of -1e300 s is before"),
            (39.0, 100.0, "a time of 39.0 s is not within the last minute"),
            (102.0, 100.0, "a time of 102.0 s is not within the last minute"),
            (1e300, 100.0, "a time of 1e300 s is not within"),
        ] {
            let refusal = check_time(at, now).expect_err("no such time");
            assert!(refusal.reason.starts_with(reason), "{}", refusal.reason);
            assert_eq!(refusal.cause, Cause::Invalid);
        }
        let hint = check_time(-5.0, 20.0).expect_err("before the session").hint;
        assert!(
            hint.starts_with("expected seconds since the session began, 0.0 to 20.0"),
            "{hint}"
        );
    }
}
