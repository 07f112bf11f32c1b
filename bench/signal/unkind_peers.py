"""Writes the beats that other programs find in the signals of `bench-signal unkind write`, one line each."""

import csv
import sys
import warnings
from pathlib import Path

import neurokit2 as nk
import numpy as np

warnings.filterwarnings("ignore")


def ecg(signal, rate):
    """Returns the beats of NeuroKit2's default and Khamis (UNSW), and of sleepecg and HeartPy if they are installed."""
    clean = nk.ecg_clean(signal, sampling_rate=rate)
    yield "neurokit2", nk.ecg_findpeaks(clean, sampling_rate=rate)["ECG_R_Peaks"]
    khamis = nk.ecg_clean(signal, sampling_rate=rate, method="khamis2016")
    yield "khamis2016", nk.ecg_findpeaks(khamis, sampling_rate=rate, method="khamis2016")["ECG_R_Peaks"]
    import sleepecg

    yield "sleepecg", sleepecg.detect_heartbeats(signal, rate)
    from wfdb.processing import xqrs_detect

    yield "xqrs", xqrs_detect(signal, rate, verbose=False)


def ppg(signal, rate):
    """Returns the beats of NeuroKit2's default (Elgendi; its Charlton uses unbounded memory) and of HeartPy."""
    clean = nk.ppg_clean(signal, sampling_rate=rate)
    yield "neurokit2", nk.ppg_findpeaks(clean, sampling_rate=rate)["PPG_Peaks"]
    import heartpy

    working, _ = heartpy.process(signal, rate)
    removed = set(working["removed_beats"])
    yield "heartpy", [peak for peak in working["peaklist"] if peak not in removed]


def found(programs):
    while True:
        try:
            yield next(programs)
        except StopIteration:
            return
        except Exception as error:  # a program that fails finds nothing
            print(error, file=sys.stderr)
            return


folder = Path(sys.argv[1])
with open(folder / "signals.csv") as table, open(folder / "beats.csv", "w") as out:
    for row in csv.DictReader(table):
        rate = float(row["rate_hz"])
        signal = np.fromfile(folder / f"{row['number']}.f64")
        places = np.arange(len(signal))
        usable = np.isfinite(signal)
        signal = np.interp(places, places[usable], signal[usable])
        rate = int(rate) if rate.is_integer() else rate
        programs = ppg(signal, rate) if row["ppg"] == "1" else ecg(signal, rate)
        for name, beats in found(programs):
            times = ",".join(f"{beat / rate:.4f}" for beat in beats)
            print(f"{row['number']},{name},{times}", file=out)
