"""Prints how fast skin conductance is analysed: NeuroKit2 and ours in turn, the best of RUNS each.

eda_speed.py BINARY DATA
"""
import json, pathlib, subprocess, sys, tempfile, time, warnings

import neurokit2 as nk
import numpy as np

warnings.filterwarnings("ignore")
RUNS = 5
binary, data = sys.argv[1], pathlib.Path(sys.argv[2])


def best(signal, rate, method, theirs):
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        np.savetxt(file.name, signal, fmt="%.17g")
        ours_secs, theirs_secs = [], []
        for _ in range(RUNS):
            begin = time.perf_counter()
            theirs(signal)
            theirs_secs.append(time.perf_counter() - begin)
            command = [binary, "eda-time", file.name, str(rate), method]
            ours_secs.append(float(subprocess.run(command, capture_output=True, check=True).stdout))
    return min(ours_secs), min(theirs_secs)


def line(met, text):
    print("pass" if met else "FAIL", "", text)
    return met


met = True
recorded = np.array(json.loads((data / "golden/bio100_eda.json").read_text())["input_4hz"])[4:]
there_and_back = np.tile(np.r_[recorded, recorded[::-1]], 13)
for count in (1200, 14400):
    ours, theirs = best(there_and_back[:count], 4, "cvx", lambda x: nk.eda_phasic(x, 4, method="cvxeda"))
    met &= line(ours <= 1.2 * theirs, f"cvxEDA of {count} samples: {ours:.4f} s, cvxopt {theirs:.4f} s: {ours / theirs:.2f} of it (bar 1.2)")
for rate in (4, 128):
    made_up = nk.eda_simulate(duration=300, sampling_rate=rate, scr_number=20, noise=0.001, random_state=1)
    ours, theirs = best(np.tile(made_up, 12) + 3, rate, "whole", lambda x: nk.eda_process(x, rate))
    met &= line(5 * ours <= theirs, f"an hour at {rate} Hz with windows of a minute: {ours:.4f} s, NeuroKit2 {theirs:.4f} s: {theirs / ours:.1f} times faster (bar 5)")
sys.exit(0 if met else 1)
