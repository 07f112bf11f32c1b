"""The package ros2-foxy-wearable-biosensors, recorded and live: its plain numbers become signals of a person."""

import math
import time
from collections import Counter
from pathlib import Path

import bags
import harness
import numpy
import pytest
import tables
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_FOXY)
BEGIN_NS, SECS = 1_700_000_000_000_000_000, 90
SHIMMER_HZ = 32768 / 655


def message(kind, *fields):
    return STORE.types[f"std_msgs/msg/{kind}"](*fields)


def array(numbers):
    return message("Float32MultiArray", message("MultiArrayLayout", [], 0), numpy.array(numbers, dtype=numpy.float32))


def skin_us(secs):
    return 5 + math.sin(secs / 7)


def heard():
    """What its nodes publish: when [s], on which topic, what."""
    for k in range(SECS * 64):
        # The server hands the samples of an E4 over in packets.
        at = math.ceil(k / 64 / 0.25 + 1e-9) * 0.25 + k % 16 * 1e-4
        yield at, "empatica_e4/bvp", message("Float32", 50 * math.exp(-40 * (k / 64 % 0.8 - 0.4) ** 2))
    for k in range(SECS * 4):
        yield k / 4, "empatica_e4/gsr", message("Float32", skin_us(k / 4))
    for k in range(SECS * 32):
        yield k / 32, "empatica_e4/acc", array([0, 32, 64])
    for k in range(int(SECS * SHIMMER_HZ)):
        at = k / SHIMMER_HZ
        yield at, "shimmer3_gsr/gsr", message("Float32", 1e3 / skin_us(at))
        yield at, "shimmer3_gsr/gsr_chunk", array([1.0])
    for k in range(SECS):
        interval = 850 if k % 2 else 700
        yield k + 0.0010, "polar_h10/hr", message("Int32", 72)
        yield k + 0.0015, "polar_h10/ibi", message("Int32", interval & 0xFF)
        yield k + 0.0020, "polar_h10/dev", message("Int32", interval >> 8)
        yield k, "emotiv_insight/eeg", array([k % 128, 0, 4201, 4202, 4203, 4204, 4205, 1])
    yield 30.5, "empatica_e4/tag", message("Empty")


@pytest.fixture
def theirs(stage):
    path = stage.folder / "theirs"
    with Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {}
        for secs, topic, content in sorted(heard(), key=lambda each: each[0]):
            kind = content.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(f"/biosensors/{topic}", kind, typestore=STORE)
            writer.write(connections[topic], BEGIN_NS + round(secs * 1e9), STORE.serialize_cdr(content, kind))
    return path


def values(bag, topic):
    return [each.content.values for each in bags.messages(bag, f"/humans/persons/p003{topic}")]


def test_wearables_of_others_become_signals_of_a_person(stage, theirs):
    done = stage.ask("import", theirs, "--person", "p003", "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    assert "/humans/persons/p003/empatica_e4/eda" in done.stdout and "from /biosensors/empatica_e4/gsr" in done.stdout
    bag = Path(done.stdout.splitlines()[-1])
    person = "/humans/persons/p003"
    described = tables.described(bag)
    counts = bags.counts(bag)
    # What was recorded stays.
    for topic, count in Counter(topic for _, topic, _ in heard()).items():
        assert counts[f"/biosensors/{topic}"] == count, topic
    # A resistance [kOhm] became a conductance, as a wristband has it.
    for device, rate in [("empatica_e4", 4), ("shimmer3_gsr", SHIMMER_HZ)]:
        stream = described[f"{person}/{device}/eda"]
        assert (list(stream.units), stream.signal) == (["uS"], "eda")
        assert stream.rate_hz == pytest.approx(rate)
        for (value,), k in zip(values(bag, f"/{device}/eda"), range(100)):
            assert value == pytest.approx(skin_us(k / rate), rel=1e-5)
    assert set(map(tuple, values(bag, "/empatica_e4/acceleration"))) == {(0.0, 0.5, 1.0)}
    # The two bytes that were published apart are intervals again.
    intervals = [each for (each,) in values(bag, "/polar_h10/rr_interval")]
    assert len(intervals) == SECS
    assert set(intervals) == {850 * 1000 / 1024, 700 * 1000 / 1024}
    assert list(described[f"{person}/emotiv_insight/eeg"].channels) == ["AF3", "T7", "Pz", "T8", "AF4"]
    assert tuple(values(bag, "/emotiv_insight/eeg")[0]) == (4201, 4202, 4203, 4204, 4205)
    [tag] = bags.messages(bag, f"{person}/empatica_e4/events")
    assert (tag.content.kind, tag.content.label) == ("marker", "tag")
    assert any(name.endswith("/empatica_e4/bvp/pulse/w30") for name in counts), sorted(counts)


def test_the_packets_of_a_wristband_are_spread_over_their_time(stage, theirs):
    done = stage.ask("import", theirs, "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    pulse = bags.messages(Path(done.stdout.splitlines()[-1]), "/humans/persons/p001/empatica_e4/bvp")
    at = [tables.stamp_ns(each) / 1e9 for each in pulse]
    # Once the clock has settled, samples are a 64th of a second apart, not a packet.
    steps = numpy.diff(at[64 * 40 :])
    assert abs(steps - 1 / 64).max() < 2e-3


LIVE = """
[session]
name = "live"
[[sources]]
type   = "biosensors"
person = "p003"
[[sinks]]
type = "bag"
tidy = false
"""


def cdr(content) -> str:
    return STORE.serialize_cdr(content, content.__msgtype__).hex()


def test_wearables_of_others_are_read_live(stage):
    kinds = {
        "shimmer3_gsr/gsr": "Float32",
        "empatica_e4/acc": "Float32MultiArray",
        "polar_h10/ibi": "Int32",
        "polar_h10/dev": "Int32",
        "empatica_e4/tag": "Empty",
    }
    out = stage.folder / "sessions"
    study = stage.study(LIVE)
    checked = stage.ask("check", study, "--out", out)
    assert checked.returncode != 0
    assert "no topic /biosensors/<sensor>/<data> is published" in checked.stdout + checked.stderr
    monitor = stage.teampulse("run", study, "--out", out)
    nodes = {
        topic: stage.cyclone("send", f"/biosensors/{topic}", "--type", f"std_msgs/msg/{kind}")
        for topic, kind in kinds.items()
    }
    for node in nodes.values():
        node.answer("matched")
    # A writer sees its reader before the reader sees it.
    time.sleep(2)
    count, intervals = 200, [850, 700]
    for k in range(count):
        nodes["shimmer3_gsr/gsr"].say(cdr(message("Float32", 1e3 / skin_us(k / 50))))
        nodes["empatica_e4/acc"].say(cdr(array([0, 32, 64])))
        if k % 50 == 0:
            interval = intervals[k // 50 % 2]
            nodes["polar_h10/ibi"].say(cdr(message("Int32", interval & 0xFF)))
            nodes["polar_h10/ibi"].answer("sent")
            time.sleep(0.05)
            nodes["polar_h10/dev"].say(cdr(message("Int32", interval >> 8)))
        time.sleep(0.02)
    nodes["empatica_e4/tag"].say(cdr(message("Empty")))
    for topic in ("shimmer3_gsr/gsr", "empatica_e4/acc"):
        harness.eventually(lambda: nodes[topic].answer("sent")["sent"] == count)
    monitor.wait_for("empatica_e4/events ok")
    assert monitor.interrupt() in (0, 3), monitor.report()

    bag = harness.the_bag(out)
    skin = [each for (each,) in values(bag, "/shimmer3_gsr/eda")]
    assert skin == pytest.approx([skin_us(k / 50) for k in range(count)], rel=1e-5)
    assert set(map(tuple, values(bag, "/empatica_e4/acceleration"))) == {(0.0, 0.5, 1.0)}
    read = [each for (each,) in values(bag, "/polar_h10/rr_interval")]
    assert read == [each * 1000 / 1024 for each in intervals * 2]
    [tag] = bags.messages(bag, "/humans/persons/p003/empatica_e4/events")
    assert (tag.content.kind, tag.content.label) == ("marker", "tag")
    described = tables.described(bag)
    assert list(described["/humans/persons/p003/shimmer3_gsr/eda"].units) == ["uS"]
    # What they had published is only in the streams of the person.
    assert not any(topic.startswith("/biosensors") for topic in bags.counts(bag))
