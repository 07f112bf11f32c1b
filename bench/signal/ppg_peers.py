"""Makes src/ppg_peers.rs: the pulses that other programs find in recorded PPGs.
Run: OMP_NUM_THREADS=1 python ppg_peers.py SHARED_DATA > src/ppg_peers.rs
NeuroKit2 0.2.13, HeartPy 1.2.7, BioSPPy 2.2.4."""
import sys
import warnings

import biosppy.signals.ppg as biosppy
import heartpy
import neurokit2 as nk
import numpy as np
from scipy.signal import resample_poly

warnings.filterwarnings("ignore")
data = sys.argv[1]


def peaks(x, rate):
    def neurokit(method):
        return lambda: nk.ppg_findpeaks(nk.ppg_clean(x, rate), rate, method=method)["PPG_Peaks"]

    def heart():
        band = heartpy.filter_signal(x, [0.5, 8], rate, order=2, filtertype="bandpass")
        return heartpy.process(heartpy.scale_data(band), rate)[0]["peaklist"]

    tools = [neurokit("elgendi"), neurokit("bishop"), neurokit("charlton"), heart,
             lambda: biosppy.ppg(x, rate, show=False)["peaks"]]
    for tool in tools:
        try:
            yield [int(peak) for peak in tool()]
        except Exception:
            yield []


# The level is subtracted, as it would be a jump at the ends of the resampling filter.
rest = np.loadtxt(f"{data}/ppg/ppg_1000hz.txt", comments="#")
rest = resample_poly(rest - np.median(rest), 1, 10)
wrist = np.loadtxt(f"{data}/e4_devicely/BVP.csv", skiprows=2)
print("//! The pulses that other programs find; made by `ppg_peers.py`: NeuroKit2 (elgendi, bishop, charlton), `HeartPy`,")
print("//! `BioSPPy`; no pulses if a program fails.\n")
for name, doc, x, rate in (
    ("AT_REST", "Pulses in `ppg/ppg_1000hz.txt` without its level, at 100 Hz [samples].", rest, 100),
    ("ON_THE_MOVE", "Pulses in `e4_devicely/BVP.csv` [samples].", wrist, 64),
):
    print(f"/// {doc}\npub const {name}: [&[f64]; 5] = [")
    for found in peaks(x, rate):
        print("    &[" + ", ".join(f"{peak}.0" for peak in found) + "],")
    print("];\n")
