"""Bags of ROS 1, through an independent writer: they become bags that an independent reader of ROS 2 reads alike."""

import json
from pathlib import Path

import numpy
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS1_NOETIC)
# As /tf was in ROS 1; ROS 2 has tf2_msgs/TFMessage.
TRANSFORMS = "tf/msg/tfMessage"
STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
BEGIN_NS, COUNT = 1_700_000_000_000_000_000, 300


def of(name, *fields):
    return STORE.types[name](*fields)


def header(k, at_ns):
    return of("std_msgs/msg/Header", k, of("builtin_interfaces/msg/Time", at_ns // 10**9, at_ns % 10**9), "base")


def battery(k, at_ns):
    kind = STORE.types["sensor_msgs/msg/BatteryState"]
    cells = numpy.array([4.1, 4.0], dtype=numpy.float32)
    known = dict(voltage=12.0 - k / 1024, temperature=25.0, current=-2.0, percentage=0.75 - k / 8192)
    known |= dict(charge=5.0, capacity=10.0, design_capacity=10.0, power_supply_status=2, power_supply_health=1)
    known |= dict(power_supply_technology=3, present=True, location="slot", serial_number="1")
    known |= dict(cell_voltage=cells, cell_temperature=cells, header=header(k, at_ns))
    return kind(**{name: known[name] for name in kind.__dataclass_fields__ if name != "__msgtype__" and name in known})


def camera(k, at_ns):
    roi = of("sensor_msgs/msg/RegionOfInterest", 0, 0, 480, 640, False)
    numbers = [numpy.arange(n, dtype=float) + k for n in (5, 9, 9, 12)]
    return of("sensor_msgs/msg/CameraInfo", header(k, at_ns), 480, 640, "plumb_bob", *numbers, 1, 1, roi)


def transforms(k, at_ns):
    vector = of("geometry_msgs/msg/Vector3", 1.0, 2.0, float(k))
    turn = of("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    moved = of("geometry_msgs/msg/Transform", vector, turn)
    return of(TRANSFORMS, [of("geometry_msgs/msg/TransformStamped", header(k, at_ns), "arm", moved)] * 2)


def status(k, at_ns):
    values = [of("diagnostic_msgs/msg/KeyValue", "load", str(k))]
    one = of("diagnostic_msgs/msg/DiagnosticStatus", k % 3, "cpu", "fine ü", "pc", values)
    return of("diagnostic_msgs/msg/DiagnosticArray", header(k, at_ns), [one])


TOPICS = {
    "/robot1/battery_state": battery,
    "/robot1/camera_info": camera,
    "/tf": transforms,
    "/diagnostics": status,
    "/robot1/tick": lambda k, at_ns: of("std_msgs/msg/Empty"),
    "/robot1/word": lambda k, at_ns: of("std_msgs/msg/String", f"word {k}"),
}


def record(path, compression):
    """A bag of ROS 1, and what is in it."""
    recording = Writer(path)
    if compression:
        recording.set_compression(compression)
    written: dict[str, list] = {}
    with recording as writer:
        for topic, message in TOPICS.items():
            kind = message(0, 0).__msgtype__
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for k in range(COUNT):
                at_ns = BEGIN_NS + k * 100_000_000
                writer.write(connection, at_ns, STORE.serialize_ros1(message(k, at_ns), kind))
                written.setdefault(topic, []).append((at_ns, plain(message(k, at_ns))))
    return written


def plain(value):
    """A message as nested lists and dictionaries with the names of ROS 2, without what ROS 2 has no more."""
    if hasattr(value, "__dataclass_fields__"):
        own = {name: plain(getattr(value, name)) for name in value.__dataclass_fields__ if name != "__msgtype__"}
        return {name.lower(): each for name, each in own.items() if name not in ("seq", "structure_needs_at_least_one_member")}
    if isinstance(value, (list, numpy.ndarray)):
        return [plain(each) for each in value]
    return value.item() if hasattr(value, "item") else value


def read(bag):
    """The messages of each topic; times to 1 us, since no two messages of a session have the same."""
    found = {}
    with AnyReader([Path(bag)]) as reader:
        for connection, at_ns, raw in reader.messages():
            if connection.topic in TOPICS:
                message = plain(reader.deserialize(raw, connection.msgtype))
                found.setdefault(connection.topic, []).append((at_ns // 1000 * 1000, message))
    return found


@pytest.mark.parametrize("compression", [None, Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4])
def test_a_bag_of_ros_1_becomes_one_of_ros_2_with_the_same_messages(stage, compression):
    path = stage.folder / "theirs.bag"
    written = record(path, compression)
    answer = stage.ask("info", path, "--json")
    assert answer.returncode == 0, answer.stderr
    info = {each["name"]: each for each in json.loads(answer.stdout)["streams"]}
    assert {name: each["messages"] for name, each in info.items()} == dict.fromkeys(TOPICS, COUNT)
    done = stage.ask("import", path, "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    bag = done.stdout.splitlines()[-1]
    assert read(bag) == written
    streams = {each["name"]: each for each in json.loads(stage.ask("info", bag, "--json").stdout)["streams"]}
    # What it is is known by its type: it is judged as a robot's battery.
    assert streams["/robot1/battery_state/use/w30"]["origin"] == "derived"
    assert (Path(bag) / "summary.md").exists()


def test_of_a_bag_of_ros_1_that_was_cut_off_all_that_is_left_is_imported(stage):
    path = stage.folder / "theirs.bag"
    record(path, None)
    torn = path.read_bytes()[: path.stat().st_size // 2]
    path.write_bytes(torn)
    done = stage.ask("recover", path)
    assert done.returncode == 1 and f"`teampulse import {path}`" in done.stderr, done
    done = stage.ask("import", path, "--out", stage.folder / "sessions")
    assert done.returncode == 3 and "truncated" in done.stdout, done
    assert path.read_bytes() == torn
    assert sum(map(len, read(done.stdout.splitlines()[-1]).values())) > COUNT


def test_a_bag_of_ros_1_is_exported_as_it_is(stage):
    path = stage.folder / "theirs.bag"
    record(path, None)
    done = stage.ask("export", path, "--format", "csv", "--out", stage.folder / "tables")
    assert done.returncode == 0, done.stderr
    tables = list((stage.folder / "tables").rglob("*.csv"))
    assert any("battery" in table.name for table in tables), tables


def test_a_recording_of_a_realsense_is_imported_with_its_pictures(stage):
    """As librealsense writes it: its times begin at 0, its topics have capitals, and its packages are its own."""
    stream = "realsense_msgs/msg/StreamInfo"
    STORE.register(get_types_from_msg("uint32 fps\nstring encoding\nbool is_recommended", stream))
    path, topics = stage.folder / "realsense.bag", [f"/device_0/sensor_{n}/{name}" for n, name in enumerate(["Depth_0", "Color_0"])]
    kinds = {"16UC1": numpy.uint16, "rgb8": numpy.uint8}
    rows = {encoding: numpy.arange(64 * 48 * (3 if encoding == "rgb8" else 1)).astype(kinds[encoding]) for encoding in kinds}
    recording = Writer(path)
    recording.set_compression(Writer.CompressionFormat.LZ4)
    with recording as writer:
        for topic, encoding in zip(topics, kinds):
            info = writer.add_connection(f"{topic}/info", stream, typestore=STORE)
            writer.write(info, 1, STORE.serialize_ros1(of(stream, 30, encoding, True), stream))
            kind = "sensor_msgs/msg/Image"
            connection = writer.add_connection(f"{topic}/image/data", kind, typestore=STORE)
            for k in range(30):
                at_ns, bytes_of = 1 + k * 33_333_333, rows[encoding].view(numpy.uint8)
                image = of(kind, header(k, BEGIN_NS + at_ns), 48, 64, encoding, 0, len(bytes_of) // 48, bytes_of)
                writer.write(connection, at_ns, STORE.serialize_ros1(image, kind))
    done = stage.ask("import", path, "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    bag = done.stdout.splitlines()[-1]
    with AnyReader([Path(bag)]) as reader:
        images = [(each.topic, reader.deserialize(raw, each.msgtype)) for each, _, raw in reader.messages() if "Image" in each.msgtype]
    for topic, encoding in zip(topics, kinds):
        own = [image for name, image in images if name == f"{topic}/image/data"]
        assert len(own) == 30 and all(image.encoding == encoding for image in own)
        assert all((image.data.view(kinds[encoding]) == rows[encoding]).all() for image in own)
