//! The analysis of a skin conductance asks for no memory in steady state, while the host lets go of
//! the past.

mod counting;

use counting::allocations;
use teampulse_signal::eda::ResponseDetector;
use teampulse_signal::eda::analysis::{Settings, causal};

/// A level with some noise, and no response.
fn sample(number: i64) -> f64 {
    let noise = (number * number % 977 * 31 % 1009) as f64 / 1009.0;
    if number % 1000 == 17 { f64::NAN } else { 3.0 + 0.005 * noise }
}

#[test]
fn skin_asks_for_no_memory() {
    for rate_hz in [4.0, 128.0, 1000.0] {
        let mut analysis = causal(&Settings::default(), rate_hz).unwrap();
        let mut before = 0;
        for number in 0..(180.0 * rate_hz) as i64 {
            if number == (120.0 * rate_hz) as i64 {
                before = allocations();
            }
            let at_ns = (number as f64 / rate_hz * 1e9) as i64;
            analysis.push(at_ns, &[sample(number), 33.0]);
            if number % (rate_hz as i64) == 0 {
                analysis.forget(at_ns - 10_000_000_000);
            }
        }
        assert_eq!(allocations() - before, 0, "at {rate_hz} Hz");
    }
}

#[test]
fn even_responses_ask_for_no_memory() {
    let mut detector = ResponseDetector::new(32.0, 0.05).unwrap();
    let (mut found, mut before) = (0, 0);
    for number in 0..20_000_u32 {
        if number == 10_000 {
            (found, before) = (0, allocations());
        }
        let phasic = (f64::from(number) / 30.0).sin();
        found += u32::from(detector.push(phasic).is_some());
    }
    assert!(found > 40, "{found}");
    assert_eq!(allocations() - before, 0);
}
