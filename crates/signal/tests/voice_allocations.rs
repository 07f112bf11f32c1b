//! A voice is followed without allocating anything once its buffers have grown.

mod counting;

use counting::allocations;
use std::f64::consts::TAU;

use teampulse_signal::voice::Settings;
use teampulse_signal::voice::analysis::causal;

fn sample(k: i64) -> f64 {
    let secs = k as f64 / 8000.0;
    let buzz = (1..6).map(|n| (TAU * 130.0 * f64::from(n) * secs).sin()).sum::<f64>();
    if k % 8000 < 5000 { 0.1 * buzz } else { 0.0 }
}

#[test]
fn no_sample_allocates() {
    let mut voice = causal(&Settings::default(), 8000.0).expect("a usual rate");
    let mut run = |samples: std::ops::Range<i64>| {
        for k in samples {
            voice.push(k * 125_000, &[sample(k)]);
            if k % 8000 == 0 {
                voice.forget(k * 125_000 - 2_000_000_000);
            }
        }
    };
    run(0..48_000);
    let before = allocations();
    run(48_000..96_000);
    assert_eq!(allocations(), before);
}
