//! Finding pulses allocates nothing in steady state.

mod counting;

use counting::allocations;
use teampulse_signal::ppg::PulseDetector;

#[test]
fn pulses_are_found_without_allocations() {
    for rate_hz in [20.0, 64.0, 1000.0] {
        let mut detector = PulseDetector::new(rate_hz).unwrap();
        let sample = |k: usize| {
            let lost = k % 5000 > 4800;
            let phase = k as f64 / rate_hz % 0.9 - 0.4;
            if lost { f64::NAN } else { (-(phase / 0.1).powi(2)).exp() + 0.1 * (k * k % 13) as f64 }
        };
        let minute = (60.0 * rate_hz) as usize;
        let mut run = |begin: usize| {
            (begin..begin + minute).filter(|&k| detector.push(sample(k)).is_some()).count()
        };
        run(0);
        let before = allocations();
        let pulses = run(minute);
        assert_eq!(allocations(), before, "{rate_hz} Hz");
        assert!(pulses > 30, "{pulses} at {rate_hz} Hz");
    }
}
