"""Runs the feature `statistics` and pandas' rolling windows in turn on the same quarter of an hour of all signals
of an operator, on one thread each; the best of several runs counts.

Ours: mean, SD, median, MAD, minimum, maximum and slope of every channel, each second, and their differences from
the baseline. Theirs: the five of these that pandas has, without MAD and slope.

usage: rolling.py BENCH_SIGNAL
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

SECS = 900
ROUNDS = 3
WINDOWS_SECS = [30, 60, 300]
# The bar for all windows together [share of a core].
BAR = 0.004

# The sensors of a fully equipped operator: name, channels, rate [Hz].
STREAMS = [
    ("emg", 8, 200),
    ("eeg", 4, 256),
    ("ecg", 1, 130),
    ("ppg", 1, 64),
    ("acceleration", 3, 32),
    ("fingers", 1, 128),
    ("wrist", 1, 4),
    ("respiration", 1, 25),
    ("temperature", 1, 4),
]


def signal(random, channels, rate):
    """Returns drifting noise: no two numbers are the same, and the newest are not the largest."""
    samples = SECS * rate
    drift = random.standard_normal((samples, channels)).cumsum(0) / np.sqrt(rate)
    return 20 + drift + random.standard_normal((samples, channels))


def ours(program, folder, windows_secs):
    words = [program, "rolling", folder, ",".join(map(str, windows_secs))]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return float(done.stdout)


def theirs(frames):
    begin = time.thread_time()
    for rate, frame in frames:
        for secs in WINDOWS_SECS:
            windows = frame.rolling(secs * rate, min_periods=secs * rate // 2, step=rate)
            for statistic in ("mean", "std", "median", "min", "max"):
                getattr(windows, statistic)()
    return time.thread_time() - begin


def main():
    program = sys.argv[1]
    random = np.random.default_rng(0)
    frames = []
    with tempfile.TemporaryDirectory() as folder:
        for name, channels, rate in STREAMS:
            samples = signal(random, channels, rate)
            samples.astype("<f8").tofile(Path(folder) / f"{name}_{channels}_{rate}.f64")
            frames.append((rate, pd.DataFrame(samples)))
        mine, peer = [], []
        for _ in range(ROUNDS):
            mine.append(ours(program, folder, WINDOWS_SECS))
            peer.append(theirs(frames))
        each = {secs: ours(program, folder, [secs]) for secs in WINDOWS_SECS}
    share = min(mine) / SECS
    met = share <= BAR
    hour_secs = 3600 * share
    ratio = min(peer) / min(mine)
    print(
        f"{'pass' if met else 'FAIL'}  statistics of an operator's streams over 30, 60 and 300 s: "
        f"{hour_secs:.2f} s per hour, {share:.3%} of a core (bar {BAR:.1%}); {ratio:.1f} times as fast as "
        "pandas without MAD and slope"
    )
    alone = ", ".join(f"{secs} s {took / SECS:.3%}" for secs, took in each.items())
    print(f"info  statistics of an operator's streams over one window alone: {alone}")
    sys.exit(0 if met else 1)


main()
