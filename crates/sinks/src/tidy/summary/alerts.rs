//! The alerts of a session: how often each was raised, and how long it lasted.

use std::collections::BTreeMap;

use teampulse_core::alerts::{Alert, FAMILY, Stage, Why, holds_alerts};
use teampulse_core::counted::counted;
use teampulse_core::data::Event;
use teampulse_core::stream::Stream;
use teampulse_core::time::Time;

use crate::tidy::events;

/// The maximum number of alerts kept separately; further alerts are only counted.
const MOST: usize = 1000;

/// The alerts about limits so far, by robot or person and limit. Other alerts repeat faults of a robot, and alerts on
/// estimates are left out, as on the screen.
#[derive(Debug, Default)]
pub(super) struct AlertCounts {
    kept: BTreeMap<(String, String), AlertCount>,
    /// How often further alerts were raised.
    others: u64,
}

/// How often an alert was raised, and how long it lasted.
#[derive(Debug, Default)]
struct AlertCount {
    times: u64,
    secs: f64,
    /// When the alert was raised, unless it is over.
    since: Option<Time>,
    /// The part of `secs` in which no value arrived [s].
    unknown_secs: f64,
    /// When values ceased to arrive, unless they have returned or the alert is over.
    unknown_since: Option<Time>,
}

impl AlertCounts {
    /// Takes an event, if it is an alert.
    pub(super) fn take(&mut self, stream: &Stream, event: &Event, at: Time) {
        let is_shown = holds_alerts(stream) && stream.family == FAMILY;
        let Some(Alert { who, why: Why::Limit(limit), stage, .. }) =
            Alert::read(&event.label).filter(|_| is_shown)
        else {
            return;
        };
        let key = (who, limit);
        if self.kept.len() >= MOST && !self.kept.contains_key(&key) {
            self.others += u64::from(stage == Stage::Raised);
            return;
        }
        let count = self.kept.entry(key).or_default();
        if matches!(stage, Stage::Raised | Stage::Over) {
            count.unknown_secs += count.unknown_since.take().map_or(0.0, |since| lasted(since, at));
        }
        match stage {
            // An alert is raised again when its value returns.
            Stage::Raised if count.since.is_none() => {
                count.times += 1;
                count.since = Some(at);
            }
            Stage::Unknown if count.since.is_some() => {
                count.unknown_since.get_or_insert(at);
            }
            Stage::Over => {
                let lasted_secs = count.since.take().map(|since| lasted(since, at));
                count.secs += lasted_secs.unwrap_or(event.duration_secs.max(0.0));
            }
            _ => {}
        }
    }

    /// Returns a line for each alert; an alert that is not over counts until `now`.
    pub(super) fn lines(&self, now: Time) -> Vec<String> {
        let kept = self.kept.iter().map(|((who, limit), count)| {
            let open = |since: Option<Time>| since.map_or(0.0, |since| lasted(since, now));
            let (secs, unknown_secs) =
                (count.secs + open(count.since), count.unknown_secs + open(count.unknown_since));
            let times = counted(count.times.max(1), "time", "times");
            let unknown = if unknown_secs > 0.0 {
                format!(" ({unknown_secs:.1} s of it without values)")
            } else {
                String::new()
            };
            let not_over = if count.since.is_some() { ", not over at the end" } else { "" };
            format!("{who}: {limit}: {times}, {secs:.1} s in all{unknown}{not_over}")
        });
        let others = (self.others > 0).then(|| {
            let others = counted(self.others, "more alert", "more alerts");
            format!("and {others}: see {}", events::NAME)
        });
        kept.chain(others).collect()
    }
}

/// How long something lasted [s].
fn lasted(since: Time, until: Time) -> f64 {
    until.secs_since(since).max(0.0)
}
