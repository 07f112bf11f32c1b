"""Runs NeuroKit2's, SciPy's and our analysis of the same hour of signal in turn, on one thread each; the best of
several runs counts. Ours reads the signal from a file of float64; only the analysis is timed.

usage: speed.py BENCH_SIGNAL [JOB...]
"""

import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import scipy.signal as ss

warnings.filterwarnings("ignore")
import neurokit2 as nk  # noqa: E402

SECS, TIMES = 300, 12  # five minutes of simulated signal, twelve times: an hour
ROUNDS = 6  # in turn, as the speed of the machine varies


def hour(signal):
    return np.tile(np.asarray(signal, dtype=float), TIMES)


def ecg(rate):
    return hour(nk.ecg_simulate(duration=SECS, sampling_rate=rate, heart_rate=70, random_state=1))


def eda(rate):
    return hour(nk.eda_simulate(duration=SECS, sampling_rate=rate, scr_number=20, noise=0.001, random_state=1))


def ppg(rate):
    return hour(nk.ppg_simulate(duration=SECS, sampling_rate=rate, random_state=1))


def rsp(rate):
    return hour(nk.rsp_simulate(duration=SECS, sampling_rate=rate, random_state=1))


def emg(rate):
    return np.random.default_rng(0).standard_normal((8, 3600 * rate)) * 20


def eeg(rate):
    noise = np.random.default_rng(0).standard_normal
    return noise((4, 3600 * rate)).cumsum(1) * 0.1 + noise((4, 3600 * rate))


def intervals(_rate):
    """Returns five minutes of intervals between beats [ms]."""
    beats = np.random.default_rng(0)
    wave = np.sin(np.arange(350) * 1.3)
    return 857 + 30 * wave + 15 * beats.standard_normal(350)


def bare_filter(signal, rate):
    return ss.sosfiltfilt(ss.butter(4, [0.5, 40], "band", fs=rate, output="sos"), signal)


def nonlinear(rri, _rate):
    return nk.hrv_nonlinear(nk.intervals_to_peaks(rri, sampling_rate=1000), sampling_rate=1000)


def beats(signal, rate):
    return nk.ecg_peaks(nk.ecg_clean(signal, rate), rate)


def cvxeda(signal, rate):
    return nk.eda_phasic(signal, rate, method="cvxeda")


def welch(signal, rate):
    return ss.welch(signal, rate, nperseg=4 * rate, noverlap=2 * rate)


# Job, rate [Hz], signal, what the peer does, its name, the smallest speed ratio (None: no such peer), rounds.
JOBS = [
    ("beats", 130, ecg, beats, "NeuroKit2's ecg_clean and ecg_peaks", 2, ROUNDS),
    ("beats", 512, ecg, beats, "NeuroKit2's ecg_clean and ecg_peaks", 2, ROUNDS),
    ("beats", 130, ecg, bare_filter, "SciPy's sosfiltfilt alone", 0.1, ROUNDS),
    ("beats", 512, ecg, bare_filter, "SciPy's sosfiltfilt alone", 0.1, ROUNDS),
    ("ecg", 130, ecg, nk.ecg_process, "NeuroKit2's ecg_process", 50, 1),
    ("ppg", 64, ppg, nk.ppg_process, "NeuroKit2's ppg_process", 30, 3),
    ("eda", 4, eda, nk.eda_process, "NeuroKit2's eda_process", 5, ROUNDS),
    ("eda", 128, eda, nk.eda_process, "NeuroKit2's eda_process", 5, ROUNDS),
    ("cvxeda", 4, eda, cvxeda, "NeuroKit2's cvxEDA (cvxopt)", 1 / 1.2, ROUNDS),
    ("respiration", 50, rsp, nk.rsp_process, "NeuroKit2's rsp_process", 10, ROUNDS),
    ("eeg", 256, eeg, welch, "SciPy's welch alone", 0.1, 3),
    ("nonlinear", 1, intervals, nonlinear, "NeuroKit2's hrv_nonlinear", 50, 3),
    ("emg", 200, emg, None, "", None, 3),
]
# The longest time [s], whatever the peer takes.
LIMITS = {"nonlinear": 0.005, "emg": 0.5}


def ours(program, job, rate, file):
    done = subprocess.run([program, "speed", job, str(rate), file], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return float(done.stdout)


def timed(action):
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


def line(met, text):
    print(f"{'pass' if met else 'FAIL'}  speed, {text}", flush=True)
    return met


def run(program, folder, job):
    what, rate, make, peer, name, bar, rounds = job
    signal = make(rate)
    file = str(Path(folder) / f"{what}{rate}.f64")
    np.atleast_2d(signal).T.astype("<f8").tofile(file)
    mine, theirs = [], []
    for _ in range(rounds):
        mine.append(ours(program, what, rate, file))
        if peer:
            theirs.append(timed(lambda: peer(signal, rate)))
    best = min(mine)
    met = True
    if peer:
        ratio = min(theirs) / best
        text = f"{what} at {rate} Hz: {best:.5f} s, {ratio:.2f} times as fast as {name} (bar {bar:.2f})"
        met = line(ratio >= bar, text)
    if what in LIMITS:
        met &= line(best <= LIMITS[what], f"{what} at {rate} Hz: {best:.5f} s (bar {LIMITS[what]})")
    return met


def main():
    program, wanted = sys.argv[1], sys.argv[2:]
    jobs = [job for job in JOBS if not wanted or job[0] in wanted]
    with tempfile.TemporaryDirectory() as folder:
        met = [run(program, folder, job) for job in jobs]
    sys.exit(0 if all(met) else 1)


main()
