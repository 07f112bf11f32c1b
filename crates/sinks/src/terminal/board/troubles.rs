//! The items on the board that need attention.

use std::collections::BTreeMap;

use teampulse_core::alerts::Tier;
use teampulse_core::status::StreamStatus;

use super::{Board, NAME_COLUMNS, clock_time};
use crate::terminal::natural::Name;
use crate::terminal::robot::Figures;
use crate::terminal::styled_line::StyledLine;
use crate::terminal::trouble::{Trouble, Urgency};

/// The time after which it is reported that no stream has appeared [s].
const NOTHING_SECS: f64 = 10.0;
/// From this number on, streams of one subject with the same trouble share a line; fewer streams have one line each.
const SHARE_A_LINE: usize = 3;

impl Board {
    /// The items that need attention, the most urgent first.
    pub(in crate::terminal) fn troubles(&self) -> Vec<StyledLine> {
        let mut troubles: Vec<Trouble> = Vec::new();
        for fault in self.faults.unseen() {
            let (urgency, subject) = (Urgency::Fault, clock_time(fault.last));
            troubles.push(Trouble { urgency, subject, what: fault.words(), since: None });
        }
        let mut needs: Vec<_> = self.team.needs().collect();
        needs.sort_by_key(|need| need.since);
        let offline = self.robots.iter().filter(|(_, robot)| robot.is_offline());
        let offline = offline.filter(|(id, _)| needs.iter().all(|need| need.who != id.0));
        troubles.extend(offline.map(|(Name(id), _)| {
            let (subject, what) = (id.clone(), "offline".to_owned());
            Trouble { urgency: Urgency::Dead, subject, what, since: None }
        }));
        troubles.extend(needs.into_iter().map(|need| Trouble {
            urgency: match need.tier {
                Some(Tier::Soon) => Urgency::NeedSoon,
                Some(Tier::Note) => Urgency::Note,
                Some(Tier::Act) => Urgency::NeedNow,
                None => Urgency::Need,
            },
            subject: need.who.to_owned(),
            what: need.why,
            since: Some(need.since),
        }));
        if self.has_nothing() && self.elapsed_secs() >= NOTHING_SECS {
            let what = "no stream has appeared: nothing named in the study is present".to_owned();
            let subject = "nothing".to_owned();
            troubles.push(Trouble { urgency: Urgency::Never, subject, what, since: None });
        }
        troubles.extend(self.stream_troubles());
        troubles.sort_by_key(|trouble| trouble.urgency);
        let width = troubles.iter().map(|trouble| trouble.subject.chars().count()).max();
        let width = width.unwrap_or(0).min(NAME_COLUMNS);
        troubles.iter().map(|trouble| trouble.line(width, self.now)).collect()
    }

    /// The troubles of streams, by subject and state. Silent streams of an offline robot are not mentioned.
    fn stream_troubles(&self) -> Vec<Trouble> {
        let mut groups: BTreeMap<(Urgency, Name), Vec<(&str, &StreamStatus)>> = BTreeMap::new();
        for status in self.statuses().filter(|status| self.is_trouble(status)) {
            let Some(urgency) = Urgency::of(status.state) else { continue };
            let (subject, name) = self.owner(status);
            let is_offline = |id: &Name| self.robots.get(id).is_some_and(Figures::is_offline);
            if !subject.as_ref().is_some_and(is_offline) {
                let subject = subject.unwrap_or_else(|| Name("other".into()));
                groups.entry((urgency, subject)).or_default().push((name, status));
            }
        }
        let troubles = groups.into_iter().flat_map(|((urgency, Name(subject)), streams)| {
            let size = if streams.len() < SHARE_A_LINE { 1 } else { streams.len() };
            let parts = streams.chunks(size);
            parts.map(|part| Trouble::of_streams(&subject, urgency, part)).collect::<Vec<_>>()
        });
        troubles.collect()
    }
}
