"""A device's fixed latency comes out of an event that two streams saw."""

import json
import math
import random

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

BEGIN_NS = 1_800_000_000_000_000_000
TAPS_SECS = [3.0013, 5.2128, 6.9407, 9.6251, 12.0079]
LATENCY_SECS = 0.080
LASTS_SECS = 15
RATE_HZ = 100

STUDY = """# Our straps
[session]
name = "taps"       # short

[clocks.polar_h10]  # on the chest
wraps_secs   = 512  # counter
latency_secs = 1e-2

[[sinks]]
type = 'bag'
"""

store = get_typestore(Stores.ROS2_JAZZY)
Time, Header, Vector3, Quaternion, Imu, String = (
    store.types[name]
    for name in [
        "builtin_interfaces/msg/Time",
        "std_msgs/msg/Header",
        "geometry_msgs/msg/Vector3",
        "geometry_msgs/msg/Quaternion",
        "sensor_msgs/msg/Imu",
        "std_msgs/msg/String",
    ]
)


def imu(time_ns: int, acceleration: list[float]):
    header = Header(Time(time_ns // 10**9, time_ns % 10**9), "strap")
    no_covariance = np.zeros(9)
    still = Vector3(0.0, 0.0, 0.0)
    return Imu(
        header, Quaternion(0.0, 0.0, 0.0, 1.0), no_covariance, still, no_covariance,
        Vector3(*acceleration), no_covariance,
    )  # fmt: skip


def accelerations(taps: list[float]):
    """Time [ns] and acceleration [m/s²] of a strap that stamps late."""
    chance = random.Random(5)
    for k in range(LASTS_SECS * RATE_HZ):
        secs = k / RATE_HZ
        since = [secs - tap for tap in taps if secs >= tap]
        blow = sum(20 * math.exp(-each / 0.03) for each in since)
        noise = [chance.gauss(0, 0.05) for _ in range(3)]
        late_ns = BEGIN_NS + round((secs + LATENCY_SECS) * 1e9)
        yield late_ns, [noise[0] + blow, noise[1] - blow / 2, 9.81 + noise[2]]


@pytest.fixture
def taps_bag(stage):
    return bag_of(stage.folder / "taps", TAPS_SECS)


def bag_of(path, taps: list[float]):
    """A bag of a strap and of a button, not written by us. Everything arrives in disorder."""
    chance = random.Random(6)
    messages = [("/strap/imu", at, imu(at, each)) for at, each in accelerations(taps)]
    for tap in TAPS_SECS:
        at = BEGIN_NS + round(tap * 1e9)
        messages.append(("/button", at, String("pressed")))
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            "/strap/imu": writer.add_connection("/strap/imu", Imu.__msgtype__, typestore=store),
            "/button": writer.add_connection("/button", String.__msgtype__, typestore=store),
        }
        delayed = [
            (at + (round(chance.uniform(0, 3e7)) if topic == "/strap/imu" else 0), topic, message)
            for topic, at, message in messages
        ]
        for at, topic, message in sorted(delayed, key=lambda each: each[0]):
            connection = connections[topic]
            writer.write(connection, at, store.serialize_cdr(message, connection.msgtype))
    return path


def calibrate(stage, bag, *arguments, stream="/strap/imu:linear_acceleration"):
    return stage.ask("calibrate", bag, "--reference", "/button", "--stream", stream, *arguments)


def test_the_latency_is_found_within_five_milliseconds(stage, taps_bag, figure):
    answer = calibrate(stage, taps_bag, "--json")
    assert answer.returncode == 0, answer.stderr
    found = json.loads(answer.stdout)
    error_secs = found["latency_secs"] - LATENCY_SECS
    stated_ms = 1e3 * found["uncertainty_secs"]
    figure(f"calibrate: 80 ms found {1e3 * error_secs:+.1f} ms off, stated ± {stated_ms:.1f} ms")
    assert abs(error_secs) <= 0.005
    assert abs(error_secs) <= found["uncertainty_secs"] <= 0.02
    assert (found["events"], found["device"], found["doubt"]) == (5, "imu", None)
    assert found["correlation"] > 0.5 > found["next_correlation"]


def test_what_is_printed_are_the_lines_of_a_study(stage, taps_bag):
    answer = calibrate(stage, taps_bag, "--device", "polar_h10")
    assert answer.returncode == 0, answer.stderr
    head, _, lines = answer.stdout.partition("\n\n")
    assert "5 events" in head
    watched = '\n[[sources]]\ntype = "robots"\n'
    study = stage.study(STUDY.replace("[clocks.polar_h10]", "[clocks.other]") + lines + watched)
    assert stage.ask("check", study).returncode != 4


def test_writing_changes_one_table_and_nothing_else(stage, taps_bag):
    study = stage.study(STUDY)
    answer = calibrate(stage, taps_bag, "--device", "polar_h10", "--write", study)
    assert answer.returncode == 0, answer.stderr
    before, after = STUDY.splitlines(), study.read_text().splitlines()
    assert [line for line in after if line not in before and "_secs" not in line] == []
    assert [line for line in before if line not in after] == ["latency_secs = 1e-2"]
    assert len(after) == len(before) + 1
    assert any(line.startswith("latency_secs = 0.0") for line in after)
    assert any(line.startswith("uncertainty_secs = 0.0") for line in after)


def test_a_part_of_the_recording_is_enough(stage, taps_bag):
    answer = calibrate(stage, taps_bag, "--from", 4, "--to", 8, "--json")
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout)["events"] == 2


def test_a_poor_result_is_not_written(stage):
    bag = bag_of(stage.folder / "other_taps", [TAPS_SECS[0], 4.1, 5.9, 8.2, 10.8, 13.4])
    study = stage.study(STUDY)
    answer = calibrate(stage, bag, "--max-lag", 0.3, "--write", study)
    assert answer.returncode == 1
    assert "hint:" in answer.stderr
    assert study.read_text() == STUDY


@pytest.mark.parametrize(
    ("stream", "word"),
    [
        ("/strap/imv", "/strap/imu"),
        ("/strap/imu", "/strap/imu:"),
        ("/strap/imu:linear_accelaration.x", "linear_acceleration.x"),
        ("/strap/imu:angular_velocity", "noise"),
    ],
    ids=["no such stream", "no field", "no such field", "nothing happens"],
)
def test_what_makes_no_sense_is_refused_with_a_hint(stage, taps_bag, stream, word):
    study = stage.study(STUDY)
    answer = calibrate(stage, taps_bag, "--write", study, stream=stream)
    assert answer.returncode == 1, answer.stderr
    assert answer.stderr.startswith("error: ")
    assert word in answer.stderr
    assert "panicked" not in answer.stderr
    assert answer.stdout == ""
    assert study.read_text() == STUDY


def test_a_study_with_a_mistake_is_left_as_it_is(stage, taps_bag):
    text = STUDY + "[sesion]\n"
    study = stage.study(text)
    answer = calibrate(stage, taps_bag, "--write", study)
    assert answer.returncode == 4
    assert study.read_text() == text


def test_no_bag_is_refused(stage):
    answer = calibrate(stage, stage.folder / "nowhere")
    assert answer.returncode == 1
    assert "nowhere" in answer.stderr


def test_beats_have_the_latency_of_the_ecg_that_they_come_from(stage, demo_bag):
    reference, beats = "/humans/persons/p001/truth/beats", "/humans/persons/p001/polar_h10/ecg/beats"
    answer = stage.ask("calibrate", demo_bag, "--reference", reference, "--stream", beats, "--json")
    found = json.loads(answer.stdout)
    assert found["recorded_latency_secs"] == 0.05, found
    assert abs(found["latency_secs"] - 0.05 - found["lag_secs"]) < 1e-4, found
