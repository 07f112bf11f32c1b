//! The values of windows of summaries.
//!
//! There are no events. Causal and whole analysis agree, as nothing is filtered. Quality is 1: the input is
//! counts, not measurements.

use super::values::{Device, Summaries};
use crate::analysis::{
    Causal, Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Track, Value, Whole, Windows,
};
use crate::error::{SignalError, checked, checked_rate_hz};

/// The slowest and fastest supported rates of summaries [Hz].
const RATES_HZ: (f64, f64) = (0.01, 100.0);

/// A causal analysis of summaries with these channels, at 0.01 to 100 Hz.
///
/// Returns an error for another rate, and for channels other than those of a keyboard, mouse or gamepad.
pub fn causal(channels: &[&str], rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Running::new(channels, rate_hz)?))
}

/// An analysis of a whole recording. Errors as for [`causal`].
pub fn whole(channels: &[&str], recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut running = Running::new(channels, recording.rate_hz)?;
    let seconds = recording.channels.iter().map(Vec::len).min().unwrap_or(0);
    for second in 0..seconds {
        let values: Vec<f64> = recording.channels.iter().map(|channel| channel[second]).collect();
        running.push(recording.time_ns(second as f64), &values);
    }
    Ok(Whole { events: Vec::new(), windows: Box::new(running) })
}

struct Running {
    device: Device,
    channels: Vec<Track>,
}

impl Running {
    fn new(channels: &[&str], rate_hz: f64) -> Result<Running, SignalError> {
        let rate_hz = checked("the rate of summaries [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
        let lacking = SignalError::Channels {
            lacking: "one of a keyboard, mouse or gamepad, such as presses",
        };
        let device = Device::of(channels).ok_or(lacking)?;
        Ok(Running { device, channels: vec![Track::new(rate_hz); device.width()] })
    }
}

impl Windows for Running {
    fn values(&self) -> &[Value] {
        self.device.values()
    }

    fn measure(&self, span: Span) -> Measured {
        let nothing =
            |coverage| Measured::nothing(coverage, 1.0, self.device.values().len(), Reason::Gap);
        // Every summary has the idle time.
        let Some(idle) = self.channels.last() else { return nothing(0.0) };
        let coverage = idle.coverage(span);
        if coverage < LEAST_COVERAGE {
            return nothing(coverage);
        }
        let channels = self.channels.iter().map(|channel| channel.values_in(span)).collect();
        let summaries = Summaries { channels, secs: idle.usable_in(span) as f64 / idle.rate_hz() };
        Measured { coverage, quality: 1.0, values: self.device.measure(&summaries) }
    }
}

impl Causal for Running {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        for (place, track) in self.channels.iter_mut().enumerate() {
            track.push(at_ns, channels.get(place).copied().unwrap_or(f64::NAN));
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        self.channels.iter_mut().for_each(|channel| channel.forget(before_ns));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::activity::{GAMEPAD, KEYBOARD, MOUSE};

    const SECOND_NS: i64 = 1_000_000_000;

    /// The values of all seconds.
    fn measured(channels: &[&str], seconds: &[&[f64]]) -> Vec<(String, Result<f64, Reason>)> {
        let mut analysis = causal(channels, 1.0).unwrap();
        for (second, values) in seconds.iter().enumerate() {
            analysis.push(second as i64 * SECOND_NS, values);
        }
        let span = Span { begin_ns: 0, end_ns: seconds.len() as i64 * SECOND_NS };
        let names = analysis.values().iter().map(|value| value.name.to_string());
        names.zip(analysis.measure(span).values).collect()
    }

    fn of(found: &[(String, Result<f64, Reason>)], name: &str) -> Result<f64, Reason> {
        found.iter().find(|(each, _)| each == name).unwrap().1
    }

    #[test]
    fn means_and_deviations_are_those_of_all_times() {
        // 10, 20, 30, 40 and 50 ms, and five of 100 ms.
        let first = [5.0, 0.0, 5.0, 30.0, 200_f64.sqrt(), 0.0, f64::NAN, f64::NAN, 0.0];
        let second = [5.0, 2.0, 5.0, 100.0, 0.0, 0.0, f64::NAN, f64::NAN, 0.0];
        let found = measured(&KEYBOARD, &[&first, &second]);
        let times_ms = [10.0, 20.0, 30.0, 40.0, 50.0, 100.0, 100.0, 100.0, 100.0, 100.0];
        let mean = times_ms.iter().sum::<f64>() / 10.0;
        let sd = (times_ms.iter().map(|ms| (ms - mean) * (ms - mean)).sum::<f64>() / 10.0).sqrt();
        assert!((of(&found, "KEY_HoldMean").unwrap() - mean).abs() < 1e-9);
        assert!((of(&found, "KEY_HoldSD").unwrap() - sd).abs() < 1e-9);
        assert_eq!(of(&found, "KEY_IntervalMean"), Err(Reason::Short));
        assert_eq!(of(&found, "KEY_Rate"), Ok(300.0));
        assert_eq!(of(&found, "KEY_Corrections"), Ok(0.2));
    }

    #[test]
    fn a_mouse_at_rest_has_no_speed() {
        let found = measured(&MOUSE, &[&[0.0, 0.0, 0.0, 0.0, 0.0, 3.0]]);
        assert_eq!(of(&found, "MOUSE_Speed"), Err(Reason::Short));
        assert_eq!((of(&found, "MOUSE_Clicks"), of(&found, "MOUSE_Idle")), (Ok(0.0), Ok(1.0)));
        let found =
            measured(&MOUSE, &[&[300.0, 2.0, 1.0, 0.0, 0.5, 0.0], &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]);
        assert_eq!((of(&found, "MOUSE_Speed"), of(&found, "MOUSE_Moving")), (Ok(600.0), Ok(0.25)));
        assert_eq!(of(&found, "MOUSE_Clicks"), Ok(60.0));
    }

    #[test]
    fn rates_are_of_the_seconds_that_are_known() {
        let lost = [f64::NAN; 4];
        let known = [2.0, 0.5, 1.0, 0.0];
        let found = measured(&GAMEPAD, &[&known, &lost, &known, &known]);
        assert_eq!((of(&found, "PAD_Rate"), of(&found, "PAD_Deflection")), (Ok(120.0), Ok(0.5)));
        let found = measured(&GAMEPAD, &[&known, &lost, &lost, &lost]);
        assert_eq!(of(&found, "PAD_Rate"), Err(Reason::Gap));
    }

    #[test]
    fn other_channels_are_refused() {
        assert!(causal(&["value"], 1.0).is_err() && causal(&MOUSE, 1e6).is_err());
    }
}
