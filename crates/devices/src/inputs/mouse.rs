use super::seconds::Tally;
use super::{Act, Which};

/// The same button pressed again within this time is a double click \[s\].
pub const DOUBLE_SECS: f64 = 0.5;
const DOUBLE_NS: i64 = (DOUBLE_SECS * 1e9) as i64;
/// Movements farther apart than this count as separate \[ns\].
const STILL_NS: i64 = 100_000_000;

pub(super) const CHANNELS: [(&str, &str); 6] = [
    ("path", "1"),
    ("clicks", "1"),
    ("double_clicks", "1"),
    ("wheel", "1"),
    ("moving", "s"),
    ("idle", "s"),
];

/// The activity at mice.
#[derive(Default)]
pub(super) struct Mouse {
    path: f64,
    clicks: u32,
    double_clicks: u32,
    wheel: f64,
    moving_ns: i64,
    last_move_ns: Option<i64>,
    /// The last click that is not the second of a double click.
    last_click: Option<(Which, i64)>,
}

impl Tally for Mouse {
    fn take(&mut self, at_ns: i64, act: &Act) {
        match act {
            Act::Move(path) => self.shift(at_ns, *path),
            Act::Click(which) => self.click(at_ns, *which),
            Act::Wheel(steps) => self.wheel += steps.abs(),
            _ => {}
        }
    }

    fn close(&mut self, _: i64, _: i64) -> Vec<f64> {
        let Mouse { path, clicks, double_clicks, wheel, moving_ns, last_move_ns, last_click } =
            std::mem::take(self);
        *self = Mouse { last_move_ns, last_click, ..Mouse::default() };
        let moving_secs = (moving_ns as f64 / 1e9).min(1.0);
        vec![path, clicks.into(), double_clicks.into(), wheel, moving_secs]
    }
}

impl Mouse {
    fn shift(&mut self, at_ns: i64, path: f64) {
        self.path += path.abs();
        let before_ns = self.last_move_ns.replace(at_ns);
        let since_ns = before_ns.map(|before_ns| at_ns.saturating_sub(before_ns));
        self.moving_ns += since_ns.filter(|ns| (0..=STILL_NS).contains(ns)).unwrap_or(0);
    }

    fn click(&mut self, at_ns: i64, which: Which) {
        self.clicks += 1;
        let is_second = self.last_click.is_some_and(|(before, before_ns)| {
            before == which && (0..=DOUBLE_NS).contains(&at_ns.saturating_sub(before_ns))
        });
        self.double_clicks += u32::from(is_second);
        self.last_click = (!is_second).then_some((which, at_ns));
    }
}
