//! Every worker of the table stands in a file of its name, is documented, and says what it is.

use std::path::Path;

use teampulse_workers::WORKERS;

#[test]
fn every_row_has_its_file_and_its_documentation() {
    for entry in WORKERS {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let file = source.join(format!("{}.rs", entry.kind));
        let folder = source.join(entry.kind).join("mod.rs");
        assert!(file.exists() || folder.exists(), "{}: no file of its name", entry.kind);
        assert!(entry.summary().ends_with(['.', ':']), "{}: no first sentence", entry.kind);
    }
}

#[test]
fn every_setting_is_documented() {
    for entry in WORKERS {
        let schema = (entry.schema)().to_value();
        let Some(properties) = schema["properties"].as_object() else { continue };
        for (name, property) in properties {
            let described = property.get("description").is_some();
            assert!(described, "{}: `{name}` is not documented", entry.kind);
        }
    }
}
