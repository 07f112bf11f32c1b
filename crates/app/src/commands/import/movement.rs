//! The movement that two accelerometers of one person recorded.

use teampulse_bag::{Bag, BagStream};
use teampulse_core::stream::{Origin, Signal};
use teampulse_formats::Content;

use super::imported::{DeviceRecording, Imported};
use crate::commands::calibrate::signals::{Span, Wanted, record};
use crate::failure::Failure;

/// The lowest rate at which acceleration shows movement [Hz].
const LEAST_HZ: f64 = 20.0;
/// The axes of an accelerometer.
const AXES: usize = 3;

/// The magnitude of the acceleration at each time.
#[derive(Debug, Default)]
pub(super) struct Magnitudes {
    pub at_ns: Vec<i64>,
    pub values: Vec<f64>,
}

impl Magnitudes {
    fn push(&mut self, at_ns: i64, vector: &[f64]) {
        self.at_ns.push(at_ns);
        self.values.push(vector.iter().map(|axis| axis * axis).sum::<f64>().sqrt());
    }
}

/// Finds the person's acceleration in a session; of several streams, the one with the most messages.
pub(super) fn acceleration_of<'a>(bag: &'a Bag, person: &str) -> Option<&'a BagStream> {
    let is_meant = |known: &&BagStream| is_acceleration(known) && known.stream.id == person;
    bag.streams().iter().filter(is_meant).max_by_key(|known| known.messages)
}

/// Whether a stream of a session shows a person's movement.
pub(super) fn is_acceleration(known: &BagStream) -> bool {
    let stream = &known.stream;
    let is_slow = stream.rate_hz > 0.0 && stream.rate_hz < LEAST_HZ;
    stream.signal == Signal::Acceleration
        && stream.origin == Origin::Raw
        && stream.channels.len() == AXES
        && known.messages > 0
        && !is_slow
}

/// Reads the movement in a stream of a session.
pub(super) fn of_session(bag: &Bag, stream: &str) -> Result<Magnitudes, Failure> {
    let wanted: Wanted = stream.parse().map_err(Failure::new)?;
    let recorded = record(bag, [&wanted, &wanted], Span::of(bag, None, None))?;
    let (times, values) = recorded.seen[0].samples();
    let mut movement = Magnitudes::default();
    for (at_ns, vector) in times.iter().zip(values.chunks_exact(AXES)) {
        movement.push(*at_ns, vector);
    }
    Ok(movement)
}

/// Reads the movement in a recording of a device; `None` if it has no accelerometer.
pub(super) fn of_device(device: &DeviceRecording) -> Option<Magnitudes> {
    let is_meant = |signal: &&Imported| {
        let stream = &signal.stream;
        stream.signal == Signal::Acceleration && stream.channels.len() == AXES
    };
    let signal = device.signals.iter().find(is_meant)?;
    let mut movement = Magnitudes::default();
    match &signal.content {
        Content::Even(runs) => {
            for run in runs {
                for (place, vector) in run.samples.chunks_exact(AXES).enumerate() {
                    let after_ns = (place as f64 * run.period_ns).round() as i64;
                    movement.push(run.start_ns.saturating_add(after_ns), vector);
                }
            }
        }
        Content::Uneven { at_ns, values } => {
            for (at_ns, vector) in at_ns.iter().zip(values.chunks_exact(AXES)) {
                movement.push(*at_ns, vector);
            }
        }
        Content::Marks(_) => {}
    }
    Some(movement)
}
