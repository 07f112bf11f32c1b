//! Every feature is in the table, is documented, and has an example that builds.

#[path = "../../core/tests/rows/mod.rs"]
mod rows;

use std::fs;
use std::path::Path;

use teampulse_core::registry::Settings;
use teampulse_features::FEATURES;
use teampulse_features::analyses::ANALYSES;
use teampulse_features::context::FeatureContext;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const NOTHING: [String; 0] = [];

/// The folders whose files are features.
const FOLDERS: [&str; 4] = ["any", "robots", "people", "team"];

/// The names of the files in a folder of features, without their ending.
fn feature_files(folder: &str) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder);
    let entries = fs::read_dir(folder).expect("a readable folder");
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    let files = paths.filter(|path| path.extension().is_some_and(|extension| extension == "rs"));
    files.map(|path| path.file_stem().expect("a file").to_string_lossy().into_owned()).collect()
}

fn settings(text: &str) -> Settings<'_> {
    let table = DeTable::parse(text).expect("an example in TOML");
    Settings::new(Spanned::new(table.span(), DeValue::Table(table.into_inner())))
}

#[test]
fn every_feature_is_in_the_table() {
    assert_eq!(rows::missing(env!("CARGO_MANIFEST_DIR"), "Feature"), NOTHING);
}

#[test]
fn every_file_of_a_room_is_a_feature_of_its_name() {
    for folder in FOLDERS {
        for file in feature_files(folder) {
            let is_in_table = FEATURES.iter().any(|entry| entry.kind == file);
            assert!(is_in_table, "src/{folder}/{file}.rs is the feature of no row of the table");
        }
    }
}

#[test]
fn every_analysis_of_people_is_a_feature() {
    for analysis in ANALYSES {
        let name = analysis.feature.map(|feature| feature.name);
        let is_in_table = |name| FEATURES.iter().any(|entry| entry.kind == name);
        assert!(name.is_none_or(is_in_table), "{name:?} is in no row of FEATURES");
    }
}

#[test]
fn every_setting_is_documented() {
    let lacking: Vec<String> = FEATURES.iter().flat_map(rows::undocumented).collect();
    assert_eq!(lacking, NOTHING);
}

#[test]
fn every_example_builds() {
    let context = FeatureContext::default();
    let broken = FEATURES.iter().filter_map(|entry| rows::broken_example(entry, &context));
    assert_eq!(broken.collect::<Vec<_>>(), NOTHING);
}

#[test]
fn every_feature_builds_without_settings() {
    for entry in FEATURES {
        assert!((entry.build)(settings(""), &FeatureContext::default()).is_ok(), "{}", entry.kind);
    }
}

#[test]
fn an_unknown_setting_is_refused() {
    for entry in FEATURES {
        let built = (entry.build)(settings("no_such_setting = 1"), &FeatureContext::default());
        assert!(built.is_err(), "{}", entry.kind);
    }
}

#[test]
fn every_feature_documents_what_the_template_asks() {
    for entry in FEATURES {
        let schema = (entry.schema)();
        let text = schema.get("description").and_then(|text| text.as_str()).unwrap_or_default();
        assert!(!entry.summary().is_empty(), "{}", entry.kind);
        for part in ["Measures:", "Formula:", "Unit:", "Window:", "Reference:", "Limits:"] {
            assert!(text.contains(part), "{} does not say its {part}", entry.kind);
        }
    }
}
