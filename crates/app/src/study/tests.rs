use std::sync::Arc;

use miette::{GraphicalReportHandler, GraphicalTheme};
use proptest::prelude::*;
use teampulse_core::clock::Clock;
use teampulse_ros::bus::Bus;
use teampulse_ros::buses::Buses;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::{SOURCES, SourceContext};

use super::*;

/// Reads a study and builds its sources, as `run` does.
fn read(text: &str) -> Result<usize, StudyError> {
    let study = Study::parse(Path::new("study.toml"), text.to_owned())?;
    study.check()?;
    let bus: Arc<dyn Bus> = MemoryBus::new("/test");
    let buses = Arc::new(Buses::holding([(0, bus)]));
    let context = SourceContext {
        clock: Clock::settable(),
        buses,
        claims: Claims::default(),
        bluetooth: Bluetooth::default(),
    };
    study.build("sources", SOURCES, &context).map(|sources| sources.len())
}

/// The error as it is shown.
fn shown(text: &str) -> String {
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    let error = read(text).expect_err("the study has a mistake");
    let mut shown = String::new();
    handler.with_width(90).render_report(&mut shown, &error).expect("a string takes all");
    shown
}

#[test]
fn a_ten_line_study_is_enough() {
    let text = "[session]\nname = \"my_team\"\n[[sources]]\ntype = \"robots\"\n\
                namespace = \"/robot*\"\nrequired = [\"battery\"]\n[[sinks]]\ntype = \"bag\"\n";
    assert_eq!(read(text).expect("a study"), 1);
    assert_eq!(read("").expect("an empty study is one of defaults"), 0);
}

#[test]
fn an_alert_that_could_never_be_right_is_shown_at_its_place() {
    insta::assert_snapshot!(shown(
        "[[alerts]]\nstream = \"/a/b\"\nabove = 1\n[[alerts]]\nstream = \"/a/c\"\nabove = 1\nclear = 2\n"
    ));
    insta::assert_snapshot!(shown("[[alerts]]\nstream = \"/a/b\"\n"));
    let disabled =
        "[features]\ndisable = [\"attention\"]\n[[alerts]]\nstream = \"/a/b\"\nabove = 1\n";
    insta::assert_snapshot!(shown(disabled));
}

#[test]
fn faces_that_nothing_hides_or_nobody_names_are_shown_at_their_place() {
    let source = "[[sources]]\ntype = \"robots\"\nimages = [\"front\"]\n";
    let hidden = format!("{source}faces = \"blur\"\n");
    let worker = "[[workers]]\ntype = \"blur\"\ndescriptors = [\"yunet.toml\"]\n";
    insta::assert_snapshot!(shown(&hidden));
    insta::assert_snapshot!(shown(&format!("{source}{worker}")));
    assert_eq!(read(&format!("{hidden}{worker}")).expect("a study"), 1);
}

#[test]
fn a_misspelt_key_is_shown_at_its_place_with_the_right_one() {
    insta::assert_snapshot!(shown("[[sources]]\ntype = \"robots\"\nnamspace = \"/robot*\"\n"), @r#"
     × unknown field `namspace`, expected one of `namespace`, `domain`, `prefix`,
     │ `battery`, `link`, `odometry`, `diagnostics`, `temperature`, `numbers`, `images`,
     │ `faces`, `commands`, `topics`, `required`, `robots`
      ╭─[study.toml:3:1]
    2 │ type = "robots"
    3 │ namspace = "/robot*"
      · ────────
      ╰────
     help: did you mean `namespace`?
    "#);
}

#[test]
fn a_mistyped_value_is_shown_at_its_place() {
    insta::assert_snapshot!(shown("[[sources]]\ntype = \"robots\"\ndomain = \"zero\"\n"), @r#"
     × invalid type: string "zero", expected a ROS domain, such as 12, or a bus as
     │ KIND:ADDRESS (kinds: dds)
      ╭─[study.toml:3:10]
    2 │ type = "robots"
    3 │ domain = "zero"
      ·          ──────
      ╰────
     help: write a ROS domain, such as 12, or a bus as KIND:ADDRESS (kinds: dds)
    "#);
}

#[test]
fn an_unknown_kind_is_shown_with_the_nearest() {
    insta::assert_snapshot!(shown("[[sources]]\ntype = \"robot\"\n"), @r#"
     × there is no `robot` among the sources
      ╭─[study.toml:2:8]
    1 │ [[sources]]
    2 │ type = "robot"
      ·        ───────
      ╰────
     help: did you mean `robots`?
    "#);
}

#[test]
fn phases_that_overlap_are_shown_at_the_later_one() {
    let text = "[[phases]]\nname = \"task\"\nfrom_secs = 50\n\
                [[phases]]\nname = \"baseline\"\nfrom_secs = 0\nto_secs = 60\n";
    insta::assert_snapshot!(shown(text), @r#"
     × the phases `baseline` (from 0 s to 60 s) and `task` (from 50 s) overlap
      ╭─[study.toml:3:13]
    2 │ name = "task"
    3 │ from_secs = 50
      ·             ──
    4 │ [[phases]]
      ╰────
     help: one phase at a time: let the first end before the next begins
    "#);
}

#[test]
fn phases_in_the_wrong_order_are_shown_at_the_one_that_is_too_early() {
    let manual = "[[phases]]\nname = \"pause\"\n";
    let task = "[[phases]]\nname = \"task\"\nfrom_secs = 50\n";
    let baseline = "[[phases]]\nname = \"baseline\"\nfrom_secs = 0\nto_secs = 40\n";
    assert!(
        read(&[task, baseline].concat()).is_ok(),
        "phases with times may be listed in any order"
    );
    assert!(read(&[baseline, manual, task].concat()).is_ok());
    insta::assert_snapshot!(shown(&[task, manual, baseline].concat()), @r#"
     × the phase `baseline` (from 0 s) is listed after `task` (from 50 s)
      ╭─[study.toml:8:13]
    7 │ name = "baseline"
    8 │ from_secs = 0
      ·             ─
    9 │ to_secs = 40
      ╰────
     help: list phases in the order in which they begin: a phase without `from_secs` begins
           after the one before it
    "#);
}

#[test]
fn a_feature_has_a_table_of_its_own() {
    let built = |text: &str| {
        let study = Study::parse(Path::new("study.toml"), text.to_owned())?;
        crate::setup::features(&study).map_err(|error| error.study().expect("of the study"))
    };
    let all = built("").expect("defaults").len();
    let set = "[features]\nwindows_secs = [10]\n[features.state]\nstale_secs = 3\n\
               [features.heart]\nwindows_secs = [300]\n";
    assert_eq!(built(set).expect("settings").len(), all);
    for (text, expected, place) in [
        ("[features.stat]\n", "there is no feature `stat`", "stat"),
        ("[features]\nstate = 3", "`state` is not a table", "3"),
        ("[features.state]\nstale = 3", "unknown field `stale`", "stale"),
        ("[features.state]\nstale_secs = \"a\"", "invalid type", "\"a\""),
        ("[features.state]\nstale_secs = -3", "`stale_secs` of -3 s", "-3"),
        ("[features.heart]\nwindows_secs = [-3]", "a window of -3 s", "[-3]"),
        ("[features]\nwindows_secs = [-3]\n[features.state]", "a window of -3 s", "[-3]"),
        ("[features]\ndisable = [\"state\"]\n[features.state]\nx = 1", "unknown field", "x"),
        ("[features.attention]\nlow_battery = 7", "a share from 0 to 1", "7"),
        ("[features.link_quality]\nweak_dbm = nan", "not a level", "nan"),
        ("[features.link_quality]\nweak_dbm = 75", "75 dBm: expected less than 0", "75"),
        ("[features.heart]\nwindows_secs = [30, 30]", "30 s is listed twice", "[30, 30]"),
        ("[features]\nwindows_secs = [60, 30, 60]", "60 s is listed twice", "[60, 30, 60]"),
    ] {
        let error = built(text).err().expect(text);
        assert!(error.message.contains(expected), "{text}: {}", error.message);
        let (_, span) = *error.place.expect("a place");
        assert_eq!(&text[span], place, "{text}");
    }
}

#[test]
fn every_other_mistake_is_reported_with_its_place() {
    for (text, expected) in [
        ("[session\nname = 1", "unclosed table"),
        ("[session]\nname = 1", "invalid type: integer"),
        ("[sesion]\n", "unknown field `sesion`"),
        ("[session]\nclock = \"sundial\"", "unknown variant `sundial`"),
        ("[session]\nname = \"../x\"", "can't be the name"),
        ("sources = 3", "`sources` is not [[…]]"),
        ("[[sources]]\nnamespace = \"/r*\"", "`type` is missing"),
        ("sources = [3]", "an entry of `sources` is not a table"),
        ("[[sources]]\ntype = \"robots\"\nrequired = [\"wings\"]", "`wings` is not a parameter"),
        ("[[sources]]\ntype = \"robots\"\nnamespace = \"/\"", "need a `prefix`"),
        ("[[sources]]\ntype = \"topics\"\nnames = [\"tf\"]", "not a pattern of ROS names"),
        ("[[sources]]\ntype = \"robots\"\nnamespace = \"r*\"", "not a pattern of ROS names"),
        ("[[sources]]\ntype = \"robots\"\ndomain = 7", "join"),
        ("[[phases]]\nfrom_secs = 0", "`name` is missing"),
        ("[[phases]]\nname = \"\"\nfrom_secs = 0", "a phase has no name"),
    ] {
        let error = read(text).expect_err(text);
        assert!(error.message.contains(expected), "{text}: {}", error.message);
        assert!(error.place.is_some(), "{text}: no place");
    }
}

#[test]
fn every_example_is_a_study() {
    for entry in SOURCES {
        let text = format!("[[sources]]\ntype = \"{}\"\n{}\n", entry.kind, entry.example);
        assert_eq!(read(&text).unwrap_or_else(|error| panic!("{text}: {error}")), 1);
    }
}

/// A value for each kind of text in a study, valid and invalid ones.
fn with_text(text: &str) -> Vec<String> {
    let text = text.replace(['\\', '"', '\n', '\r'], "_");
    let robots = "[[sources]]\ntype = \"robots\"\nnamespace = \"/r*\"\n";
    [
        format!("[session]\nname = \"{text}\""),
        format!("[session]\nclock = \"{text}\""),
        format!("[session]\n\"{text}\" = 3"),
        format!("[\"{text}\"]"),
        format!("{text} = 1"),
        format!("[[sources]]\ntype = \"{text}\""),
        format!("[[sources]]\ntype = \"robots\"\nnamespace = \"{text}\""),
        format!("{robots}required = [\"{text}\"]"),
        format!(
            "{robots}battery = {{ topic = \"{text}\", field = \"{text}\", unit = \"{text}\" }}"
        ),
        format!(
            "{robots}numbers = [{{ topic = \"{text}\", field = \"{text}\", unit = \"{text}\" }}]"
        ),
        format!("[features]\ndisable = [\"{text}\"]"),
        format!("[features.\"{text}\"]\nx = 1"),
        format!(
            "[[phases]]\nname = \"{text}\"\nfrom_secs = 0\n[[phases]]\nname = \"b\"\nfrom_secs = -1"
        ),
        format!("publish = [\"{text}\"]"),
        format!("[clocks.\"{text}\"]\nlatency_secs = \"{text}\""),
        format!("# {text}\n[session]\nname = 1"),
    ]
    .into()
}

#[test]
fn a_mistake_after_the_longest_line_is_shown() {
    for length in [65_534, 65_535, 65_536, 200_000] {
        let text = format!("[session]\nname = \"{}\"\n", "x/".repeat(length));
        let shown = shown(&text);
        assert!(shown.contains("can't be the name") && shown.len() < 20_000);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn no_text_of_a_study_commands_the_terminal_or_is_endless(
        piece in prop::collection::vec(
            prop_oneof![any::<char>(), prop::sample::select(vec!['\u{1b}', '\u{9b}', '\u{202e}', '\t', 'a'])], 1..20,
        ),
    ) {
        let text: String = piece.iter().cycle().take(100_000).collect();
        let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
        for study in with_text(&text) {
            let Err(error) = read(&study) else { continue };
            let mut shown = String::new();
            handler.clone().with_width(90).render_report(&mut shown, &error).expect("a string takes all");
            let unwanted = |each: char| each != '\n' && teampulse_core::text::is_unwanted(each);
            prop_assert!(!shown.contains(unwanted), "{shown:?}");
            prop_assert!(shown.len() < 100_000);
        }
    }
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in ".*") {
        drop(read(&text));
    }

    #[test]
    fn no_study_like_text_makes_it_panic(
        lines in prop::collection::vec("\\[?\\[?[a-z]{0,9}\\]?\\]? ?=? ?[\\[{\"a-z0-9/*.}\\]]{0,9}", 0..9),
    ) {
        drop(read(&lines.join("\n")));
    }
}

#[test]
fn a_misspelt_table_of_sources_has_a_suggestion() {
    for (wrong, meant) in [
        ("[[source]]", "[[sources]]"),
        ("[[sink]]", "[[sinks]]"),
        ("[worker]", "[[workers]]"),
        ("[simulated]", "[simulate]"),
        ("[sesion]", "session"),
    ] {
        let said = shown(&format!("{wrong}\ntype = \"robots\"\n"));
        assert!(said.contains(&format!("did you mean `{meant}`?")), "{said}");
        assert!(said.contains("`[[workers]]`"), "{said}");
    }
}

#[test]
fn an_unknown_command_is_shown_at_its_place() {
    insta::assert_snapshot!(shown("[commands]\nros = [\"mark\", \"nextphase\"]\n"), @r#"
     × there is no command `nextphase`
      ╭─[study.toml:2:16]
    1 │ [commands]
    2 │ ros = ["mark", "nextphase"]
      ·                ───────────
      ╰────
     help: did you mean `next_phase`?
    "#);
    assert!(read("[commands]\nkeys = []\nros = [\"*\"]\nprogram = [\"do nback\"]\n").is_ok());
    let unknown = shown("[commands]\nkees = [\"mark\"]\n");
    assert!(unknown.contains("there is no component `kees` that could send commands"), "{unknown}");
    assert!(unknown.contains("did you mean `keys`?"), "{unknown}");
}

#[test]
fn every_mistake_that_is_often_made_has_a_hint() {
    for (text, message, hint) in [
        (
            "[[sources]]\ntype = \"polar\"",
            "`person` is missing",
            "add a line such as person = \"p001\"",
        ),
        ("[[phases]]\nfrom_secs = 0", "`name` is missing", "add a line `name = …` to this table"),
        ("[session]\nname = 1", "expected a string", "write it in quotes: \"1\""),
        (
            "[features]\nwindows_secs = 30",
            "expected a list",
            "write a list in brackets, as in [\"a\", \"b\"] or [1, 2]",
        ),
        ("[features]\nmains_hz = \"50\"", "expected a number", "write it without quotes: 50"),
        ("session = 3", "expected a table", "write a table, as in { key = value }"),
        (
            "[session]\npublish = []",
            "unknown field `publish`",
            "`publish` belongs to the study as a whole: write it above the first [table]",
        ),
        (
            "[[sinks]]\ntype = \"bag\"\n[session]\nmains_hz = 50",
            "unknown field `mains_hz`",
            "`mains_hz` belongs to [features]",
        ),
        (
            "[session]\nzzz = 1",
            "unknown field `zzz`",
            "remove it; `teampulse schema` lists all settings",
        ),
        ("[session]\nclock = \"sundial\"", "unknown variant", "use one of these words"),
        (
            "[session]\nname = \"a\"\n\nname = \"b\"",
            "`name` is set twice in this table, first in line 2",
            "keep one of the two",
        ),
        (
            "[session]\n[session]",
            "the table `session` is written twice",
            "put the settings of both under one header",
        ),
        (
            "[sources]\n[sources]",
            "the table `sources` is written twice",
            "there may be several, each starting with [[sources]]",
        ),
    ] {
        let error = read(text).expect_err(text);
        assert!(error.message.contains(message), "{text}: {}", error.message);
        assert_eq!(error.hint.as_deref(), Some(hint), "{text}");
        assert!(error.place.is_some(), "{text}: no place");
    }
}

#[test]
fn a_typographic_quote_is_shown_at_its_place() {
    insta::assert_snapshot!(shown("[session]\nname = “my_team”\n"), @r#"
     × “ is a typographic quote, which TOML does not accept
      ╭─[study.toml:2:8]
    1 │ [session]
    2 │ name = “my_team”
      ·        ─
      ╰────
     help: write straight quotes, as in name = "my_team"
    "#);
    for (text, quote) in [("[session]\n“name” = 1", "“"), ("x = ‘a’", "‘"), ("x = \"a„ = [", "")]
    {
        let error = read(text).expect_err(text);
        let is_typographic = error.message.contains("is a typographic quote");
        assert_eq!(is_typographic, !quote.is_empty(), "{text}: {}", error.message);
        let (_, span) = *error.place.expect("a place");
        assert!(!is_typographic || &text[span] == quote, "{text}");
    }
}
