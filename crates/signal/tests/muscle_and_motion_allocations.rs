//! Analyses of muscles and motion ask for no memory in steady state, while the host lets go of the past.

mod counting;

use counting::allocations;
use teampulse_signal::acceleration::analysis as acceleration;
use teampulse_signal::analysis::Causal;
use teampulse_signal::descriptive::analysis as descriptive;
use teampulse_signal::emg::analysis as emg;
use teampulse_signal::temperature::analysis as temperature;

/// Two minutes that the host lets go of after ten seconds, then one that is watched; how often the last
/// asked for memory. Nothing is asked of the analysis, and nothing happens in the signal.
fn allocations_of(analysis: &mut dyn Causal, channels: usize, rate_hz: f64) -> u64 {
    let mut before = 0;
    let mut row = vec![0.0; channels];
    for sample in 0..(180.0 * rate_hz) as i64 {
        if sample == (120.0 * rate_hz) as i64 {
            before = allocations();
        }
        let at_ns = (sample as f64 / rate_hz * 1e9) as i64;
        let noise = (sample * sample % 977 * 31 % 1009) as f64 / 1009.0;
        row.fill(if sample % 1000 == 17 { f64::NAN } else { 30.0 + noise });
        analysis.push(at_ns, &row);
        if sample % (rate_hz.ceil() as i64) == 0 {
            analysis.forget(at_ns - 10_000_000_000);
        }
    }
    allocations() - before
}

#[test]
fn muscles_ask_for_no_memory() {
    let channels = vec![emg::Channel::default(); 8];
    let settings = emg::Settings { channels, ..emg::Settings::default() };
    assert_eq!(allocations_of(&mut *emg::causal(&settings, 200.0).unwrap(), 8, 200.0), 0);
}

#[test]
fn motion_asks_for_no_memory() {
    let mut running = acceleration::causal(&acceleration::Settings::default(), 32.0).unwrap();
    assert_eq!(allocations_of(&mut *running, 3, 32.0), 0);
}

#[test]
fn gauges_ask_for_no_memory() {
    let mut running = temperature::causal(&temperature::Settings::default(), 4.0).unwrap();
    assert_eq!(allocations_of(&mut *running, 1, 4.0), 0);
    let channels = vec![descriptive::Channel::default(); 5];
    let mut running = descriptive::causal(&descriptive::Settings { channels }, 50.0).unwrap();
    assert_eq!(allocations_of(&mut *running, 5, 50.0), 0);
}
