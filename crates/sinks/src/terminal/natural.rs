//! Natural sort order: `robot2` before `robot10`.

use std::cmp::Ordering;

/// Compares two names, in which numbers are compared by value.
pub(super) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while let (Some(x), Some(y)) = (left.chars().next(), right.chars().next()) {
        if x.is_ascii_digit() && y.is_ascii_digit() {
            let (one, rest) = number(left);
            let (other, other_rest) = number(right);
            let order = one.len().cmp(&other.len()).then_with(|| one.cmp(other));
            if order.is_ne() {
                return order;
            }
            (left, right) = (rest, other_rest);
        } else if x == y {
            (left, right) = (&left[x.len_utf8()..], &right[y.len_utf8()..]);
        } else {
            return x.cmp(&y);
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// Splits a text into the number at its start, without leading zeros, and the rest.
fn number(text: &str) -> (&str, &str) {
    let end = text.find(|each: char| !each.is_ascii_digit()).unwrap_or(text.len());
    (text[..end].trim_start_matches('0'), &text[end..])
}

/// A name in natural order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Name(pub String);

impl Ord for Name {
    fn cmp(&self, other: &Name) -> Ordering {
        natural(&self.0, &other.0)
    }
}

impl PartialOrd for Name {
    fn partial_cmp(&self, other: &Name) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_in_which_people_count() {
        let mut names = ["robot10", "robot2", "robot1", "r3/arm", "robot02", "robot", "r20", "é1"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(
            names,
            ["r3/arm", "r20", "robot", "robot1", "robot02", "robot2", "robot10", "é1"]
        );
    }
}
