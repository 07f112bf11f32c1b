"""Prints eda.rs: NeuroKit2 0.2.13 (cvxopt 1.3.3, SciPy 1.17.1) on a made-up skin conductance (python eda.py > eda.rs)."""
import warnings
import neurokit2 as nk, numpy as np

warnings.filterwarnings("ignore")


def signal(rate_hz, secs):
    """The same in the tests: responses on a level that drifts, and noise from whole numbers."""
    k = np.arange(int(rate_hz * secs), dtype=np.int64)
    t = k / rate_hz
    x = 4 + 0.5 * np.sin(t / 40) + 0.002 * t
    for n in range(int(secs / 11)):
        d = t - (5 + 11 * n + 3 * np.sin(2.0 * n))
        bateman = np.where(d > 0, np.exp(-d / 2) - np.exp(-d / 0.7), 0)
        x = x + (0.1 + 0.07 * (n * 5 % 7)) * bateman / 0.3689
    return x + 0.004 * ((k * 7919 % 1009) / 1009 - 0.5)


def print_const(doc, name, values):
    numbers = ", ".join(repr(float(v)) for v in values)
    print(f"/// {doc}\npub const {name}: &[f64] = &[{numbers}];\n")


print("//! NeuroKit2 0.2.13 on the same signals, printed by eda.py.\n")
x = signal(4, 120)
cvx = nk.eda_phasic(x, 4, method="cvxeda")
print_const("`eda_phasic(x, 4, method=\"cvxeda\")`, each 8th sample.", "CVX_PHASIC", cvx.EDA_Phasic[::8])
print_const("The tonic part of it.", "CVX_TONIC", cvx.EDA_Tonic[::8])
x = signal(32, 120)
clean = nk.eda_clean(x, 32)
split = nk.eda_phasic(clean, 32)
print_const("`eda_clean(x, 32)`, each 64th sample.", "CLEAN", clean[::64])
print_const("`eda_phasic` of it.", "PHASIC", split.EDA_Phasic[::64])
print_const("The tonic part of it.", "TONIC", split.EDA_Tonic[::64])
_, info = nk.eda_peaks(split.EDA_Phasic.values, 32)
found = ~np.isnan(info["SCR_Onsets"])
rows = np.c_[info["SCR_Onsets"], info["SCR_Peaks"], info["SCR_Amplitude"], info["SCR_RiseTime"], info["SCR_RecoveryTime"]][found]
rows = ", ".join("[" + ", ".join("f64::NAN" if np.isnan(v) else repr(float(v)) for v in row) + "]" for row in rows)
print(f"/// `eda_peaks` of that: onset, peak, amplitude, rise time, half-recovery time.\npub const RESPONSES: &[[f64; 5]] = &[{rows}];\n")
s, _ = nk.eda_process(x, 32)
print(f"/// `EDA_Tonic_SD` of all.\npub const TONIC_SD: f64 = {nk.eda_intervalrelated(s, sampling_rate=32).EDA_Tonic_SD.iloc[0]!r};")
