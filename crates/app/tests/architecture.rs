//! ARCHITECTURE.md names functions in the files that contain them.

use std::fs;
use std::path::Path;

#[test]
fn the_ways_through_the_house_are_those_of_the_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("it is there");
    let cells = text.lines().map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
    let steps = cells.filter(|cells| cells.len() > 4 && cells[1].parse::<u32>().is_ok());
    let mut count = 0;
    for cells in steps {
        let (function, file) = (cells[2].trim_matches('`'), cells[3].trim_matches('`'));
        let code = fs::read_to_string(root.join("crates").join(file));
        let code = code.unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(code.contains(&format!("fn {function}(")), "{file} has no function {function}");
        count += 1;
    }
    assert!(count >= 20, "{count} steps");
}
