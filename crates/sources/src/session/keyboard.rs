//! Decodes a terminal's input into keys.

/// A key that was pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A printable character.
    Char(char),
    /// A letter with Ctrl.
    Control(char),
    /// The up arrow.
    Up,
    /// The down arrow.
    Down,
    /// Page Up.
    PageUp,
    /// Page Down.
    PageDown,
    /// The Home key.
    Home,
    /// The End key.
    End,
    /// Escape, alone.
    Escape,
}

/// Decodes a terminal's bytes into keys, skipping escape sequences that are not keys.
#[derive(Debug, Default)]
pub(super) struct Decoder {
    state: State,
    /// The parameters of a sequence, as far as they are needed.
    parameters: Vec<u8>,
    /// Whether the input is pasted text, which is ignored.
    is_pasted: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Ground,
    /// After an escape.
    Escape,
    /// After an escape that arrived alone.
    Alone,
    /// In a control sequence.
    Sequence,
    /// Before the last byte of a short sequence.
    Last,
    /// Before the last byte of a function key of the Linux console.
    Function,
    /// In a report from the terminal.
    Text,
    /// After an escape within such a report.
    TextEscape,
}

const ESCAPE: u8 = 0x1b;
const BELL: u8 = 0x07;

impl Decoder {
    /// Takes the next byte; returns a key when it is complete.
    pub fn take(&mut self, byte: u8) -> Option<Key> {
        let key = self.step(byte);
        key.filter(|_| !self.is_pasted)
    }

    /// Notes that input has paused: a lone escape was the key itself.
    pub fn pause(&mut self) -> Option<Key> {
        if self.state != State::Escape || self.is_pasted {
            return None;
        }
        self.state = State::Alone;
        Some(Key::Escape)
    }

    fn step(&mut self, byte: u8) -> Option<Key> {
        let (state, key) = match (self.state, byte) {
            (State::Text, BELL) | (State::TextEscape, b'\\') => (State::Ground, None),
            (State::Text, ESCAPE) => (State::TextEscape, None),
            (State::Text | State::TextEscape, _) => (State::Text, None),
            (_, ESCAPE) => (State::Escape, None),
            (State::Escape | State::Alone, b'[') => {
                self.parameters.clear();
                (State::Sequence, None)
            }
            (State::Escape, b'O') => (State::Last, None),
            (State::Escape, b']' | b'P' | b'X' | b'^' | b'_') => (State::Text, None),
            // Alt with a key is ignored, as is the end of a function key.
            (State::Escape | State::Function, _) => (State::Ground, None),
            (State::Ground | State::Alone, byte) => (State::Ground, plain(byte)),
            (State::Last, byte) => (State::Ground, last(byte)),
            // The Linux console sends function keys with a second bracket.
            (State::Sequence, b'[') if self.parameters.is_empty() => (State::Function, None),
            (State::Sequence, 0x20..=0x3f) => {
                if self.parameters.len() < 8 {
                    self.parameters.push(byte);
                }
                (State::Sequence, None)
            }
            (State::Sequence, byte) => (State::Ground, self.sequence(byte)),
        };
        self.state = state;
        key
    }

    fn sequence(&mut self, byte: u8) -> Option<Key> {
        match (byte, self.parameters.as_slice()) {
            (b'~', b"200") => {
                self.is_pasted = true;
                None
            }
            (b'~', b"201") => {
                self.is_pasted = false;
                None
            }
            (b'~', b"5") => Some(Key::PageUp),
            (b'~', b"6") => Some(Key::PageDown),
            (b'~', b"1" | b"7") => Some(Key::Home),
            (b'~', b"4" | b"8") => Some(Key::End),
            (byte, b"") => last(byte),
            _ => None,
        }
    }
}

/// Returns the key of a single byte.
fn plain(byte: u8) -> Option<Key> {
    match byte {
        b' '..=b'~' => Some(Key::Char(char::from(byte))),
        1..=26 => Some(Key::Control(char::from(byte - 1 + b'a'))),
        _ => None,
    }
}

/// Returns the key of a sequence's last byte.
fn last(byte: u8) -> Option<Key> {
    match byte {
        b'A' => Some(Key::Up),
        b'B' => Some(Key::Down),
        b'H' => Some(Key::Home),
        b'F' => Some(Key::End),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(bytes: &[u8]) -> Vec<Key> {
        let mut decoder = Decoder::default();
        bytes.iter().filter_map(|byte| decoder.take(*byte)).collect()
    }

    #[test]
    fn letters_are_keys_and_no_byte_of_a_sequence_is_one() {
        assert_eq!(keys(b"a Z"), [Key::Char('a'), Key::Char(' '), Key::Char('Z')]);
        assert_eq!(keys(b"\x1b[A\x1b[B\x1bOA\x1bOF"), [Key::Up, Key::Down, Key::Up, Key::End]);
        let pages = [Key::PageUp, Key::PageDown, Key::Home, Key::End];
        assert_eq!(keys(b"\x1b[5~\x1b[6~\x1b[1~\x1b[4~"), pages);
        // Function keys, with modifiers, of the Linux console; Alt-a; what a terminal says of itself.
        let others: [&[u8]; 7] = [
            b"\x1bOP",
            b"\x1b[1;5A",
            b"\x1b[15~",
            b"\x1b[[A",
            b"\x1ba",
            b"\x1b]11;rgb:00\x07",
            b"\x1bP1$r0m\x1b\\",
        ];
        for sequence in others {
            assert_eq!(keys(sequence), [], "{sequence:?}");
        }
        assert_eq!(keys("é漢\x7f\r".as_bytes()), [Key::Control('m')]);
        assert_eq!(keys(&[1, 14]), [Key::Control('a'), Key::Control('n')]);
    }

    #[test]
    fn what_is_pasted_was_pressed_by_nobody() {
        assert_eq!(keys(b"\x1b[200~rm -rf q\x1b[201~a"), [Key::Char('a')]);
    }

    #[test]
    fn an_escape_alone_is_a_key_and_the_next_letter_is_none_of_its_own() {
        let mut decoder = Decoder::default();
        assert_eq!([decoder.take(ESCAPE), decoder.pause()], [None, Some(Key::Escape)]);
        assert_eq!(decoder.take(b'a'), Some(Key::Char('a')));
        // A sequence that was torn in two is still one.
        assert_eq!([decoder.take(ESCAPE), decoder.pause()], [None, Some(Key::Escape)]);
        assert_eq!([decoder.take(b'['), decoder.take(b'A')], [None, Some(Key::Up)]);
    }
}
