//! Patterns of names: a `*` stands for any part of one token.

use serde::{Deserialize, Deserializer, de::Error};

/// A pattern of ROS names, token by token: `/robot*`, `/fleet/*/odom`. A `*` stands for any
/// characters but `/`; `**` as the last token stands for any number of tokens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    text: String,
}

impl Pattern {
    /// Parses a pattern, which must begin with a slash.
    pub fn parse(text: &str) -> Result<Pattern, String> {
        if text.starts_with('/') && !text.contains("//") {
            Ok(Pattern { text: text.trim_end_matches('/').to_owned() })
        } else {
            Err(format!("`{text}` is not a pattern of ROS names: expected one like `/robot*`"))
        }
    }

    /// The pattern as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether the whole name matches.
    pub fn matches(&self, name: &str) -> bool {
        self.split(name).is_some_and(|(_, rest)| rest.is_empty())
    }

    /// Whether a name, or one below it, may match: `/r*/odom/w30` may match below `/r1/odom`.
    pub fn may_match_below(&self, name: &str) -> bool {
        let mut tokens = self.text.split('/').skip(1);
        for found in name.split('/').skip(1) {
            match tokens.next() {
                Some("**") => return true,
                Some(token) if wildcard(token.as_bytes(), found.as_bytes()) => {}
                _ => return false,
            }
        }
        true
    }

    /// Whether the first token has no star.
    pub fn is_rooted(&self) -> bool {
        self.text.split('/').nth(1).is_some_and(|first| !first.contains('*'))
    }

    /// Splits a name into the part that matches the pattern and the rest below it, without the
    /// slash between them; `None` when it does not begin with the pattern.
    pub fn split<'a>(&self, name: &'a str) -> Option<(&'a str, &'a str)> {
        let mut end = 0;
        for token in self.text.split('/').skip(1) {
            let rest = name[end..].strip_prefix('/')?;
            if token == "**" {
                return Some((name, ""));
            }
            let found = rest.split('/').next().unwrap_or_default();
            if !wildcard(token.as_bytes(), found.as_bytes()) {
                return None;
            }
            end += 1 + found.len();
        }
        Some((&name[..end], name[end..].strip_prefix('/').unwrap_or(&name[end..])))
    }

    /// Splits a name, with the pattern as the namespace of a subject, into the subject's id and the rest below it: the
    /// id is what the first star matched, else the last token of the namespace.
    pub fn subject<'a>(&self, name: &'a str) -> Option<(&'a str, &'a str)> {
        let (namespace, rest) = self.split(name)?;
        Some((self.starred(namespace).unwrap_or(last_token(namespace)), rest))
    }

    /// The token of `name` that the first token with a star matched: `robot1` for `/robot*`.
    pub fn starred<'a>(&self, name: &'a str) -> Option<&'a str> {
        let tokens = self.text.split('/').zip(name.split('/'));
        tokens.skip(1).find(|(token, _)| token.contains('*')).map(|(_, found)| found)
    }
}

/// The last token of a name: `odom` of `/r1/base/odom`.
pub fn last_token(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

impl<'de> Deserialize<'de> for Pattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Pattern, D::Error> {
        Pattern::parse(&String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

impl schemars::JsonSchema for Pattern {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Pattern".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "pattern": "^/" })
    }
}

/// Whether a token matches a pattern in which `*` stands for any characters. Takes time at most proportional to the
/// product of both lengths.
fn wildcard(pattern: &[u8], token: &[u8]) -> bool {
    let (mut at, mut from) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while from < token.len() {
        if pattern.get(at) == Some(&b'*') {
            star = Some((at, from));
            at += 1;
        } else if pattern.get(at) == Some(&token[from]) {
            at += 1;
            from += 1;
        } else if let Some((star_at, star_from)) = star {
            star = Some((star_at, star_from + 1));
            at = star_at + 1;
            from = star_from + 1;
        } else {
            return false;
        }
    }
    pattern[at..].iter().all(|&byte| byte == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(text: &str) -> Pattern {
        Pattern::parse(text).expect("a pattern")
    }

    #[test]
    fn a_star_stands_for_a_part_of_one_token() {
        for (text, name, matched) in [
            ("/robot*", "/robot1", true),
            ("/robot*", "/robot1/odom", false),
            ("/robot*", "/rob", false),
            ("/*/odom", "/r5/odom", true),
            ("/*a*b", "/xaybzb", true),
            ("/*a*b", "/xaybz", false),
            ("/**", "/any/depth/at/all", true),
            ("/odom", "/odom", true),
            ("/r1/lo*d*x", "/r1/load", false),
            ("/r1/load/**", "/r1/load", false),
        ] {
            assert_eq!(pattern(text).matches(name), matched, "{text} on {name}");
        }
    }

    #[test]
    fn a_name_splits_into_its_robot_and_the_rest() {
        let fleet = pattern("/fleet/r*");
        assert_eq!(fleet.split("/fleet/r2/base/odom"), Some(("/fleet/r2", "base/odom")));
        assert_eq!(fleet.starred("/fleet/r2/base/odom"), Some("r2"));
        assert_eq!(fleet.subject("/fleet/r2/base/odom"), Some(("r2", "base/odom")));
        assert_eq!(pattern("/fleet/r2").subject("/fleet/r2/odom"), Some(("r2", "odom")));
        assert_eq!(fleet.split("/other/r2/odom"), None);
        assert_eq!(fleet.split("/fleet"), None);
    }

    #[test]
    fn a_pattern_may_match_below_a_name() {
        for (text, may_match) in
            [("/r*/odom", true), ("/r1/odom/w30", true), ("/r1/**", true), ("/r1", false)]
        {
            assert_eq!(pattern(text).may_match_below("/r1/odom"), may_match, "{text}");
        }
        assert!(!pattern("/r2/odom/w30").may_match_below("/r1/odom"));
    }

    #[test]
    fn a_pattern_without_its_slash_is_refused() {
        assert!(Pattern::parse("robot*").is_err());
    }
}
