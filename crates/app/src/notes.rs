//! Notes on a study before it runs: valid, but perhaps not what was intended.

use std::collections::BTreeSet;
use std::sync::Arc;

use teampulse_bag::disk::existing;
use teampulse_core::pattern::Pattern;
use teampulse_core::phases::BASELINE;
use teampulse_core::stream::{Stream, Window};
use teampulse_features::thresholds::Threshold;
use teampulse_sinks::Bag;
use teampulse_sources::robots::Robots;
use teampulse_sources::session::Phase;

use crate::machine::LEAST_DISK;
use crate::setup::keeping;
use crate::study::Study;

/// Prefixes of streams about the whole team and about the session itself, which always exist.
const TEAM: &str = "/team/";
const OURS: &str = "/teampulse/";
/// The most channel names of a stream that are listed.
const NAMES: usize = 20;
/// Why an alert watches no values over phases.
const OF_PHASES: &str = "values over phases come only once per phase";

/// Returns the notes on a study.
pub fn of_study(study: &Study) -> Vec<String> {
    let nothing = "no sink stores data: nothing is recorded";
    let kept = keeping(study).is_empty().then(|| nothing.to_owned());
    let phases = &study.general.phases;
    let watches_people = study.kinds("sources").iter().any(|kind| kind == "people");
    let baseline = watches_people.then(|| of_phases(phases)).flatten();
    let bags = || study.settings_of::<Bag>("sinks", "bag").into_iter().flatten();
    let room = bags().find_map(|bag| of_room(&bag));
    let paused = bags().find_map(|bag| of_pause(&bag));
    let fallback = bags().find_map(|bag| of_fallback(&bag));
    let (by_hand, order) = (of_hand(phases), of_order(phases));
    let of_bags = room.into_iter().chain(paused).chain(fallback).chain(of_robots(study));
    let of_phases = baseline.into_iter().chain(by_hand).chain(order);
    kept.into_iter().chain(of_phases).chain(of_bags).chain(of_keys(study)).collect()
}

/// Notes keys that send requests to a component that the study does not have.
fn of_keys(study: &Study) -> Vec<String> {
    let keys = study.key_commands().unwrap_or_default();
    let named = study.texts("workers", "name").into_iter().flatten();
    let kinds = ["sources", "workers", "sinks"].into_iter().flat_map(|key| study.kinds(key));
    let known: BTreeSet<String> = named.chain(kinds).collect();
    let idle = keys.asked().filter(|(_, component)| !known.contains(*component));
    let note = |(key, component)| {
        format!(
            "the key `{key}` sends a request to `{component}`, which no component of the study accepts"
        )
    };
    idle.map(note).collect()
}

/// Notes sources of robots whose robots all belong to a source listed earlier.
fn of_robots(study: &Study) -> Vec<String> {
    let all: Vec<Robots> = study.settings_of("sources", "robots").unwrap_or_default();
    let covered = all.iter().enumerate().filter_map(|(place, later)| {
        let first = all[..place].iter().find(|first| first.cover(later))?;
        let (wide, narrow) = (&first.namespace, &later.namespace);
        Some(if wide == narrow {
            format!(
                "two sources read the robots of {wide}: a topic that both take is read with the settings of the first"
            )
        } else {
            format!(
                "the robots of {narrow} are also those of {wide}, which is listed first: a topic that both take is \
                 read with the earlier settings; list {narrow} first"
            )
        })
    });
    covered.collect()
}

/// Notes that a fallback would be created, perhaps because its disk is not mounted.
fn of_fallback(bag: &Bag) -> Option<String> {
    let fallback = bag.fallback.as_ref().filter(|folder| !folder.exists())?;
    let above = existing(fallback).display();
    Some(format!(
        "the fallback {} does not exist: it is created on the disk of {above} when it is needed",
        fallback.display()
    ))
}

/// Notes that nothing is recorded until a command starts the recording.
fn of_pause(bag: &Bag) -> Option<String> {
    let how = "start it with Ctrl-P, on the dashboard or with the command `start_recording`";
    bag.start_paused.then(|| format!("the recording is paused: {how}"))
}

/// Notes that a recording needs more free space to start than the study keeps free.
fn of_room(bag: &Bag) -> Option<String> {
    let (asked, least) = (bag.keep_free_mib, LEAST_DISK >> 20);
    (asked < least).then(|| {
        format!(
            "keep_free_mib = {asked} applies only during a recording: none starts with less than {least} MiB free"
        )
    })
}

/// Notes patterns in a study, under `publish` and in workers, that match neither a received stream nor one computed
/// from it.
pub fn matching_nothing(
    publish: &[Pattern],
    workers: &[Pattern],
    heard: &[&Stream],
) -> Vec<String> {
    let names: Vec<&str> = heard.iter().map(|stream| stream.name.as_str()).collect();
    let mut idle = publishing_nothing(publish, &names);
    idle.extend(looking_at_nothing(workers, &names));
    idle
}

/// Notes alerts that watch neither a received stream nor one computed from it.
pub fn alerting_of_nothing(
    alerts: &[Threshold],
    heard: &[&Stream],
    computed: &[Arc<Stream>],
) -> Vec<String> {
    let names: Vec<&str> = heard.iter().map(|stream| stream.name.as_str()).collect();
    let all = || heard.iter().copied().chain(computed.iter().map(|stream| &**stream));
    let words = |alert: &Threshold| {
        let pattern = alert.stream.text();
        let exact: Vec<&Stream> = all().filter(|each| alert.stream.matches(&each.name)).collect();
        if exact.is_empty() {
            return watching_none(alert, &names, computed);
        }
        let watched = exact.iter().filter(|each| each.window != Some(Window::Phases));
        let watched: Vec<&&Stream> = watched.collect();
        if watched.is_empty() {
            return Some(format!("the alert on `{pattern}` watches nothing: {OF_PHASES}"));
        }
        let channels = watched.iter().flat_map(|stream| &stream.channels);
        let own: BTreeSet<&str> = channels.map(|channel| channel.name.as_str()).collect();
        let own = listed(&own);
        let lacks = watched.iter().all(|stream| alert.place_in(stream).is_none());
        lacks.then(|| match &alert.channel {
            Some(channel) => {
                format!(
                    "the alert on `{pattern}` finds no channel `{channel}`: the stream has {own}"
                )
            }
            None => format!("the alert on `{pattern}` names no channel: the stream has {own}"),
        })
    };
    alerts.iter().filter_map(words).collect()
}

/// Lists the first of these names, and counts the others.
fn listed(names: &BTreeSet<&str>) -> String {
    let shown: Vec<&str> = names.iter().copied().take(NAMES).collect();
    let shown = shown.join(", ");
    match names.len().saturating_sub(NAMES) {
        0 if names.is_empty() => "no numbers".into(),
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Notes an alert whose pattern matches no stream.
fn watching_none(alert: &Threshold, heard: &[&str], computed: &[Arc<Stream>]) -> Option<String> {
    let pattern = alert.stream.text();
    if !names_something(&alert.stream, heard) {
        return Some(format!("the pattern `{pattern}` of an alert matches no received stream"));
    }
    let is_always_there = is_of_team(&alert.stream);
    let below = |stream: &&Arc<Stream>| {
        let mut inputs = heard.iter().filter(|name| stream.name.starts_with(**name));
        inputs.any(|name| alert.stream.may_match_below(name))
    };
    let is_computed = computed.iter().any(|stream| below(&stream));
    (is_computed && !is_always_there).then(|| {
        format!(
            "the pattern `{pattern}` of an alert matches no stream that is received or computed"
        )
    })
}

fn publishing_nothing(publish: &[Pattern], heard: &[&str]) -> Vec<String> {
    let idle = publish.iter().filter(|pattern| !names_something(pattern, heard));
    idle.map(|pattern| format!("publish `{}` matches no received stream", pattern.text())).collect()
}

fn looking_at_nothing(workers: &[Pattern], heard: &[&str]) -> Vec<String> {
    let idle = workers.iter().filter(|pattern| !names_something(pattern, heard));
    idle.map(|pattern| {
        format!("the pattern `{}` of a worker matches no received stream", pattern.text())
    })
    .collect()
}

/// Whether a pattern may match a stream that was received, is computed from one, or always exists.
fn names_something(pattern: &Pattern, heard: &[&str]) -> bool {
    is_of_team(pattern) || heard.iter().any(|name| pattern.may_match_below(name))
}

/// Whether a pattern names streams that always exist.
fn is_of_team(pattern: &Pattern) -> bool {
    [TEAM, OURS].iter().any(|room| pattern.text().starts_with(room))
}

/// Notes that phases must be started manually.
fn of_hand(phases: &[Phase]) -> Option<String> {
    let first = phases.iter().find(|phase| phase.from_secs.is_none())?;
    Some(format!(
        "the phase `{}` has no from_secs: start it with Ctrl-N, or with an event on /session/events",
        first.name
    ))
}

/// Notes that phases with times start in a different order than listed.
fn of_order(phases: &[Phase]) -> Option<String> {
    let starts: Option<Vec<f64>> = phases.iter().map(|phase| phase.from_secs).collect();
    let mut ordered: Vec<(f64, &Phase)> = starts?.into_iter().zip(phases).collect();
    if ordered.is_sorted_by_key(|(from_secs, _)| *from_secs) {
        return None;
    }
    ordered.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let names: Vec<String> = ordered.iter().map(|(_, phase)| format!("`{}`", phase.name)).collect();
    Some(format!("phases start in the order of their times, not as listed: {}", names.join(", ")))
}

/// Notes that nothing is compared with a baseline if no phase has that name.
fn of_phases(phases: &[Phase]) -> Option<String> {
    let is_meant = |phase: &&Phase| phase.name.trim().eq_ignore_ascii_case(BASELINE);
    if phases.iter().any(|phase| phase.name == BASELINE) {
        None
    } else if let Some(phase) = phases.iter().find(is_meant) {
        Some(format!("the phase `{}` is not a baseline: name it `{BASELINE}`", phase.name))
    } else if phases.is_empty() {
        Some(format!(
            "there are no phases: people are compared with their baseline only after a phase `{BASELINE}` on /session/events"
        ))
    } else {
        Some(format!("no phase is named `{BASELINE}`: nothing is compared with a baseline"))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use teampulse_core::stream::{Shape, Subject};
    use teampulse_sinks::PASSED_ON;

    use super::*;

    const PEOPLE: &str = "[[sources]]\ntype = \"people\"\n[[sinks]]\ntype = \"bag\"\n";

    fn notes(text: &str) -> String {
        let study = Study::parse(Path::new("study.toml"), text.to_owned()).unwrap();
        of_study(&study).join("\n")
    }

    fn phase(name: &str) -> String {
        format!("{PEOPLE}[[phases]]\nname = \"{name}\"\nfrom_secs = 0\n")
    }

    #[test]
    fn a_study_that_stores_nothing_is_reported() {
        assert_eq!(notes(""), "no sink stores data: nothing is recorded");
        assert_eq!(notes("[[sinks]]\ntype = \"bag\"\n"), "");
    }

    #[test]
    fn phases_that_begin_in_another_order_than_listed_are_reported() {
        let phases = |[first, second]: [u32; 2]| {
            let phase = |name, secs| format!("[[phases]]\nname = \"{name}\"\nfrom_secs = {secs}\n");
            let bag = "[[sinks]]\ntype = \"bag\"\n";
            notes(&[bag, &phase("baseline", first), &phase("task", second)].concat())
        };
        assert_eq!(phases([0, 60]), "");
        assert_eq!(
            phases([60, 0]),
            "phases start in the order of their times, not as listed: `task`, `baseline`"
        );
    }

    #[test]
    fn robots_of_two_sources_are_reported_where_the_wider_is_listed_first() {
        let of = |namespaces: &[&str]| {
            let source = |namespace| {
                format!("[[sources]]\ntype = \"robots\"\nnamespace = \"{namespace}\"\n")
            };
            let sources: String = namespaces.iter().map(source).collect();
            notes(&format!("{sources}[[sinks]]\ntype = \"bag\"\n"))
        };
        assert_eq!(of(&["/robot1", "/robot*"]), "");
        assert_eq!(of(&["/robot*", "/arm*"]), "");
        let wide = of(&["/robot*", "/robot1"]);
        assert!(
            wide.starts_with("the robots of /robot1 are also those of /robot*, which"),
            "{wide}"
        );
        assert!(of(&["/robot*", "/robot*"]).starts_with("two sources read the robots of /robot*"));
    }

    #[test]
    fn a_study_that_only_passes_data_on_records_nothing() {
        let nothing = "no sink stores data: nothing is recorded";
        for kind in PASSED_ON {
            assert!(notes(&format!("[[sinks]]\ntype = \"{kind}\"\n")).contains(nothing), "{kind}");
        }
        assert!(!notes("[[sinks]]\ntype = \"bag\"\n").contains(nothing));
    }

    #[test]
    fn a_key_for_a_component_that_the_study_lacks_is_reported() {
        let study =
            "[[sinks]]\ntype = \"bag\"\n[keys]\nb = \"do nback start 2\"\nl = \"mark lost\"\n";
        let note =
            "the key `b` sends a request to `nback`, which no component of the study accepts";
        assert_eq!(notes(study), note);
        let worker = "[[workers]]\ntype = \"program\"\nname = \"nback\"\ncommand = [\"nback\"]\n";
        assert_eq!(notes(&format!("{worker}{study}")), "");
    }

    #[test]
    fn a_fallback_that_does_not_exist_is_reported() {
        let with = |folder| notes(&format!("[[sinks]]\ntype = \"bag\"\nfallback = \"{folder}\"\n"));
        assert_eq!(with("/"), "");
        let note = "the fallback /no/where does not exist: it is created on the disk of / when it is needed";
        assert_eq!(with("/no/where"), note);
    }

    #[test]
    fn a_limit_of_free_space_below_the_least_is_reported() {
        let keeping =
            |mib: u32| notes(&format!("[[sinks]]\ntype = \"bag\"\nkeep_free_mib = {mib}\n"));
        assert_eq!(keeping(64), "");
        assert!(keeping(10).starts_with(
            "keep_free_mib = 10 applies only during a recording: none starts with less than 64"
        ));
    }

    #[test]
    fn a_pattern_that_publishes_nothing_is_named() {
        let heard = ["/robot1/odom", "/humans/persons/p001/h10/ecg"];
        let idle = |text: &str| {
            let pattern = Pattern::parse(text).expect("a pattern");
            !publishing_nothing(&[pattern], &heard).is_empty()
        };
        for text in ["/robot1/odom", "/robot*/odom/w30", "/robot1/**", "/team/state"] {
            assert!(!idle(text), "{text}");
        }
        for text in ["/humans/persons/p001/h10/ecg/heart/w60", "/humans/persons/*/*/ecg"] {
            assert!(!idle(text), "{text}");
        }
        for text in ["/robot2/odom", "/robot1", "/humans/persons/p002/**", "/odom"] {
            assert!(idle(text), "{text}");
        }
    }

    #[test]
    fn a_worker_without_matching_streams_is_named() {
        let workers = ["/robot1/odom", "/robot2/odom", "/team/state"]
            .map(|pattern| Pattern::parse(pattern).unwrap());
        assert_eq!(
            looking_at_nothing(&workers, &["/robot1/odom"]),
            ["the pattern `/robot2/odom` of a worker matches no received stream"]
        );
    }

    #[test]
    fn an_alert_that_watches_nothing_is_named() {
        let arm = Stream::raw("/r1/arm", Subject::robot("r1"), Shape::Sample)
            .with_channels(&[("effort", "N m"), ("speed", "1/s")]);
        let statistics = |window: Window| {
            let stream = Stream::derived(&arm, "statistics", Shape::Feature);
            Arc::new(
                stream.over(window).with_channels(&[("effort_mean", "N m"), ("effort_sd", "N m")]),
            )
        };
        let computed = [statistics(Window::of_secs(30.0)), statistics(Window::Phases)];
        let idle = |settings: &str| {
            let alert: Threshold = toml::from_str(&format!("above = 1\n{settings}")).unwrap();
            alerting_of_nothing(&[alert], &[&arm], &computed).join("")
        };
        assert_eq!(idle("stream = \"/r1/arm\"\nchannel = \"speed\""), "");
        assert_eq!(idle("stream = \"/r1/arm/statistics/w30\"\nchannel = \"effort_mean\""), "");
        let no_window = "the pattern `/r1/arm/statistics/w60` of an alert matches no stream that is received or computed";
        let w60 = "stream = \"/r1/arm/statistics/w60\"\nchannel = \"effort_mean\"";
        assert_eq!(idle(w60), no_window);
        assert!(idle("stream = \"/*/arm/statistcs/w30\"").ends_with("received or computed"));
        let mean = "stream = \"/r1/arm/statistics/w30\"\nchannel = \"effort_Mean\"";
        assert_eq!(
            idle(mean),
            "the alert on `/r1/arm/statistics/w30` finds no channel `effort_Mean`: the stream has effort_mean, effort_sd"
        );
        let phases = idle("stream = \"/r1/arm/statistics/phases\"\nchannel = \"effort_mean\"");
        assert!(phases.ends_with("values over phases come only once per phase"), "{phases}");
        assert_eq!(idle("stream = \"/team/state\"\nchannel = \"people\""), "");
        let no_stream = "the pattern `/r2/arm` of an alert matches no received stream";
        assert_eq!(idle("stream = \"/r2/arm\""), no_stream);
        let no_number =
            "the alert on `/r1/arm` finds no channel `power`: the stream has effort, speed";
        assert_eq!(idle("stream = \"/r1/arm\"\nchannel = \"power\""), no_number);
        let which = "the alert on `/r1/arm` names no channel: the stream has effort, speed";
        assert_eq!(idle("stream = \"/r1/arm\""), which);
    }

    #[test]
    fn a_phase_without_a_start_is_reported() {
        let study = format!("{PEOPLE}[[phases]]\nname = \"baseline\"\nlasts_secs = 60\n");
        assert!(notes(&study).starts_with("the phase `baseline` has no from_secs: start it with"));
    }

    #[test]
    fn a_missing_baseline_is_reported_where_people_are_recorded() {
        assert_eq!(notes(&phase("baseline")), "");
        assert!(notes(&phase("Baseline")).contains("name it `baseline`"));
        assert!(notes(&phase("rest")).contains("no phase is named `baseline`"));
        assert!(notes(PEOPLE).contains("no phases"));
        assert_eq!(
            notes("[[sinks]]\ntype = \"bag\"\n[[phases]]\nname = \"x\"\nfrom_secs = 0\n"),
            ""
        );
    }
}
