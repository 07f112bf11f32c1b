"""Golden values of respiration: `python respiration.py > respiration.rs`.

NeuroKit2 0.2.13, numpy 2.4.6, SciPy 1.17.1. Signals are simulated, with fixed seeds.
"""

import neurokit2 as nk
import numpy as np

RATE_HZ = 100


def table(doc, name, values, kind="f64"):
    if kind == "f64":
        text = ", ".join(f"{value:.12e}".replace("e+00", "") for value in values)
    else:
        text = ", ".join(f"{value}" for value in values)
    print(f"\n/// {doc}\npub const {name}: [{kind}; {len(values)}] = [{text}];")


print("//! Made by respiration.py; do not edit.")

# Cleaning: a slow drift, a breath, a tremor.
t = np.arange(600) / 20
signal = 3 + 0.2 * t + np.sin(2 * np.pi * 0.25 * t) + 0.3 * np.sin(2 * np.pi * 4 * t)
clean = nk.rsp_clean(signal, sampling_rate=20)
table("Each 50th sample of `rsp_clean`.", "CLEAN", clean[::50])

# Breaths, and heart beats that follow them.
random = np.random.default_rng(4)
durations = np.round(RATE_HZ * random.uniform(3, 6, 30)).astype(int)
troughs = 50 + np.concatenate([[0], np.cumsum(durations)])
peaks = troughs[:-1] + np.round(durations * random.uniform(0.35, 0.5, 30)).astype(int)
# NeuroKit2 wants as many peaks as troughs.
peaks = np.concatenate([peaks, [troughs[-1] + 150]])
beat, beats = 40.0, []
while beat < troughs[-1] + 100:
    beats.append(int(round(beat)))
    phase = np.interp(beat, troughs, np.arange(len(troughs)))
    beat += 85 - 8 * np.sin(2 * np.pi * phase) + random.normal(0, 1.5)
# Beats that were not found: some halves of breaths have no interval.
beats = np.array([beat for beat in beats if not 2000 < beat < 2450])
table("Onsets of inhalation [samples at 100 Hz].", "TROUGHS", troughs, "u32")
table("Onsets of exhalation [samples at 100 Hz].", "PEAKS", peaks[:-1], "u32")
table("Heart beats [samples at 100 Hz].", "BEATS", beats, "u32")

rate = nk.signal_rate(troughs, sampling_rate=RATE_HZ, desired_length=troughs[-1] + 100)
rrv = nk.rsp_rrv(rate, troughs, sampling_rate=RATE_HZ).iloc[0]
names = ["RMSSD", "MeanBB", "SDBB", "SDSD", "CVBB", "CVSD", "MedianBB", "MadBB", "MCVBB", "SD1", "SD2", "SD2SD1"]
table("`RMSSD`, `MeanBB`, `SDBB`, `SDSD`, `CVBB`, `CVSD`, `MedianBB`, `MadBB`, `MCVBB`, `SD1`, `SD2` and `SD2SD1` of `rsp_rrv`.", "VARIABILITY", [rrv["RRV_" + name] for name in names])

from neurokit2.hrv.hrv_rsa import _hrv_rsa_p2t

rsa = _hrv_rsa_p2t(troughs, beats, RATE_HZ, rsp_peaks=peaks)
table("`RSA_P2T_Mean`, `RSA_P2T_Mean_log`, `RSA_P2T_SD` and `RSA_P2T_NoRSA` of `hrv_rsa`.", "PEAK_TO_TROUGH", [rsa["RSA_P2T_" + name] for name in ["Mean", "Mean_log", "SD", "NoRSA"]])

# An ECG of which 15 breaths a minute move the heart rate and the baseline.
ecg = nk.ecg_simulate(duration=60, sampling_rate=250, heart_rate=70, heart_rate_std=3, noise=0, method="ecgsyn", random_state=8)
found = nk.ecg_peaks(nk.ecg_clean(ecg, sampling_rate=250), sampling_rate=250)[1]["ECG_R_Peaks"]
heights = ecg[found]
table("R peaks of `ecg_simulate` (ecgsyn, 70 a minute, 15 breaths a minute) [samples at 250 Hz].", "SIMULATED_BEATS", found, "u32")
table("Heights of R there.", "SIMULATED_HEIGHTS", np.round(heights, 5))
