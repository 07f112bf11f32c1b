"""Recordings of real people, played as their streams through the graph: features are those of
independent tools, where the method is the same, and near them where it is another."""

import json

import numpy as np
import pytest
from scipy import signal

import bags
import harness
import recorded
import tables
from recorded import Signal

DATA = harness.TESTS / "data"
# Whole recordings, as far as they fill seconds.
WINDOWS_SECS = {"lab": 149, "open": 241, "closed": 305, "openbci": 89, "myo": 60, "e4": 24}
STUDY = f"""
[session]
name = "recorded"
[features]
windows_secs = {sorted(WINDOWS_SECS.values())}
[[sinks]]
type = "bag"
"""
BANDS = {"Delta": (1, 4), "Theta": (4, 8), "Alpha": (8, 13), "Beta": (13, 30), "Gamma": (30, 45)}
# Of Cyton's channels, those in which no stretch is too poor to be used: a jaw is clenched.
UNTOUCHED = (0, 1, 3, 6, 7)
EYES = ("closed", "open")
EEG_HZ, MYO_HZ, LAB_HZ, OPENBCI_HZ = 125, 200, 100, 250


def table(name: str, **options) -> np.ndarray:
    return np.loadtxt(DATA / name, **{"delimiter": ",", **options})


def golden(name: str) -> dict:
    return json.loads((DATA / f"golden/{name}.json").read_text())


def lab() -> list[Signal]:
    """ECG, skin conductance and breath of a person in a laboratory."""
    ecg, eda, _, belt = table("multi_bio_100hz/bio_100Hz.csv", skiprows=1).T
    return [
        Signal("lab", "biopac", "ecg", LAB_HZ, {"ecg": "mV"}, ecg),
        Signal("lab", "biopac", "eda", LAB_HZ, {"eda": "uS"}, eda),
        Signal("lab", "biopac", "respiration", LAB_HZ, {"belt": "1"}, belt),
    ]


def wristband() -> list[Signal]:
    """An Empatica E4, which someone held rather than wore."""

    def column(name: str) -> np.ndarray:
        return table(f"e4_devicely/{name}.csv", skiprows=2)

    axes = {"x": "g", "y": "g", "z": "g"}
    return [
        Signal("wrist", "e4", "eda", 4, {"eda": "uS"}, column("EDA")),
        Signal("wrist", "e4", "temperature", 4, {"skin": "degC"}, column("TEMP")),
        Signal("wrist", "e4", "acceleration", 32, axes, column("ACC") / 64),
    ]


def myo(gesture: int) -> np.ndarray:
    return table(f"myo_emg/10000-1_gesture{gesture}.txt")


def muscles() -> list[Signal]:
    """A Myo at rest, and while a hand is extended again and again."""
    channels = {f"emg{number}": "1" for number in range(8)}
    return [
        Signal(f"gesture{gesture}", "myo", "emg", MYO_HZ, channels, myo(gesture)[:, :8])
        for gesture in (0, 2)
    ]


def eyes(which: str) -> np.ndarray:
    return table(f"eeg_eyes/eeg_eyes_{which}_125hz.txt", comments="#", delimiter=None)


def openbci() -> np.ndarray:
    name = "eeg_openbci/OpenBCI_GUI-v6-blinks-jawClench-alpha.txt"
    path, columns = DATA / name, range(1, 9)
    return np.genfromtxt(path, delimiter=",", comments="%", skip_header=5, usecols=columns)


def heads() -> list[Signal]:
    """EEG with eyes closed and open, and of eight channels with blinks and a clenched jaw."""
    channels = {f"EXG{number}": "uV" for number in range(8)}
    return [
        *(Signal(each, "eeg", "eeg", EEG_HZ, {"O1": "uV"}, eyes(each)) for each in EYES),
        Signal("openbci", "cyton", "eeg", OPENBCI_HZ, channels, openbci()),
    ]


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """All of them at once, replayed."""
    stage = harness.Stage(tmp_path_factory.mktemp("recorded"), 93)
    people = lab() + wristband() + muscles() + heads()
    recording = recorded.write(people, stage.folder / "recording.mcap")
    study, out = stage.study(STUDY), stage.folder / "out"
    answer = stage.ask("replay", recording, "--study", study, "--out", out)
    assert answer.returncode == 0, answer.stderr
    return harness.the_bag(out)


@pytest.fixture(scope="module")
def features(bag):
    """The newest full window of a feature of a stream: its numbers by name, and reasons where none."""
    described = tables.described(bag)

    def of(stream: str, leaf: str, window_secs: int) -> dict:
        topic = f"/humans/persons/{stream}/{leaf}/w{window_secs}"
        newest = bags.messages(bag, topic)[-1].content
        values = zip(newest.values, newest.reasons, strict=True)
        shown = [float(value) if reason == 0 else f"reason {reason}" for value, reason in values]
        return dict(zip(described[topic].channels, shown, strict=True))

    return of


def happened_secs(bag, topic: str) -> np.ndarray:
    """When events were, after the beginning [s]."""
    stamps = (tables.stamp_ns(each) for each in bags.messages(bag, f"/humans/persons/{topic}"))
    return np.array([(stamp - recorded.BEGIN_NS) / 1e9 for stamp in stamps])


def test_beats_are_those_that_neurokit_finds(bag):
    ours = happened_secs(bag, "lab/biopac/ecg/beats")
    theirs = np.array(golden("bio100_ecg")["r_peaks"]) / LAB_HZ
    # A beat is reported when the signal has gone on for a while.
    theirs = theirs[theirs < 149]
    off_secs = np.abs(ours[:, None] - theirs).min(axis=0)
    assert np.mean(off_secs < 0.05) >= 0.99
    assert len(ours) <= 1.01 * len(theirs)


def test_intervals_vary_as_those_of_neurokit_s_beats(features):
    """Against NeuroKit's, whose beats lie on whole samples of 10 ms."""
    ours = features("lab/biopac/ecg", "heart", WINDOWS_SECS["lab"])
    theirs = golden("bio100_ecg")["hrv"]
    assert ours["HRV_MeanNN"] == pytest.approx(theirs["HRV_MeanNN"], rel=2e-3)
    assert ours["HRV_MedianNN"] == pytest.approx(theirs["HRV_MedianNN"], abs=10)
    assert ours["HRV_SDNN"] == pytest.approx(theirs["HRV_SDNN"], rel=0.05)
    assert ours["HRV_RMSSD"] == pytest.approx(theirs["HRV_RMSSD"], rel=0.05)
    assert ours["ECG_Rate_Mean"] == pytest.approx(60e3 / theirs["HRV_MeanNN"], abs=1)


def test_breath_is_as_fast_as_neurokit_says(features):
    ours = features("lab/biopac/respiration", "breath", WINDOWS_SECS["lab"])
    assert ours["RSP_Rate_Mean"] == pytest.approx(golden("bio100_rsp")["nk_rate_mean"], abs=0.5)


def test_every_response_that_neurokit_finds_is_found(bag, features):
    """Both by a threshold, on phasic parts by other filters: theirs relative, ours of 0.05 uS."""
    theirs = golden("bio100_eda")
    onsets, peaks = (theirs["nk_default"][f"SCR_{each}"] for each in ("Onsets", "Peaks"))
    whole = [peak / theirs["analysis_fs"] for onset, peak in zip(onsets, peaks) if onset]
    ours = happened_secs(bag, "lab/biopac/eda/responses")
    assert all(np.abs(ours - peak).min() < 0.25 for peak in whole)
    ours = features("lab/biopac/eda", "skin", WINDOWS_SECS["lab"])
    assert ours["EDA_Tonic_Mean"] == pytest.approx(theirs["tonic_mean"], rel=0.01)


@pytest.mark.parametrize("which", EYES)
def test_bands_are_welch_s(features, which):
    ours, theirs = features(f"{which}/eeg/eeg", "brain", WINDOWS_SECS[which]), golden_eyes(which)
    for band in BANDS:
        assert ours[f"EEG_{band}"] == pytest.approx(theirs[band.lower()], rel=1e-6), band
        assert ours[f"EEG_{band}Rel"] == pytest.approx(theirs["rel"][band.lower()], rel=1e-6)
    assert ours["EEG_Engagement"] == pytest.approx(theirs["engagement_beta_over_alpha_theta"], 1e-6)
    assert ours["EEG_ThetaAlpha"] == pytest.approx(theirs["theta_alpha"], rel=1e-6)


def golden_eyes(which: str) -> dict:
    return golden(f"eeg_eyes_{which}")


def test_alpha_is_higher_with_eyes_closed(features):
    closed, opened = (features(f"{each}/eeg/eeg", "brain", 241)["EEG_AlphaRel"] for each in EYES)
    assert closed > 1.5 * opened


def test_bands_of_eight_channels_are_welch_s(features):
    found = features("openbci/cyton/eeg", "brain", WINDOWS_SECS["openbci"])
    count = WINDOWS_SECS["openbci"] * OPENBCI_HZ
    for channel in UNTOUCHED:
        samples = openbci()[:count, channel]
        segment = dict(nperseg=4 * OPENBCI_HZ, noverlap=2 * OPENBCI_HZ)
        hz, power = signal.welch(samples, OPENBCI_HZ, "hann", detrend="constant", **segment)
        for band, (low_hz, high_hz) in BANDS.items():
            inside = (hz >= low_hz) & (hz <= high_hz)
            expected = np.trapezoid(power[inside], hz[inside])
            ours = found[f"EEG_{band}/EXG{channel}"]
            assert ours == pytest.approx(expected, rel=1e-6), (band, channel)


def test_muscles_are_as_loud_as_the_formulas_say(features):
    sections = signal.butter(4, [20, 95], "band", fs=MYO_HZ, output="sos")
    found = features("gesture2/myo/emg", "muscle", WINDOWS_SECS["myo"])
    count = WINDOWS_SECS["myo"] * MYO_HZ
    for channel, samples in enumerate(myo(2)[:count, :8].T):
        begin = signal.sosfilt_zi(sections) * samples[0]
        clean, _ = signal.sosfilt(sections, samples, zi=begin)
        frames = np.lib.stride_tricks.sliding_window_view(clean, MYO_HZ // 4)[:: MYO_HZ // 8]
        formulas = {
            "RMS": np.sqrt(np.mean(frames**2)),
            "MAV": np.mean(np.abs(frames)),
            "WL": np.mean(np.sum(np.abs(np.diff(frames)), axis=1)),
        }
        for name, each in formulas.items():
            ours = found[f"EMG_{name}/emg{channel}"]
            assert ours == pytest.approx(each, rel=1e-9), (name, channel)


def test_a_muscle_at_work_is_louder_than_at_rest(features):
    rest, work = (features(f"gesture{each}/myo/emg", "muscle", 60) for each in (0, 2))
    assert work["EMG_RMS/emg0"] > 1.5 * rest["EMG_RMS/emg0"]


def test_temperature_and_movement_are_summed_up_by_the_formulas(features):
    _, temperature, acceleration = wristband()
    secs = WINDOWS_SECS["e4"]
    readings = newest(temperature.samples, 4, secs)
    ours = features("wrist/e4/temperature", "skin_temperature", secs)
    assert ours["TEMP_Mean"] == pytest.approx(readings.mean(), rel=1e-9)
    assert ours["TEMP_SD"] == pytest.approx(readings.std(ddof=1), rel=1e-9)
    assert (ours["TEMP_Min"], ours["TEMP_Max"]) == (readings.min(), readings.max())
    strength = np.linalg.norm(newest(acceleration.samples, 32, secs), axis=1)
    ours = features("wrist/e4/acceleration", "movement", secs)
    assert ours["ACC_VM_Mean"] == pytest.approx(strength.mean(), rel=1e-9)
    assert ours["ACC_ENMO"] == pytest.approx(np.maximum(strength - 1, 0).mean(), rel=1e-9)


def newest(samples: np.ndarray, rate_hz: int, secs: int) -> np.ndarray:
    """The samples of the last window that ends at a whole second: known when a sample follows."""
    end = (len(samples) - 1) // rate_hz * rate_hz
    return samples[end - secs * rate_hz : end]


def test_of_skin_that_no_electrode_touches_nothing_is_computed(features):
    ours = features("wrist/e4/eda", "skin", WINDOWS_SECS["e4"])
    assert set(ours.values()) == {"reason 3"}
