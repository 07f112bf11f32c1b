//! The true period of samples that come in batches.

/// How many streams of batches a device may have; more share places.
const TRAINS: usize = 8;
/// How far a period may be from what its driver says, as a fraction.
const TOLERANCE: f64 = 0.1;
/// Over how many batches a period is averaged.
const AVERAGED: f64 = 32.0;

/// Learns from batch to batch how far apart samples are.
///
/// A driver may give the nominal period while the device's true one differs; then the end of one
/// batch would lie after the start of the next. Streams of one device are told apart by their
/// sample numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Batches {
    trains: [Option<Train>; TRAINS],
    /// The place that is given away next.
    next: usize,
}

/// One stream's batches.
#[derive(Clone, Copy, Debug)]
struct Train {
    device: i64,
    index: u64,
    period_nanos: f64,
    observed: f64,
    /// Where the last batch ended, in the session's time.
    end: i64,
}

impl Batches {
    /// The period of a batch whose first sample has the device time `device` and the number `index`,
    /// given what its driver says [ns]; and
    /// which train it continues, if it does.
    pub fn period(&mut self, device: i64, index: u64, said_nanos: f64) -> (Option<usize>, f64) {
        for (place, train) in self.trains.iter_mut().enumerate() {
            let Some(train) = train else { continue };
            let near = |period: f64| (period / said_nanos - 1.0).abs() <= TOLERANCE;
            let repeated = index == train.index && device == train.device;
            if repeated && near(train.period_nanos) {
                return (None, train.period_nanos);
            }
            let numbers = index.wrapping_sub(train.index) as i64;
            let passed = device.saturating_sub(train.device) as f64;
            let period = passed / numbers as f64;
            if numbers > 0 && passed > 0.0 && near(period) && near(train.period_nanos) {
                train.observed = (train.observed + 1.0).min(AVERAGED);
                train.period_nanos += (period - train.period_nanos) / train.observed;
                (train.device, train.index) = (device, index);
                return (Some(place), train.period_nanos);
            }
        }
        let place = self.next;
        self.next = (self.next + 1) % TRAINS;
        let train = Train { device, index, period_nanos: said_nanos, observed: 0.0, end: i64::MIN };
        self.trains[place] = Some(train);
        (Some(place), said_nanos)
    }

    /// Where the batch before this one ended [ns, session's time].
    pub fn end_before(&self, train: usize) -> i64 {
        self.trains[train].map_or(i64::MIN, |train| train.end)
    }

    /// A batch ended there [ns, session's time].
    pub fn ended(&mut self, train: usize, end: i64) {
        if let Some(train) = &mut self.trains[train] {
            train.end = train.end.max(end);
        }
    }
}
