use crate::gatt::Request;
use crate::outbox::Outbox;
use crate::{Event, Reading};

const CHARACTERISTICS: usize = 4;
const SAMPLES: u64 = 2;
const ELECTRODES: usize = 8;

/// Counts EMG notifications by the order of their characteristics, which take turns.
#[derive(Debug, Default)]
pub(super) struct Emg {
    last: Option<usize>,
    next_index: u64,
}

impl Emg {
    /// Records that the link was lost: the turns start again.
    pub fn lose_link(&mut self, out: &mut Outbox<Request>) {
        if self.last.take().is_some() {
            out.event(Event::Gap { stream: "emg", samples: None });
        }
    }

    /// Handles a notification of the characteristic whose turn it is, or of a later one; returns whether it contained
    /// EMG.
    pub fn receive(&mut self, turn: usize, value: &[u8], out: &mut Outbox<Request>) -> bool {
        if value.len() != SAMPLES as usize * ELECTRODES {
            out.discarded("emg", value.len());
            return false;
        }
        if let Some(last) = self.last {
            let missing = (turn + CHARACTERISTICS - last - 1) % CHARACTERISTICS;
            let lost = missing as u64 * SAMPLES;
            if lost > 0 {
                out.event(Event::Gap { stream: "emg", samples: Some(lost) });
                self.next_index += lost;
            }
        }
        self.last = Some(turn);
        let values = value.iter().map(|byte| f64::from(*byte as i8)).collect();
        out.reading(Reading::untimed("emg", self.next_index, values));
        self.next_index += SAMPLES;
        true
    }
}
