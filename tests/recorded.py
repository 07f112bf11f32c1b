"""Recordings of real people as bags: what their sensors gave, as teampulse would have recorded it raw."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import harness

MESSAGES = harness.ROOT / "msgs/teampulse_msgs/msg"
DESCRIPTION = "teampulse_msgs/msg/StreamDescription"
WAVE = "teampulse_msgs/msg/Wave"
BEGIN_NS = 1_700_000_000_000_000_000
NO_TIME = -(2**63)
# A sensor's computer sends so much at once [s].
CHUNK_SECS = 0.25


@dataclass
class Signal:
    """What one sensor gave: samples by channel."""

    person: str
    device: str
    name: str
    rate_hz: float
    channels: dict[str, str]
    samples: np.ndarray
    word: str = ""

    @property
    def topic(self) -> str:
        return f"/humans/persons/{self.person}/{self.device}/{self.name}"

    def described(self) -> dict:
        return dict(
            name=self.topic,
            type=WAVE,
            signal=self.word or self.name,
            about=0,
            id=self.person,
            device=self.device,
            origin=0,
            inputs=[],
            method="",
            channels=list(self.channels),
            units=list(self.channels.values()),
            rate_hz=self.rate_hz,
            scales=np.zeros(0),
            doc="",
            family="",
            window_secs=0.0,
            beside="",
        )

    def waves(self):
        """Each with when it came [ns], and its content."""
        rows = self.samples.reshape(-1, len(self.channels))
        count = max(1, int(self.rate_hz * CHUNK_SECS))
        for number, begin in enumerate(range(0, len(rows), count)):
            chunk = rows[begin : begin + count]
            came_ns = BEGIN_NS + round((begin + len(chunk)) / self.rate_hz * 1e9)
            begins_ns = BEGIN_NS + round(begin / self.rate_hz * 1e9)
            content = dict(
                device_time=NO_TIME,
                index=number,
                period_ns=1e9 / self.rate_hz,
                channels=len(self.channels),
                samples=chunk.astype(float).ravel(),
            )
            yield came_ns, begins_ns, content


def write(signals: list[Signal], path: Path) -> Path:
    """Writes a bag with these signals, in the order in which they came."""
    types = our_types()
    with path.open("wb") as file:
        bag = Bag(Writer(file), types)
        bag.writer.start(profile="ros2")
        for signal in signals:
            bag.add("/teampulse/streams", DESCRIPTION, BEGIN_NS, BEGIN_NS, signal.described())
        came = [(wave, signal) for signal in signals for wave in signal.waves()]
        for (came_ns, begins_ns, content), signal in sorted(came, key=lambda each: each[0][0]):
            bag.add(signal.topic, WAVE, came_ns, begins_ns, content)
        bag.writer.finish()
    return path


class Bag:
    """A bag that is being written."""

    def __init__(self, writer: Writer, types):
        self.writer, self.types = writer, types
        self.schemas, self.channels = {}, {}

    def add(self, topic: str, kind: str, came_ns: int, stamp_ns: int, content: dict) -> None:
        message = self.types.types[kind](header=self.header(stamp_ns), **content)
        data = bytes(self.types.serialize_cdr(message, kind))
        channel = self.channel(topic, kind)
        self.writer.add_message(channel, log_time=came_ns, data=data, publish_time=stamp_ns)

    def header(self, stamp_ns: int):
        time = self.types.types["builtin_interfaces/msg/Time"]
        header = self.types.types["std_msgs/msg/Header"]
        sec, nanosec = divmod(stamp_ns, 1_000_000_000)
        return header(stamp=time(sec=sec, nanosec=nanosec), frame_id="")

    def channel(self, topic: str, kind: str) -> int:
        if topic not in self.channels:
            metadata = {"teampulse_origin": "raw", "teampulse_shape": "own"}
            schema = self.schema(kind)
            self.channels[topic] = self.writer.register_channel(topic, "cdr", schema, metadata)
        return self.channels[topic]

    def schema(self, kind: str) -> int:
        if kind not in self.schemas:
            text, _ = self.types.generate_msgdef(kind, ros_version=2)
            self.schemas[kind] = self.writer.register_schema(kind, "ros2msg", text.encode())
        return self.schemas[kind]


def our_types():
    """ROS's types with those of the package, as its files say."""
    types = get_typestore(Stores.ROS2_JAZZY)
    for path in sorted(MESSAGES.glob("*.msg")):
        text = re.sub(r"#.*", "", path.read_text())
        types.register(get_types_from_msg(text, f"teampulse_msgs/msg/{path.stem}"))
    return types
