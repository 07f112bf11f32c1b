"""Programs that others wrote read the emulated Bluetooth devices as they read real ones through BlueZ."""

import json
import os
import socket
import statistics
import subprocess
import sys

import harness
import pytest

PEER_SECS = 120
POLAR_PEER = [sys.executable, harness.TESTS / "peers/polar_peer.py", "Polar H10 1A000001"]
VERITY_PEER = [sys.executable, harness.TESTS / "peers/verity_peer.py", "Polar Sense 1A000003"]
# dl-myo needs an older bleak than the others.
MYO_PEER = [harness.ROOT / ".venv-myo/bin/python", harness.TESTS / "peers/myo_peer.py"]

STUDY = """
[session]
name = "emulated"
[[simulate.wearables]]
type    = "{type}"
person  = "p001"
address = "{address}"
"""


def read(stage, type: str, address: str, peer: list) -> dict:
    """What a program reads of an emulated device that a simulated person wears."""
    study = stage.study(STUDY.format(type=type, address=address))
    emulation = stage.teampulse("emulate", study)
    bus = emulation.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=(\S+)", pipe="stdout")[1]
    env = {**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": bus}
    ran = subprocess.run(
        list(map(str, peer)), env=env, capture_output=True, text=True, timeout=PEER_SECS
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert emulation.interrupt() == 0, emulation.report()
    return json.loads(ran.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def polar(tmp_path_factory):
    stage = harness.Stage(tmp_path_factory.mktemp("polar"), 99)
    yield read(stage, "polar_h10", "A0:9E:1A:00:00:01", POLAR_PEER)
    stage.close()


def r_waves(frames: list) -> list:
    """The times (s) and heights (µV) of R waves: the highest samples of what is above half of the highest."""
    samples = [value for _, values in frames for value in values]
    half = max(samples) / 2
    tops, above = [], []
    for at, value in enumerate(samples):
        if value > half:
            above.append((value, at))
        elif above:
            height, at = max(above)
            tops.append((at / 130, height))
            above = []
    return tops


def test_bleakheart_is_offered_what_an_h10_offers(polar):
    heard = polar["bleakheart"]
    assert heard["battery"] == 87
    assert heard["settings"]["ECG"]["SAMPLE_RATE"] == [130]
    assert heard["settings"]["ECG"]["RESOLUTION"] == [14]
    assert heard["settings"]["ACC"]["SAMPLE_RATE"] == [25, 50, 100, 200]
    assert heard["settings"]["ACC"]["RANGE"] == [2, 4, 8]
    assert heard["starts"] == heard["stops"] == [0, 0]


def test_every_interval_arrives_also_two_in_one_packet(polar):
    measurements = [values for _, values in polar["bleakheart"]["HR"]]
    intervals_ms = [interval for _, intervals in measurements for interval in intervals]
    # In steps of 1/1024 s, of which bleakheart keeps whole ms and polar-python everything.
    exact_ms = [interval for _, found in polar["polar_python"]["HR"] for interval in found]
    steps = [interval_ms * 1024 / 1000 for interval_ms in exact_ms]
    assert steps and all(abs(step - round(step)) < 1e-6 for step in steps), steps
    assert max(len(intervals) for _, intervals in measurements) >= 2
    # A measurement a second: their intervals fill the time, but for the one that was going on.
    filled_secs = sum(interval for _, found in measurements[1:] for interval in found) / 1000
    assert abs(filled_secs - (len(measurements) - 1)) <= max(intervals_ms) / 1000
    for rate, intervals in measurements[1:]:
        assert not intervals or abs(rate - 60000 / intervals[-1]) < 1


def test_the_ecg_has_the_amplitude_and_the_beats_of_the_heart_rate(polar):
    frames = polar["bleakheart"]["ECG"]
    assert all(len(values) == 73 for _, values in frames)
    samples = [value for _, values in frames for value in values]
    assert 500 < max(samples) < 4000 and -2000 < min(samples) < 0  # microvolts
    between = statistics.mean(b - a for (a, _), (b, _) in zip(frames, frames[1:]))
    assert abs(between / 1e9 - 73 / 130) < 1e-3
    tops = [secs for secs, _ in r_waves(frames)]
    seen_ms = [1000 * (b - a) for a, b in zip(tops, tops[1:])]
    reported_ms = [interval for _, (_, found) in polar["bleakheart"]["HR"] for interval in found]
    # Each that was seen whole is among those that were reported, to two samples.
    assert len(seen_ms) >= 5
    for interval_ms in seen_ms[1:-1]:
        assert min(abs(interval_ms - reported) for reported in reported_ms) < 2000 / 130


def test_acceleration_is_that_of_a_person_upright_or_lying(polar):
    samples = [sample for _, values in polar["bleakheart"]["ACC"] for sample in values]
    length = statistics.median(sum(axis**2 for axis in sample) ** 0.5 for sample in samples)
    assert 900 < length < 1100  # mg


def test_polar_python_reads_the_same_heart(polar):
    heard = polar["polar_python"]
    assert heard["features"] == ["ECG", "ACC"]
    assert all(len(values) == 73 for _, values in heard["ECG"])
    # The usual height: an ectopic beat, which only one of them may see, is half as high again.
    both = [statistics.median(height for _, height in r_waves(polar[peer]["ECG"]))
            for peer in ("bleakheart", "polar_python")]
    assert 0.9 < both[0] / both[1] < 1.1
    assert all(30 < rate < 200 for rate, intervals in heard["HR"] if intervals)


def test_polar_python_reads_light_movement_and_pulses_of_a_verity_sense(stage):
    heard = read(stage, "polar_verity_sense", "A0:9E:1A:00:00:03", VERITY_PEER)
    assert heard["features"] == ["PPG", "ACC", "PPI"]
    ppg = {"SAMPLE_RATE": [55], "RESOLUTION": [22], "CHANNELS": [4]}
    acc = {"SAMPLE_RATE": [52], "RESOLUTION": [16], "RANGE": [8], "CHANNELS": [3]}
    assert heard["settings"] == {"PPG": ppg, "ACC": acc}
    # What is between two frames is as many samples as the later one has.
    for kind, rate_hz in (("PPG", 55), ("ACC", 52)):
        frames = heard[kind]
        assert len(frames) > 10
        for (before, _), (after, samples) in zip(frames, frames[1:]):
            assert abs((after - before) / 1e9 - len(samples) / rate_hz) < 1e-3, kind
    light = [sample for _, samples in heard["PPG"] for sample in samples]
    assert all(100_000 < value < 800_000 for sample in light for value in sample)
    assert len({green for green, *_ in light}) > len(light) / 4  # no constant
    moved = [sample for _, samples in heard["ACC"] for sample in samples]
    length = statistics.median(sum(axis**2 for axis in sample) ** 0.5 for sample in moved)
    assert 900 < length < 1100  # mg
    pulses = [pulse for frame in heard["PPI"] for pulse in frame]
    for frame in heard["PPI"]:
        assert 3 < sum(pulse["ppi"] for pulse in frame) / 1000 < 7  # spans of 5 s
    assert all(pulse["skin_contact_status"] and not pulse["invalid_ppi"] for pulse in pulses)
    assert all(abs(pulse["hr"] - 60000 / pulse["ppi"]) < 1 for pulse in pulses)
    # The light's pulses are as far apart as the intervals say: the two are of one heart.
    mean_ms = statistics.mean(pulse["ppi"] for pulse in pulses)
    assert abs(pulse_secs([green for green, *_ in light], 55) * 1000 / mean_ms - 1) < 0.15
    # The service of the heart rate has no intervals.
    assert heard["HR"] and all(not intervals for _, intervals in heard["HR"])


def pulse_secs(light: list, rate_hz: float) -> float:
    """The mean time between the waves of a pulse: where its autocorrelation is highest."""
    smooth = [statistics.mean(light[at : at + 5]) for at in range(len(light) - 5)]
    slope = [b - a for a, b in zip(smooth, smooth[1:])]
    lags = range(round(0.45 * rate_hz), round(1.5 * rate_hz))
    return max(lags, key=lambda lag: sum(a * b for a, b in zip(slope, slope[lag:]))) / rate_hz


def test_dl_myo_reads_muscles_and_movement(stage):
    heard = read(stage, "myo", "D2:3B:85:94:32:8E", MYO_PEER)
    samples = [sample for pair in heard["emg"] for sample in pair]
    assert all(len(sample) == 8 and all(-128 <= v <= 127 for v in sample) for sample in samples)
    assert len({tuple(sample) for sample in samples}) > len(samples) / 4  # no constant
    # 200 samples and 50 of the IMU a second.
    assert 3 < len(samples) / len(heard["imu"]) < 5


def listens(address: str) -> bool:
    """Whether anything answers at the address of a D-Bus."""
    path = address.removeprefix("unix:path=").split(",")[0]
    with socket.socket(socket.AF_UNIX) as link:
        return link.connect_ex(path) == 0


@pytest.mark.parametrize("end", ["interrupt", "kill"])
def test_its_bus_ends_with_it_however_it_ends(stage, end):
    study = stage.study(STUDY.format(type="heart_rate", address="A0:9E:1A:00:00:02"))
    emulation = stage.teampulse("emulate", study)
    bus = emulation.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=(\S+)", pipe="stdout")[1]
    assert listens(bus)
    getattr(emulation, end)()
    harness.eventually(lambda: not listens(bus))


def test_the_printed_bus_is_found_from_other_folders(stage):
    study = stage.study(STUDY.format(type="heart_rate", address="A0:9E:1A:00:00:09"))
    simulation = stage.teampulse("simulate", study, "--wearables", "buses")
    bus = simulation.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=unix:path=([^,\s]+)", pipe="stdout")[1]
    assert os.path.isabs(bus) and os.path.samefile(bus, stage.folder / "buses/bus")
    assert simulation.interrupt() == 0, simulation.report()
