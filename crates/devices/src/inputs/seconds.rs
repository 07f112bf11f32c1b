use super::gamepad::Gamepad;
use super::keyboard::Keyboard;
use super::mouse::Mouse;
use super::{Act, Kind};

/// The length of a summary \[ns\].
pub(super) const SECOND_NS: i64 = 1_000_000_000;
/// A pause longer than this means that the reader was not running: nothing is known about the time in between \[ns\].
const LONGEST_NS: i64 = 60 * SECOND_NS;

/// The activity at the devices of one kind within one second.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The start of the second \[ns\], which is a whole second of the clock that times the actions.
    pub begin_ns: i64,
    /// The values of the kind's [channels](Kind::channels).
    pub values: Vec<f64>,
}

/// Collects the values for the summaries of one kind of device.
pub(super) trait Tally {
    /// Adds an action.
    fn take(&mut self, at_ns: i64, act: &Act);
    /// Ends a second, and returns its values without the idle time.
    fn close(&mut self, end_ns: i64, idle_ns: i64) -> Vec<f64>;
}

/// Summarizes actions at the devices of one kind, second by second.
///
/// An action that arrives after its second has ended counts in the present one. If actions arrive in order, any calls
/// of [`until`](Self::until) up to the time of the next action give the same summaries.
pub struct Seconds {
    kind: Kind,
    tally: Box<dyn Tally + Send>,
    /// The start of the present second.
    begin_ns: i64,
    /// The time before which some actions may have been missed.
    since_ns: i64,
    /// When the last action happened.
    last_ns: i64,
    ended: Vec<Summary>,
}

impl Seconds {
    /// Starts at a time \[ns\]; the first summary is of the first whole second.
    pub fn new(kind: Kind, now_ns: i64) -> Seconds {
        Seconds {
            kind,
            tally: tally(kind, now_ns),
            begin_ns: second_of(now_ns),
            since_ns: now_ns,
            last_ns: now_ns,
            ended: Vec::new(),
        }
    }

    /// Adds an action at a time \[ns\].
    pub fn take(&mut self, at_ns: i64, act: &Act) {
        self.end_before(at_ns);
        self.tally.take(at_ns, act);
        self.last_ns = self.last_ns.max(at_ns);
    }

    /// Returns the summaries of the seconds that are over at a time \[ns\].
    pub fn until(&mut self, now_ns: i64) -> Vec<Summary> {
        self.end_before(now_ns);
        std::mem::take(&mut self.ended)
    }

    fn end_before(&mut self, now_ns: i64) {
        if now_ns.saturating_sub(self.begin_ns) > LONGEST_NS {
            let ended = std::mem::take(&mut self.ended);
            *self = Seconds { ended, ..Seconds::new(self.kind, now_ns) };
        }
        while now_ns.saturating_sub(self.begin_ns) >= SECOND_NS {
            let (begin_ns, end_ns) = (self.begin_ns, self.begin_ns + SECOND_NS);
            let idle_ns = end_ns.saturating_sub(self.last_ns).max(0);
            let mut values = self.tally.close(end_ns, idle_ns);
            values.push((idle_ns / SECOND_NS) as f64);
            if begin_ns >= self.since_ns {
                self.ended.push(Summary { begin_ns, values });
            }
            self.begin_ns = end_ns;
        }
    }
}

fn tally(kind: Kind, now_ns: i64) -> Box<dyn Tally + Send> {
    match kind {
        Kind::Keyboard => Box::new(Keyboard::default()),
        Kind::Mouse => Box::new(Mouse::default()),
        Kind::Gamepad => Box::new(Gamepad::new(now_ns)),
    }
}

/// Returns the start of the second that contains a time \[ns\].
fn second_of(at_ns: i64) -> i64 {
    at_ns.saturating_sub(at_ns.rem_euclid(SECOND_NS))
}
