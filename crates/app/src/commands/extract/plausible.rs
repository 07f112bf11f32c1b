//! Checks whether the numbers in a table are plausible for their signal and unit.

use teampulse_core::stream::Signal;

use crate::exit::Exit;
use crate::failure::Failure;

/// The number of rows that are checked.
pub const FIRST: usize = 20;
/// Usual intervals between beats [ms].
pub const INTERVALS_MS: (f64, f64) = (200.0, 3000.0);
/// A usual interval shorter than this is not a person's [ms]: over 220 beats per minute.
const LEAST_USUAL_MS: f64 = 273.0;
/// Highest skin conductance [uS].
const MOST_EDA_US: f64 = 100.0;
/// A recording whose largest number is smaller than this is in another unit: a skin conductance in siemens [uS], an EEG
/// in volts or millivolts [uV].
const LEAST_EDA_US: f64 = 5e-5;
const LEAST_EEG_UV: f64 = 0.1;
/// Lowest and highest skin temperature of a living person [degC].
const SKIN_DEG_C: (f64, f64) = (-20.0, 60.0);
/// The largest plausible sample of audio, where 1 is full scale: a signal may exceed that a little.
const MOST_AUDIO: f64 = 8.0;
/// Highest typical acceleration of a person [g].
const MOST_ACCELERATION_G: f64 = 4.0;

/// The first rows of a signal, in the unit in which it is analysed.
pub struct Plausible {
    signal: Signal,
    first: Vec<f64>,
    are_whole: bool,
    /// The largest magnitude of all numbers so far.
    largest: f64,
}

impl Plausible {
    pub fn new(signal: Signal) -> Plausible {
        Plausible { signal, first: Vec::with_capacity(FIRST), are_whole: true, largest: 0.0 }
    }

    /// Adds a row: its first number, or the magnitude of the three numbers of an acceleration.
    pub fn take(&mut self, values: &[f64]) {
        let number = match self.signal {
            Signal::Acceleration => values.iter().map(|value| value * value).sum::<f64>().sqrt(),
            _ => values.first().copied().unwrap_or(f64::NAN),
        };
        self.largest = values.iter().fold(self.largest, |largest, value| largest.max(value.abs()));
        if self.first.len() < FIRST && number.is_finite() {
            self.first.push(number);
            self.are_whole &= values.iter().all(|value| value.fract() == 0.0);
        }
    }

    /// Fails if the numbers of a whole recording are too small, with a remedy. Zeros alone do not show another unit.
    pub fn too_small(&self) -> Result<(), Failure> {
        let largest = self.largest;
        if largest <= 0.0 || self.first.len() < FIRST {
            return Ok(());
        }
        let (message, hint) = match self.signal {
            Signal::Eda if largest < LEAST_EDA_US => (
                format!("a skin conductance of at most {largest:.2e} uS is too small"),
                "give --unit S if it is in siemens",
            ),
            Signal::Eeg if largest < LEAST_EEG_UV => (
                format!("an EEG of at most {largest:.2e} uV is too small"),
                "give --unit V or --unit mV if that is its unit",
            ),
            _ => return Ok(()),
        };
        Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
    }

    /// The median of the first rows.
    fn usual(&self) -> Option<f64> {
        let mut first = self.first.clone();
        first.sort_unstable_by(f64::total_cmp);
        first.get(first.len() / 2).copied()
    }

    /// Returns a doubt about the numbers, which are used nevertheless.
    pub fn note(&self) -> Option<String> {
        let usual_ms = self.usual().filter(|_| self.signal == Signal::Interval)?;
        (usual_ms < LEAST_USUAL_MS).then(|| {
            format!(
                "the usual interval, {usual_ms} ms, means a heart rate of {:.0} per minute: give --unit or --scale if it is \
                 not in milliseconds, such as --unit s/1024",
                60_000.0 / usual_ms
            )
        })
    }

    /// Fails if the numbers are implausible, with a remedy.
    pub fn refused(&self) -> Result<(), Failure> {
        let Some(usual) = self.usual() else { return Ok(()) };
        let counts = if self.are_whole { ": they look like raw counts of a converter" } else { "" };
        let (message, hint) = match self.signal {
            Signal::Interval if !(INTERVALS_MS.0..=INTERVALS_MS.1).contains(&usual) => (
                format!("intervals of {usual} ms are not heartbeat intervals"),
                "give --unit s (or --scale 1000) if they are in seconds; a heart rate is not an interval",
            ),
            Signal::Eda if usual > MOST_EDA_US => (
                format!("{usual} uS is not a skin conductance{counts}"),
                "give --unit kohm for a resistance, nS for nanosiemens, or --scale FACTOR to convert counts to uS, from the device's manual",
            ),
            Signal::Temperature if !(SKIN_DEG_C.0..=SKIN_DEG_C.1).contains(&usual) => (
                format!("{usual} degC is not a skin temperature{counts}"),
                "give --unit degF or --unit K if the values are in that unit, --scale FACTOR to convert counts \
                 to degC, or --signal other for anything but skin",
            ),
            Signal::Acceleration if usual > MOST_ACCELERATION_G => (
                format!("{usual:.4} g is too large for a person's acceleration{counts}"),
                "give --unit mg or --unit m/s^2 if the values are in that unit, --unit g/64 for an E4, or --scale \
                 FACTOR to convert counts to g: 0.000488281 for an Embrace Plus",
            ),
            Signal::Audio if self.largest > MOST_AUDIO => (
                format!(
                    "audio of up to {} exceeds its full scale, which is 1{counts}",
                    self.largest
                ),
                "give --scale 0.000030517578125 (1/32768) for samples of 16 bits",
            ),
            _ => return Ok(()),
        };
        Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_refused(signal: Signal, row: &[f64]) -> bool {
        let mut plausible = Plausible::new(signal);
        (0..FIRST).for_each(|_| plausible.take(row));
        plausible.refused().is_err()
    }

    #[test]
    fn implausible_numbers_are_refused() {
        for (signal, wrong, right) in [
            (Signal::Interval, &[0.8][..], &[800.0][..]),
            (Signal::Eda, &[1812.0], &[18.12]),
            (Signal::Temperature, &[91.4], &[33.0]),
            (Signal::Temperature, &[306.0], &[0.0]),
            (Signal::Acceleration, &[-1.0, 65.0, 5.0], &[0.1, 1.0, 0.1]),
            (Signal::Acceleration, &[0.1, 9.8, 0.1], &[0.0, 0.0, 0.0]),
        ] {
            assert!(is_refused(signal, wrong), "{signal:?}: {wrong:?}");
            assert!(!is_refused(signal, right), "{signal:?}: {right:?}");
        }
        for signal in [Signal::Ecg, Signal::Ppg, Signal::Emg, Signal::Other] {
            assert!(!is_refused(signal, &[1812.0]), "{signal:?}");
        }
    }

    #[test]
    fn audio_in_counts_is_refused_also_after_silence() {
        let refused = |numbers: &[f64]| {
            let mut plausible = Plausible::new(Signal::Audio);
            for number in numbers {
                plausible.take(&[*number]);
            }
            plausible.refused().err().map(|failure| failure.words())
        };
        let (message, hint) = refused(&[0.0, -4.0, 2300.0]).unwrap();
        assert!(message.starts_with("audio of up to 2300 exceeds its full scale"), "{message}");
        assert!(hint.contains("--scale 0.0000305"), "{hint}");
        assert!(refused(&[&[0.0; FIRST][..], &[-120.0]].concat()).is_some());
        assert!(refused(&[0.3, -1.2]).is_none());
    }

    #[test]
    fn numbers_far_too_small_for_their_unit_are_refused_when_all_are() {
        let refused = |signal: Signal, numbers: &[f64]| {
            let mut plausible = Plausible::new(signal);
            (0..FIRST).for_each(|row| plausible.take(&[numbers[row % numbers.len()]]));
            plausible.too_small().err().map(|failure| failure.words().1)
        };
        let hint = refused(Signal::Eda, &[5e-6, 6e-6]).unwrap();
        assert!(hint.contains("--unit S"), "{hint}");
        let hint = refused(Signal::Eeg, &[-3e-6, 2e-5]).unwrap();
        assert!(hint.contains("--unit V"), "{hint}");
        for (signal, numbers) in [
            (Signal::Eda, &[0.0][..]),
            (Signal::Eda, &[5e-6, 0.01]),
            (Signal::Eeg, &[0.0, 0.5]),
            (Signal::Emg, &[1e-9]),
        ] {
            assert!(refused(signal, numbers).is_none(), "{signal:?}: {numbers:?}");
        }
    }

    #[test]
    fn intervals_of_a_rate_that_no_heart_has_are_noted() {
        let note = |signal: Signal, number: f64| {
            let mut plausible = Plausible::new(signal);
            (0..FIRST).for_each(|_| plausible.take(&[number]));
            plausible.note()
        };
        let ticks = note(Signal::Interval, 219.0).unwrap();
        assert!(ticks.contains("219 ms, means a heart rate of 274 per minute"), "{ticks}");
        assert_eq!((note(Signal::Interval, 300.0), note(Signal::Ecg, 219.0)), (None, None));
    }

    #[test]
    fn an_empty_table_has_no_remark() {
        assert!(Plausible::new(Signal::Eda).refused().is_ok());
        assert!(!is_refused(Signal::Eda, &[f64::NAN]));
    }
}
