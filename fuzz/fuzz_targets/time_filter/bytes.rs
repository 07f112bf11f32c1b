//! Numbers out of any bytes: mostly such as a session has, some that make no sense.

const START: i64 = 1_700_000_000_000_000_000;
const EDGES: [i64; 8] = [i64::MIN, i64::MIN + 1, -1, 0, 1, START, i64::MAX - 1, i64::MAX];
const STRANGE: [f64; 8] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300, -1e300, 5e-324];

/// The bytes that are left, and the time that they have come to.
pub struct Bytes<'a> {
    left: &'a [u8],
    now: i64,
}

impl<'a> Bytes<'a> {
    pub fn new(left: &'a [u8]) -> Bytes<'a> {
        Bytes { left, now: START }
    }

    pub fn is_over(&self) -> bool {
        self.left.is_empty()
    }

    /// The next byte; 0 after the last.
    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.left.split_first() else { return 0 };
        self.left = rest;
        *first
    }

    /// A number from 0 to below `end`, which is at most 256.
    pub fn below(&mut self, end: usize) -> usize {
        usize::from(self.byte()) % end
    }

    /// One of these.
    pub fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    pub fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// Any number.
    pub fn integer(&mut self) -> i64 {
        i64::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    /// A length of time of any size, mostly short [ns].
    pub fn nanos(&mut self) -> i64 {
        let magnitude = self.below(45);
        i64::from(self.byte()) << magnitude
    }

    /// A time: mostly near the last one, and later [ns].
    pub fn time(&mut self) -> i64 {
        match self.below(32) {
            0 => self.now = self.one_of(&EDGES),
            1 => self.now = self.integer(),
            2 => return self.one_of(&EDGES),
            3 => return self.integer(),
            4..12 => return self.now.saturating_sub(self.nanos()),
            12 => return self.now.saturating_add(self.nanos()),
            _ => self.now = self.now.saturating_add(self.nanos()),
        }
        self.now
    }

    /// A value, a length or a rate.
    pub fn number(&mut self) -> f64 {
        match self.below(8) {
            0 => self.one_of(&STRANGE),
            1 => f64::from_bits(self.integer() as u64),
            2 | 3 => self.nanos() as f64,
            _ => f64::from(self.byte()) / 16.0,
        }
    }
}
