"""Reads bags through PyPI's `rosbags` and `mcap-ros2-support`: nothing here is ours."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import payload


@dataclass
class Message:
    """A message of a bag, decoded by `rosbags`."""

    topic: str
    log_secs: float
    content: object


def messages(bag: Path, topic_ends: str | tuple[str, ...] = "") -> list[Message]:
    """The messages of all topics whose name ends so (or so), in the order of the bag."""
    with AnyReader([bag]) as reader:
        wanted = [each for each in reader.connections if each.topic.endswith(topic_ends)]
        if not wanted:
            return []
        return [
            Message(each.topic, log_ns / 1e9, reader.deserialize(cdr, each.msgtype))
            for each, log_ns, cdr in reader.messages(wanted)
        ]


def stored(bag: Path) -> Iterator[tuple[str, int, bytes]]:
    """Topic, log time [ns] and bytes of every message, with no definition asked for."""
    for path in parts(bag):
        with path.open("rb") as file:
            for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
                yield channel.topic, message.log_time, message.data


def raw(bag: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Every topic's messages as log time [ns] and bytes."""
    streams: dict[str, list[tuple[int, bytes]]] = defaultdict(list)
    for topic, log_ns, cdr in stored(bag):
        streams[topic].append((log_ns, cdr))
    return dict(streams)


def sent_secs(bag: Path, topic: str) -> list[float]:
    """What the sender of each message stamped it with: its publish time in the bag."""
    times = []
    for path in parts(bag):
        with path.open("rb") as file:
            messages = make_reader(file).iter_messages(topics=[topic], log_time_order=False)
            times += [message.publish_time / 1e9 for _, _, message in messages]
    return times


def origins(bag: Path) -> dict[str, str]:
    """Whether each topic is raw or derived, as its channel says."""
    metadata = channel_metadata(bag).items()
    return {topic: of_channel["teampulse_origin"] for topic, of_channel in metadata}


def channel_metadata(bag: Path) -> dict[str, dict[str, str]]:
    """The metadata of the channel of each topic."""
    found = {}
    for path in parts(bag):
        with path.open("rb") as file:
            for channel in make_reader(file).get_summary().channels.values():
                found[channel.topic] = dict(channel.metadata)
    return found


def counts(bag: Path) -> Counter:
    """How many messages each topic has, as the index says: millions are not read one by one."""
    found = Counter()
    for path in parts(bag):
        with path.open("rb") as file:
            summary = make_reader(file).get_summary()
        for channel_id, count in summary.statistics.channel_message_counts.items():
            found[summary.channels[channel_id].topic] += count
    return found


def parts(bag: Path) -> list[Path]:
    """The files of a bag, in order."""
    return sorted(bag.glob("*.mcap"), key=lambda path: int(path.stem.rpartition("_")[2]))


def tallies(bag: Path) -> dict[str, payload.Tally]:
    """What of the peers' numbered messages is in a bag, by topic."""
    found: dict[str, payload.Tally] = defaultdict(payload.Tally)
    for topic, _, cdr in stored(bag):
        if topic.startswith("/bench"):
            found[topic].add(cdr)
    return dict(found)


def decoded_by_rosbags(bag: Path) -> Counter:
    """Decodes every message; `rosbags` also checks each type's hash. Gives the count by type."""
    with AnyReader([bag]) as reader:
        decoded = Counter()
        for connection, _, cdr in reader.messages():
            reader.deserialize(cdr, connection.msgtype)
            decoded[connection.msgtype] += 1
    return decoded


def decoded_by_mcap(bag: Path) -> Counter:
    """Decodes every message by the definitions in the file. Gives the count by type."""
    decoded = Counter()
    for path in parts(bag):
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for schema, _, _, _ in reader.iter_decoded_messages():
                decoded[schema.name] += 1
    return decoded
