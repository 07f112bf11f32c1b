//! Analyses of muscles, motion and gauges give the same results, bit for bit, however often they are
//! queried.

use teampulse_signal::analysis::{Causal, Event, Measured, Span};
use teampulse_signal::{acceleration, descriptive, emg, temperature};

/// Handed over in chunks, between which the analysis is asked for a window and for its events, and lets
/// go of what is older than ten seconds; the last ten seconds.
fn reported(
    mut analysis: Box<dyn Causal + Send>,
    rate_hz: f64,
    chunk: usize,
) -> (Vec<Event>, Measured) {
    let mut events = Vec::new();
    let count = (40.0 * rate_hz) as usize;
    let time_ns = |sample: usize| (sample as f64 / rate_hz * 1e9).round() as i64;
    let samples: Vec<usize> = (0..count).collect();
    for chunk in samples.chunks(chunk) {
        for &sample in chunk {
            let noise = (sample * sample % 977 * 31 % 1009) as f64 / 1009.0 - 0.5;
            let gain = if time_ns(sample) / 2_000_000_000 % 2 == 1 { 1.0 } else { 0.1 };
            let value = if sample % 501 == 17 { f64::NAN } else { 30.0 + gain * noise };
            analysis.push(time_ns(sample), &[value; 3]);
        }
        let end_ns = time_ns(chunk[chunk.len() - 1]);
        let begin_ns = end_ns - 10_000_000_000;
        std::hint::black_box(analysis.measure(Span { begin_ns, end_ns }));
        analysis.forget(begin_ns);
        events.extend(std::iter::from_fn(|| analysis.next_event()));
    }
    let end_ns = time_ns(count);
    (events, analysis.measure(Span { begin_ns: end_ns - 10_000_000_000, end_ns }))
}

fn assert_same(make: impl Fn() -> Box<dyn Causal + Send>, rate_hz: f64) -> usize {
    let (events, measured) = reported(make(), rate_hz, 1);
    let bits = |of: &Measured| {
        let bits = |value: &Result<f64, _>| value.map(f64::to_bits);
        of.values.iter().map(bits).collect::<Vec<_>>()
    };
    assert!(measured.values.iter().any(Result::is_ok));
    for chunk in [2, 7, 64, 1000, 4096] {
        let (same_events, same) = reported(make(), rate_hz, chunk);
        assert!(events == same_events && bits(&measured) == bits(&same), "chunks of {chunk}");
    }
    events.len()
}

#[test]
fn muscles_are_the_same_for_any_chunking() {
    let channels = vec![emg::analysis::Channel::default(); 3];
    let settings = emg::analysis::Settings { channels, ..Default::default() };
    let events = assert_same(|| emg::analysis::causal(&settings, 200.0).unwrap(), 200.0);
    assert!(events > 20);
}

#[test]
fn motion_is_the_same_for_any_chunking() {
    let unit = acceleration::Unit::StepsPerG(52.0);
    let settings = acceleration::analysis::Settings { unit, ..Default::default() };
    assert_same(|| acceleration::analysis::causal(&settings, 100.0).unwrap(), 100.0);
}

#[test]
fn gauges_are_the_same_for_any_chunking() {
    assert_same(
        || temperature::analysis::causal(&temperature::analysis::Settings::default(), 4.0).unwrap(),
        4.0,
    );
    assert_same(
        || {
            descriptive::analysis::causal(&descriptive::analysis::Settings::default(), 130.0)
                .unwrap()
        },
        130.0,
    );
}
