use crate::analysis::{Reason, Value};

/// The channels of a keyboard's summaries; times in ms, idle time in s.
pub const KEYBOARD: [&str; 9] = [
    "presses",
    "corrections",
    "holds",
    "hold_mean",
    "hold_sd",
    "intervals",
    "interval_mean",
    "interval_sd",
    "idle",
];
/// The channels of a mouse's summaries; the path in counts of the sensor, times in s.
pub const MOUSE: [&str; 6] = ["path", "clicks", "double_clicks", "wheel", "moving", "idle"];
/// The channels of a gamepad's summaries; times in s.
pub const GAMEPAD: [&str; 4] = ["presses", "deflection", "moving", "idle"];

static OF_KEYBOARD: [Value; 7] = [
    Value::new("KEY_Rate", "1/min", "presses over time"),
    Value::new("KEY_HoldMean", "ms", "mean time from press to release, each press once"),
    Value::new(
        "KEY_HoldSD",
        "ms",
        "population SD of these times, pooled from the SDs and means of the summaries",
    ),
    Value::new("KEY_IntervalMean", "ms", "mean time from press to press, without pauses"),
    Value::new("KEY_IntervalSD", "ms", "population SD of these times, pooled in the same way"),
    Value::new("KEY_Corrections", "1", "share of Backspace and Delete among presses"),
    Value::new("KEY_Idle", "1", IDLE),
];
static OF_MOUSE: [Value; 7] = [
    Value::new("MOUSE_Speed", "1/s", "path in sensor counts over the time with movement"),
    Value::new("MOUSE_Moving", "1", "share of time with movement"),
    Value::new("MOUSE_Path", "1/min", "path in sensor counts over time"),
    Value::new("MOUSE_Clicks", "1/min", "buttons pressed over time"),
    Value::new("MOUSE_DoubleClicks", "1/min", "double clicks over time"),
    Value::new("MOUSE_Wheel", "1/min", "steps of the wheel over time"),
    Value::new("MOUSE_Idle", "1", IDLE),
];
static OF_GAMEPAD: [Value; 4] = [
    Value::new("PAD_Rate", "1/min", "buttons pressed over time"),
    Value::new("PAD_Deflection", "1", "mean deflection of the most deflected stick"),
    Value::new("PAD_Moving", "1", "share of time with a stick deflected"),
    Value::new("PAD_Idle", "1", IDLE),
];
const IDLE: &str = "share of seconds without any event";

/// A kind of device, by its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Device {
    Keyboard,
    Mouse,
    Gamepad,
}

/// The summaries of a span.
pub(super) struct Summaries {
    /// The values of each channel.
    pub(super) channels: Vec<Vec<f64>>,
    /// The duration of the known part [s].
    pub(super) secs: f64,
}

/// One summary of a span.
#[derive(Clone, Copy)]
struct Summary<'a> {
    channels: &'a [Vec<f64>],
    place: usize,
}

impl Summaries {
    /// The sum of a function over all summaries.
    fn sum(&self, of: impl Fn(Summary<'_>) -> f64) -> f64 {
        let count = self.channels.first().map_or(0, Vec::len);
        (0..count).map(|place| of(Summary { channels: &self.channels, place })).sum()
    }
}

impl Summary<'_> {
    /// The value of a channel; 0 if the summary lacks it.
    fn get(self, channel: usize) -> f64 {
        let value = self.channels.get(channel).and_then(|values| values.get(self.place));
        value.copied().filter(|value| value.is_finite()).unwrap_or(0.0)
    }
}

impl Device {
    /// The device with these channels.
    pub(super) fn of(channels: &[&str]) -> Option<Device> {
        match channels {
            _ if channels == KEYBOARD => Some(Device::Keyboard),
            _ if channels == MOUSE => Some(Device::Mouse),
            _ if channels == GAMEPAD => Some(Device::Gamepad),
            _ => None,
        }
    }

    pub(super) fn values(self) -> &'static [Value] {
        match self {
            Device::Keyboard => &OF_KEYBOARD,
            Device::Mouse => &OF_MOUSE,
            Device::Gamepad => &OF_GAMEPAD,
        }
    }

    /// The number of channels.
    pub(super) fn width(self) -> usize {
        match self {
            Device::Keyboard => KEYBOARD.len(),
            Device::Mouse => MOUSE.len(),
            Device::Gamepad => GAMEPAD.len(),
        }
    }

    /// The values of a span.
    pub(super) fn measure(self, sums: &Summaries) -> Vec<Result<f64, Reason>> {
        let total = |channel: usize| sums.sum(|second| second.get(channel));
        let per_min = |channel: usize| Ok(total(channel) * 60.0 / sums.secs);
        let share = |channel: usize| Ok(total(channel) / sums.secs);
        let idle = |channel: usize| {
            let is_idle = |second: Summary<'_>| f64::from(u8::from(second.get(channel) >= 1.0));
            Ok(sums.sum(is_idle) / sums.secs)
        };
        match self {
            Device::Keyboard => {
                let ([hold, hold_sd], [interval, interval_sd]) = (pooled(sums, 2), pooled(sums, 5));
                let corrections = ratio(total(1), total(0));
                vec![per_min(0), hold, hold_sd, interval, interval_sd, corrections, idle(8)]
            }
            Device::Mouse => {
                let speed = ratio(total(0), total(4));
                vec![speed, share(4), per_min(0), per_min(1), per_min(2), per_min(3), idle(5)]
            }
            Device::Gamepad => vec![per_min(0), share(1), share(2), idle(3)],
        }
    }
}

/// Mean and population SD of all times, pooled from the count, mean and SD in three channels from `first`
/// on.
fn pooled(sums: &Summaries, first: usize) -> [Result<f64, Reason>; 2] {
    let of_known = |second: Summary<'_>, power: i32| {
        let [count, mean, sd] = [0, 1, 2].map(|place| second.get(first + place));
        match (count > 0.0, power) {
            (false, _) => 0.0,
            (true, 0) => count,
            (true, 1) => count * mean,
            (true, _) => count * (sd * sd + mean * mean),
        }
    };
    let [count, sum, squares] = [0, 1, 2].map(|power| sums.sum(|second| of_known(second, power)));
    let mean = ratio(sum, count);
    let sd = mean.map(|mean| (squares / count - mean * mean).max(0.0).sqrt());
    [mean, sd.and_then(Reason::unless_finite)]
}

/// A quotient; `Short` for a denominator of zero.
fn ratio(sum: f64, count: f64) -> Result<f64, Reason> {
    if count > 0.0 { Reason::unless_finite(sum / count) } else { Err(Reason::Short) }
}
