//! Every feature stands in the table, is documented, and has an example that builds.

use std::fs;
use std::path::{Path, PathBuf};

use teampulse_core::registry::Settings;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The folders whose files are features.
const FOLDERS: [&str; 4] = ["any", "robots", "people", "team"];

fn feature_files() -> Vec<PathBuf> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let folders = FOLDERS.iter().map(|folder| source.join(folder)).filter(|folder| folder.is_dir());
    let entries = folders.flat_map(|folder| fs::read_dir(folder).expect("a readable folder"));
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "rs")).collect()
}

fn settings(text: &str) -> Settings<'_> {
    let table = DeTable::parse(text).expect("an example in TOML");
    Settings::new(Spanned::new(table.span(), DeValue::Table(table.into_inner())))
}

#[test]
fn every_file_stands_in_the_table() {
    let mut files: Vec<String> = feature_files()
        .iter()
        .map(|path| path.file_stem().expect("a file").to_string_lossy().into_owned())
        .collect();
    let mut kinds: Vec<String> = FEATURES.iter().map(|entry| entry.kind.to_owned()).collect();
    files.sort();
    kinds.sort();
    assert_eq!(files, kinds);
}

#[test]
fn every_example_builds() {
    for entry in FEATURES {
        let built = (entry.build)(settings(entry.example), &FeatureContext::default());
        assert!(built.is_ok(), "{}: {:?}", entry.kind, built.err());
    }
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
