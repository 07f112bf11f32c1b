use super::control::Kind;
use crate::devices::Wearer;

/// The length of the spans in which pulses are detected, and the time from the start to the first report \[s\] (Polar's
/// pages on the Verity Sense and OH1; issue 535).
const SPAN_SECS: f64 = 5.0;
const FIRST_SECS: f64 = 25.0;
/// The delay from a heartbeat to its pulse at the arm \[s\].
const ARRIVAL_SECS: f64 = 0.2;
/// The longest interval between pulses \[s\].
const LONGEST_SECS: f64 = 2.5;
/// The error estimate reported with an interval, at rest and while the arm moves \[ms\]: issue 311 shows 4 to 10 at
/// rest.
const ERROR_MS: u16 = 6;
const MOVING_ERROR_MS: u16 = 200;
/// Flags: the arm moves; the sensor touches the skin; contact is detected.
const MOVING: u8 = 1;
const CONTACT: u8 = 6;

/// The intervals between pulses, while they are measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulses {
    due_secs: f64,
}

impl Pulses {
    pub fn new(began_secs: f64) -> Self {
        Self { due_secs: began_secs + FIRST_SECS }
    }

    pub fn due_secs(self) -> f64 {
        self.due_secs
    }

    /// Returns the frame of the span that has ended, without a time (issue 484); `None` if there are no pulses.
    pub fn frame(&mut self, wearer: Option<&mut dyn Wearer>, is_moving: bool) -> Option<Vec<u8>> {
        let until_secs = self.due_secs - ARRIVAL_SECS;
        self.due_secs += SPAN_SECS;
        let from_secs = until_secs - SPAN_SECS;
        let beats = wearer?.beats(from_secs - LONGEST_SECS, until_secs);
        let mut frame = vec![Kind::Intervals as u8];
        frame.extend([0; 9]);
        for pair in beats.windows(2).filter(|pair| pair[1] > from_secs) {
            let interval_secs = pair[1] - pair[0];
            frame.push((60.0 / interval_secs).round().clamp(0.0, 255.0) as u8);
            frame.extend(((interval_secs * 1e3).round() as u16).to_le_bytes());
            let error_ms = if is_moving { MOVING_ERROR_MS } else { ERROR_MS };
            frame.extend(error_ms.to_le_bytes());
            frame.push(if is_moving { CONTACT | MOVING } else { CONTACT });
        }
        (frame.len() > 10).then_some(frame)
    }
}
