"""Makes ppg.rs: pulse waves as NeuroKit2 0.2.13 simulates them, with drift and motion, in thousandths,
and where the peaks of the same waves are without either. Run: python ppg.py > ppg.rs"""
import neurokit2 as nk
import numpy as np
from scipy.signal import find_peaks

print("//! Simulated pulse waves; made by ppg.py.\n")
print("/// Samples a second, pulses a minute, the wave in thousandths, and the samples of its peaks.")
print("pub const SIMULATED: [(f64, f64, &[i16], &[u32]); 3] = [")
for rate, pulses, seed in ((64, 55, 1), (32, 80, 2), (100, 140, 3)):
    def wave(**kinds):
        return nk.ppg_simulate(
            duration=20, sampling_rate=rate, heart_rate=pulses, frequency_modulation=0.1,
            ibi_randomness=0.05, random_state=seed, **kinds)
    clean = wave(drift=0, motion_amplitude=0, powerline_amplitude=0, burst_number=0)
    noisy = wave(drift=1, motion_amplitude=0.1, powerline_amplitude=0.01, burst_number=0)
    peaks = find_peaks(clean, prominence=0.3 * np.ptp(clean))[0]
    lines = lambda values: ", ".join(str(int(value)) for value in values)
    print(f"    ({rate}.0, {pulses}.0, &[{lines(np.round(noisy * 1000))}], &[{lines(peaks)}]),")
print("];")
