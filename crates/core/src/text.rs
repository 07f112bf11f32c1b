//! Text from outside, cut and cleaned where it enters.
//!
//! A label, a name or a unit comes from a robot, a bag or a study, and ends up on a terminal, in a table or as the name
//! of a file. So control characters (C0, DEL, C1), line and paragraph separators, and marks that change the direction
//! of writing (which make a text look like a different one) become spaces, and the length is limited. A clean text
//! stays unchanged, so cleaning it twice is harmless.
//!
//! Messages from outside are not text: they are recorded byte for byte.

use std::borrow::Cow;

/// The longest name of a stream, a subject, a device or a type, and the longest channel and unit
/// [characters]. ROS has topics of up to 255.
pub const LONGEST_NAME: usize = 256;

/// The longest label of an event and the longest reason of a status [characters].
pub const LONGEST_LABEL: usize = 1000;

/// The longest documentation of a stream [characters].
pub const LONGEST_PROSE: usize = 8000;

/// The longest part of a stream's method for one channel [characters].
const LONGEST_RECIPE: usize = 600;

/// The longest name of a file without its extension [bytes]; file systems take 255.
const LONGEST_FILE_NAME: usize = 200;

/// The number of hexadecimal digits that keep changed names distinct.
const DIGITS: usize = 8;

/// A clean name of at most `longest` characters. A name that had to be changed ends with `…` and eight
/// digits of its hash, so that different names stay different.
pub fn name(text: String, longest: usize) -> String {
    if is_clean(&text, longest) {
        return text;
    }
    let own = digest(&text);
    let mut kept = on_one_line(&text).into_owned();
    cut(&mut kept, longest.saturating_sub(DIGITS + 1));
    format!("{kept}…{own:08x}")
}

/// A clean text of at most `longest` characters; one that was cut ends with `…`.
pub fn label(text: String, longest: usize) -> String {
    if is_clean(&text, longest) {
        return text;
    }
    let mut kept = on_one_line(&text).into_owned();
    if kept.chars().nth(longest).is_some() {
        cut(&mut kept, longest.saturating_sub(1));
        kept.push('…');
    }
    kept
}

/// The longest method of a stream with this many channels, which states how each channel is computed [characters].
pub fn longest_method(channels: usize) -> usize {
    LONGEST_PROSE + LONGEST_RECIPE * channels
}

/// The file name for a name, without its extension: letters and digits of any script, `_`, `-` and `.`,
/// with `_` for every other character; never starting like a command-line option, never hidden, and not too long
/// for a file system.
pub fn file_name(text: &str) -> String {
    let fits = |each: char| each.is_alphanumeric() || matches!(each, '_' | '-' | '.');
    let mut kept: String = text.chars().map(|each| if fits(each) { each } else { '_' }).collect();
    if kept.is_empty() || kept.starts_with(['.', '-']) {
        kept.insert(0, '_');
    }
    if kept == text && kept.len() <= LONGEST_FILE_NAME {
        return kept;
    }
    while kept.len() > LONGEST_FILE_NAME - DIGITS - 1 {
        kept.pop();
    }
    format!("{kept}_{:08x}", digest(text))
}

/// Replaces each character that does not belong in a line with a space.
pub fn on_one_line(text: &str) -> Cow<'_, str> {
    if text.chars().any(is_unwanted) {
        Cow::Owned(text.replace(is_unwanted, " "))
    } else {
        Cow::Borrowed(text)
    }
}

/// Whether [`label`] and [`name`] leave a text unchanged.
pub fn is_clean(text: &str, longest: usize) -> bool {
    let fits = text.len() <= longest || text.chars().nth(longest).is_none();
    fits && !text.chars().any(is_unwanted)
}

/// Whether a character controls a terminal, breaks a line or changes the direction of writing.
pub fn is_unwanted(each: char) -> bool {
    let turns = matches!(
        each,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    each.is_control() || turns || matches!(each, '\u{2028}' | '\u{2029}')
}

/// Cuts a text to its first `most` characters.
fn cut(text: &mut String, most: usize) {
    if let Some((end, _)) = text.char_indices().nth(most) {
        text.truncate(end);
    }
}

/// FNV-1a, folded: the same on every machine and in every version.
fn digest(text: &str) -> u32 {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325, mix);
    (hash ^ (hash >> 32)) as u32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Any text, often with characters that do not belong in a line.
    fn any_text() -> impl Strategy<Value = String> {
        let odd = prop::sample::select(vec![
            '\u{1b}', '\r', '\n', '\t', '\0', '\u{7f}', '\u{9b}', '\u{202e}', '\u{2066}',
            '\u{200f}', '\u{61c}', '\u{2028}', '…', 'ä', '🫀',
        ]);
        prop::collection::vec(prop_oneof![any::<char>(), odd], 0..80)
            .prop_map(|chars| chars.into_iter().collect())
    }

    #[test]
    fn a_clean_text_stays_unchanged() {
        for text in ["", "/robot1/battery_state", "µS", "n-back: 2", "心拍", "a…b"] {
            assert_eq!(label(text.to_owned(), 100), text);
            assert_eq!(name(text.to_owned(), 100), text);
        }
    }

    #[test]
    fn no_text_commands_a_terminal_breaks_a_line_or_turns_it() {
        let text = "\u{1b}[2Jred\r\nline\ttab\u{9b}5n \u{202e}evil\u{2066}\u{61c}";
        assert_eq!(label(text.to_owned(), 100), " [2Jred  line tab 5n  evil  ");
    }

    #[test]
    fn two_names_stay_two() {
        let long = "/r1/".to_owned() + &"ä".repeat(100_000);
        let (one, other) = (name(long.clone() + "1", LONGEST_NAME), name(long + "2", LONGEST_NAME));
        assert_ne!(one, other);
        assert_eq!(one.chars().count(), LONGEST_NAME);
        assert_ne!(name("/r1\nx".into(), 100), name("/r1\rx".into(), 100));
        assert_eq!(name("/r1\nx".into(), 100), "/r1 x…8eb0b2a2");
    }

    #[test]
    fn a_file_name_suits_shells_and_file_systems() {
        assert_eq!(file_name("robot1__battery_state"), "robot1__battery_state");
        assert!(file_name("-rf").starts_with("_-rf_"));
        assert!(file_name("..").starts_with("_.._"));
        assert!(file_name("").starts_with('_'));
        assert_ne!(file_name("a\nb"), file_name("a\rb"));
    }

    proptest! {
        #[test]
        fn any_text_gives_a_name_of_a_file(text in any_text(), times in prop_oneof![Just(1), Just(500)]) {
            let name = file_name(&text.repeat(times));
            prop_assert!(name.len() <= LONGEST_FILE_NAME && !name.starts_with(['.', '-']));
            prop_assert!(name.chars().all(|each| each.is_alphanumeric() || "_-.".contains(each)), "{name}");
        }

        #[test]
        fn any_text_becomes_short_and_clean_and_then_stays(
            text in any_text(), times in prop_oneof![Just(1usize), Just(2000)], longest in 10usize..300,
        ) {
            let text = text.repeat(times);
            for clean in [name, label] {
                let once = clean(text.clone(), longest);
                prop_assert!(is_clean(&once, longest), "{once:?}");
                prop_assert_eq!(clean(once.clone(), longest), once);
            }
        }
    }
}
