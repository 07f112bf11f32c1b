//! Any samples at any times: the statistics of sliding windows are those of their samples.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_signal::descriptive::{Pace, Rolling};

const SECOND_NS: i64 = 1_000_000_000;

fuzz_target!(|input: (u8, Vec<(i32, i8, bool)>)| {
    let (rate_hz, samples) = input;
    let paces =
        [(1, 1), (3, 1), (10, 2)].map(|(secs, hops)| Pace { length_ns: secs * SECOND_NS, hops });
    let mut rolling = Rolling::new(f64::from(rate_hz), 1, &paces, SECOND_NS);
    let mut at_ns = 0_i64;
    for (step, value, is_leap) in samples {
        // Mostly fractions of a second, forwards or backwards; now and then up to years.
        let step_ns = i64::from(step) * if is_leap { SECOND_NS } else { 1 };
        at_ns = at_ns.saturating_add(step_ns);
        while let Some(end_ns) = rolling.advance(at_ns) {
            for place in 0..paces.len() {
                if !rolling.ends(place, end_ns) {
                    continue;
                }
                let view = rolling.window(place);
                let exact = rolling.describe(view.span);
                let of = |view: &teampulse_signal::descriptive::View| {
                    view.channels[0]
                        .summary
                        .map(|of| (of.n, of.median, of.mad, of.least, of.greatest))
                };
                assert_eq!(of(&view), of(&exact));
            }
        }
        rolling.push(at_ns, &[f64::from(value)]);
    }
});
