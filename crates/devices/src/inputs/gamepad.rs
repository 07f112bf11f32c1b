use super::Act;
use super::seconds::Tally;

/// The largest deflection of a stick that counts as rest, as a share of its range.
pub const DEAD_ZONE: f64 = 0.1;
/// The number of axes that are distinguished; higher axes share the last place.
const AXES: usize = 8;

pub(super) const CHANNELS: [(&str, &str); 4] =
    [("presses", "1"), ("deflection", "1"), ("moving", "s"), ("idle", "s")];

/// The activity at gamepads.
pub(super) struct Gamepad {
    presses: u32,
    deflections: [f64; AXES],
    /// The integral of the deflection over time \[ns\], up to `at_ns`.
    deflected_ns: f64,
    moving_ns: i64,
    begin_ns: i64,
    at_ns: i64,
}

impl Gamepad {
    pub(super) fn new(now_ns: i64) -> Gamepad {
        Gamepad {
            presses: 0,
            deflections: [0.0; AXES],
            deflected_ns: 0.0,
            moving_ns: 0,
            begin_ns: now_ns,
            at_ns: now_ns,
        }
    }

    /// Advances the time with the sticks unchanged.
    fn pass(&mut self, now_ns: i64) {
        let passed_ns = now_ns.saturating_sub(self.at_ns).max(0);
        let farthest = self.deflections.iter().fold(0.0, |most: f64, each| most.max(each.abs()));
        if farthest > DEAD_ZONE {
            self.deflected_ns += farthest * passed_ns as f64;
            self.moving_ns += passed_ns;
        }
        self.at_ns = self.at_ns.max(now_ns);
    }
}

impl Tally for Gamepad {
    fn take(&mut self, at_ns: i64, act: &Act) {
        self.pass(at_ns);
        match act {
            Act::Control => self.presses += 1,
            Act::Stick(axis, deflection) => {
                let place = usize::from(*axis).min(AXES - 1);
                self.deflections[place] = deflection.clamp(-1.0, 1.0);
            }
            Act::Lost(_) => self.deflections = [0.0; AXES],
            _ => {}
        }
    }

    fn close(&mut self, end_ns: i64, _: i64) -> Vec<f64> {
        self.pass(end_ns);
        let length_ns = end_ns.saturating_sub(self.begin_ns).max(1) as f64;
        let values = vec![
            f64::from(self.presses),
            self.deflected_ns / length_ns,
            self.moving_ns as f64 / 1e9,
        ];
        let deflections = self.deflections;
        *self = Gamepad { deflections, ..Gamepad::new(end_ns) };
        values
    }
}
