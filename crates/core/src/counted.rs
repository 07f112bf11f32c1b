//! Counts in messages.

use std::fmt::Display;

/// Formats a count with its noun, and with its verb where that differs, too: `1 row is missing`, `2 rows are missing`.
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(
    count: N,
    one: &str,
    several: &str,
) -> String {
    format!("{count} {}", if count == N::from(1) { one } else { several })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_thing_is_singular() {
        let shown = |count: u64| counted(count, "person is", "people are");
        assert_eq!([0, 1, 2].map(shown), ["0 people are", "1 person is", "2 people are"]);
    }
}
