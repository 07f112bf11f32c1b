"""One table of many streams: the same from a run and its replays, honest where a source is silent."""

import csv
import json

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import bags
import harness

BEGIN_NS = 1_800_000_000_000_000_000
GRID_HZ = 10
SILENT_FROM_SECS, SILENT_UNTIL_SECS, LASTS_SECS = 60, 360, 420
# The idle time-out of the table [s].
IDLE_SECS = 2

store = get_typestore(Stores.ROS2_JAZZY)
Time, Header, Temperature = (
    store.types[name]
    for name in ["builtin_interfaces/msg/Time", "std_msgs/msg/Header", "sensor_msgs/msg/Temperature"]
)


def temperature(time_ns: int, value: float):
    header = Header(Time(time_ns // 10**9, time_ns % 10**9), "")
    return Temperature(header, value, 0.0)


def two_streams(path):
    """A bag of two streams that measure the time; one of them is silent for five minutes."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kind = Temperature.__msgtype__
        topics = {
            name: writer.add_connection(name, kind, typestore=store)
            for name in ["/r1/steady", "/r2/dies"]
        }
        for k in range(LASTS_SECS * 10):
            secs = k / 10
            at = BEGIN_NS + round(secs * 1e9)
            alive = not SILENT_FROM_SECS <= secs < SILENT_UNTIL_SECS
            for topic in ["/r1/steady"] + (["/r2/dies"] if alive else []):
                message = store.serialize_cdr(temperature(at, secs), kind)
                writer.write(topics[topic], at + 5_000_000, message)
    return path


def aligned(stage, bag, *arguments) -> bytes:
    out = stage.folder / f"table_{len(list(stage.folder.iterdir()))}"
    answer = stage.ask("export", bag, "--out", out, *arguments)
    assert answer.returncode == 0, answer.stderr
    return (out / "aligned.csv").read_bytes()


def rows(table: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(table.decode().splitlines()))


def test_a_source_that_dies_for_five_minutes_stops_no_row(stage, figure):
    table = rows(aligned(stage, two_streams(stage.folder / "bag"), "--grid", GRID_HZ))
    times = [float(row["unix_secs"]) - BEGIN_NS / 1e9 for row in table]
    steps = [round((b - a) * GRID_HZ, 3) for a, b in zip(times, times[1:])]
    assert set(steps) == {1.0}, "rows go on"
    assert len(table) >= LASTS_SECS * GRID_HZ - 1
    steady = {row["/r1/steady:validity"] for row in table[1:-1]}
    assert steady == {"fresh"}, "nothing else is lost"
    worst = max(
        abs(float(row["/r1/steady:temperature"]) - at) for row, at in zip(table[1:-1], times[1:-1])
    )
    assert worst < 0.010
    silent = [
        row["/r2/dies:validity"]
        for row, at in zip(table, times)
        if SILENT_FROM_SECS + IDLE_SECS < at < SILENT_UNTIL_SECS - 1
    ]
    assert set(silent) <= {"stale", "gap"} and "stale" in silent, set(silent)
    back = next(
        at for row, at in zip(table, times)
        if at > SILENT_UNTIL_SECS - 1 and row["/r2/dies:validity"] == "fresh"
    )  # fmt: skip
    figure(f"a source that was silent for five minutes is used again after {back - SILENT_UNTIL_SECS:.1f} s (bar 1)")
    assert back <= SILENT_UNTIL_SECS + 1


def test_a_slow_stream_is_waited_for_as_long_as_its_policy_looks_back(stage):
    kind, path = Temperature.__msgtype__, stage.folder / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {
            name: writer.add_connection(name, kind, typestore=store) for name in ["/fast", "/slow"]
        }
        for k in range(1200):
            at = BEGIN_NS + k * 10**8
            for topic in ["/fast"] + (["/slow"] if k % 100 == 0 else []):
                writer.write(topics[topic], at, store.serialize_cdr(temperature(at, k / 10), kind))
    for policy, values in [("hold:60s", {"held", "fresh"}), ("linear:60s", {"fresh"})]:
        table = rows(aligned(stage, path, "--grid", 1, "--policy", policy))
        seen = {row["/slow:validity"] for row in table[1:110]}
        assert seen <= values, f"{policy}: {seen}"


def test_a_table_is_the_same_from_a_run_and_from_its_replay(demo_bag, stage):
    original = aligned(stage, demo_bag, "--grid", 64, "--stream", "/robot*/**")
    answer = stage.ask("replay", demo_bag, "--out", stage.folder / "replay")
    assert answer.returncode == 0, answer.stderr
    again = aligned(
        stage, harness.the_bag(stage.folder / "replay"), "--grid", 64, "--stream", "/robot*/**"
    )
    assert original.count(b"\n") > 64 * 15
    assert original == again


def test_a_pivot_gives_a_row_for_each_of_its_samples(demo_bag, stage):
    odom = len(bags.messages(demo_bag, "/robot1/odom"))
    policies = ("--policy", "hold:5s", "--policy", "/robot2/odom=nearest:50ms")
    table = rows(aligned(stage, demo_bag, "--pivot", "/robot1/odom", *policies))
    assert 0 <= odom - len(table) <= 2
    near = [abs(float(row["/robot2/odom:age_secs"])) for row in table
            if row["/robot2/odom:validity"] == "fresh"]  # fmt: skip
    assert near and max(near) <= 0.050


def test_times_made_afterwards_keep_the_raw_content_and_are_marked(demo_bag, stage):
    answer = stage.ask("retime", demo_bag, "--out", stage.folder / "retimed")
    assert answer.returncode == 0, answer.stderr
    bag = harness.the_bag(stage.folder / "retimed")
    assert "## What is usable" in (bag / "summary.md").read_text()
    origins, before, after = bags.origins(demo_bag), bags.raw(demo_bag), bags.raw(bag)
    robots = [topic for topic in before if topic.startswith("/robot") and origins[topic] == "raw"]
    assert len(robots) > 10
    for topic in robots:
        assert before[topic] == after[topic], f"{topic}: content and log times stay"
    assert json.loads(stage.ask("info", bag, "--json").stdout)["two_sided"]
    assert not json.loads(stage.ask("info", demo_bag, "--json").stdout)["two_sided"]
    assert "times are two-sided" in stage.ask("info", bag).stdout
    again = stage.ask("retime", bag, "--out", stage.folder / "again")
    assert again.returncode == 1 and "already" in again.stderr


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--grid", "0"), "rate"),
        (("--grid", "nan"), "rate"),
        (("--grid", "10", "--policy", "spline:1s"), "expected"),
        (("--grid", "10", "--policy", "odom=hold:1s"), "pattern"),
        (("--grid", "10", "--stream", "/nobody/**"), "no matching streams"),
        (("--pivot", "/nobody/odom"), "/nobody/odom"),
    ],
)
def test_what_can_not_be_aligned_is_refused(demo_bag, stage, arguments, word):
    answer = stage.ask("export", demo_bag, "--out", stage.folder / "table", *arguments)
    assert answer.returncode in (1, 2)
    assert word in answer.stderr
    assert not (stage.folder / "table").exists()


def test_how_certain_times_are_stands_in_the_table_and_in_the_bag(demo_bag, stage):
    table = rows(aligned(stage, demo_bag, "--grid", 1, "--stream", "/robot1/odom"))
    stated = [row["/robot1/odom:uncertainty_secs"] for row in table]
    known = [float(each) for each in stated if each]
    assert len(known) > len(stated) / 2 and all(0 < each < 0.1 for each in known)
    info = json.loads(stage.ask("info", demo_bag, "--json").stdout)
    assert info
