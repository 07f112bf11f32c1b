//! The mean of the channels above the eyes.

use crate::gaps::is_usable;

/// The mean of channels: both eyes blink at once, while looking sideways has opposite signs on the two sides.
pub(super) struct Frontal {
    channels: Vec<Channel>,
}

struct Channel {
    index: usize,
    /// The first usable sample, subtracted as the electrodes' offset.
    first: f64,
    /// The last usable sample.
    held: f64,
}

impl Frontal {
    /// Creates the mean of these channels.
    pub(super) fn new(channels: &[usize]) -> Frontal {
        let channel = |&index: &usize| Channel { index, first: f64::NAN, held: f64::NAN };
        Frontal { channels: channels.iter().map(channel).collect() }
    }

    /// Takes in the next sample of all channels; returns NaN where none has one.
    pub(super) fn mix(&mut self, value: impl Fn(usize) -> f64) -> f64 {
        let (mut sum, mut count, mut is_there) = (0.0, 0.0, false);
        for channel in &mut self.channels {
            let value = value(channel.index);
            if is_usable(value) {
                is_there = true;
                channel.held = value;
                channel.first = if channel.first.is_nan() { value } else { channel.first };
            }
            if !channel.held.is_nan() {
                sum += channel.held - channel.first;
                count += 1.0;
            }
        }
        if is_there { sum / count } else { f64::NAN }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_that_falls_out_or_joins_makes_no_jump() {
        let samples = [[5.0, f64::NAN], [7.0, 900.0], [7.0, 902.0], [f64::NAN, 902.0]];
        let mut frontal = Frontal::new(&[0, 1]);
        let mixed = samples.map(|sample| frontal.mix(|index| sample[index]));
        assert_eq!(mixed, [0.0, 1.0, 2.0, 2.0]);
        assert!(frontal.mix(|_| f64::NAN).is_nan());
    }
}
