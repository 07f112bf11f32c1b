#!/usr/bin/env python3
"""An independent ROS 2 peer over PyPI's Cyclone DDS.

`publish` and `subscribe` move numbered, checksummed messages (see payload.py); `send` publishes any
bytes, given as hexadecimal lines on standard input; `ask` calls a service; `eavesdrop` listens to all that there is;
`graph` prints the nodes and endpoints it sees.
Each prints one JSON object a line: first that it is matched, last what it counted. Standard input
is its leash: when that closes, it ends.
"""

import argparse
import json
import os
import select
import sys
import time

from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState, Policy, Qos, SampleState, ViewState
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import payload
import ros_types

# As rmw_cyclonedds configures every node; what the environment says comes after, and wins.
AS_ROS = (
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex></Discovery>"
)
ANY = SampleState.Any | ViewState.Any | InstanceState.Any
# How long a best-effort message may be under way: nobody acknowledges it.
IN_FLIGHT_SECS = 0.5


def main() -> None:
    args = arguments()
    os.environ["CYCLONEDDS_URI"] = f"{AS_ROS},{os.environ.get('CYCLONEDDS_URI', '')}"
    participant = DomainParticipant(args.domain)
    args.run(args, participant)


# --- publishing


def publish(args: argparse.Namespace, participant: DomainParticipant) -> None:
    """Numbered messages on one or several topics, paced."""
    writers = [DataWriter(participant, topic, qos=qos(args)) for topic in topics(args, participant)]
    wait_until(lambda: all(subscribers(writer) >= args.subscribers for writer in writers))
    answer(matched=len(writers))
    time.sleep(args.settle_secs)

    encode = encoder(args.size)
    handles = [writer._ref for writer in writers]
    answer(begun=len(writers))
    started, cpu_started = time.monotonic(), time.process_time()
    for number in range(args.count):
        pause = started + number // args.burst * args.burst / args.rate - time.monotonic()
        if pause > 0:
            time.sleep(pause)
        message = encode(number)
        for handle in handles:
            # The binding's own write() would encode field by field: too slow for these rates.
            if ddspy_write(handle, message) < 0:
                sys.exit(f"failed to write message {number}")
    seconds, cpu_secs = time.monotonic() - started, time.process_time() - cpu_started
    if args.best_effort:
        time.sleep(IN_FLIGHT_SECS)
    acknowledged = args.best_effort or all(map(wait_for_acks, writers))
    answer(
        sent=args.count,
        topics=len(writers),
        seconds=seconds,
        cpu_secs=cpu_secs,
        acknowledged=acknowledged,
    )
    sys.stdin.read()


def subscribers(writer: DataWriter) -> int:
    return writer.get_publication_matched_status().current_count


def wait_for_acks(writer: DataWriter) -> bool:
    """Whether all that was written has arrived, after ten seconds at the latest."""
    try:
        return writer.wait_for_acks(duration(seconds=10))
    except AttributeError:  # what cyclonedds 11.0.1 makes of a timeout
        return False


def encoder(size: int):
    """Encodes messages of so many bytes by number, all but the number by Cyclone's own encoder."""
    empty = ros_types.MultiArrayLayout(dim=[], data_offset=0)
    message = ros_types.UInt8MultiArray(layout=empty, data=bytes(range(256)) * (size // 256 + 1))
    message.data = message.data[:size]
    cdr = bytearray(message.serialize(use_version_2=False))
    content_at = len(cdr) - size
    padding = bytes(-len(cdr) % 4)

    def encode(number: int) -> bytes:
        payload.fill(cdr, content_at, number)
        return bytes(cdr) + padding

    return encode


def send(args: argparse.Namespace, participant: DomainParticipant) -> None:
    """Any bytes, CDR header included: a line of hexadecimal each on standard input."""
    [topic] = topics(args, participant)
    writer = DataWriter(participant, topic, qos=qos(args))
    wait_until(lambda: subscribers(writer) >= args.subscribers)
    answer(matched=1)
    sent = 0
    for line in sys.stdin:
        message = bytes.fromhex(line.strip())
        sent += ddspy_write(writer._ref, message + bytes(-len(message) % 4)) >= 0
        answer(sent=sent)


# --- subscribing


def subscribe(args: argparse.Namespace, participant: DomainParticipant) -> None:
    """Counts what arrives until it has seen `count` a topic, or for `seconds`."""
    readers = [DataReader(participant, topic, qos=qos(args)) for topic in topics(args, participant)]
    tallies = [payload.Tally() for _ in readers]
    messages, latencies_ms, samples = 0, [], []
    answer(subscribed=len(readers))
    deadline = time.monotonic() + args.seconds
    while time.monotonic() < deadline and messages < args.count * len(readers) and leashed():
        idle = True
        for reader, tally in zip(readers, tallies, strict=True):
            for data, info in ddspy_take(reader._ref, ANY, 100):
                if not info.valid_data:
                    continue
                idle, messages = False, messages + 1
                written_ns = tally.add(data)
                if written_ns is not None:
                    latencies_ms.append((time.monotonic_ns() - written_ns) / 1e6)
                if len(samples) < args.keep:
                    samples.append(data.hex())
        if idle:
            time.sleep(0.001)
    latencies_ms.sort()
    answer(
        messages=messages,
        topics=[tally.summary() for tally in tallies],
        latency_p50_ms=latencies_ms[len(latencies_ms) // 2] if latencies_ms else None,
        latency_p99_ms=latencies_ms[len(latencies_ms) * 99 // 100] if latencies_ms else None,
        samples=samples,
    )


def eavesdrop(args: argparse.Namespace, participant: DomainParticipant) -> None:
    """Subscribes to every topic that anybody publishes, for `seconds`; prints how much came on each."""
    publications = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    readers, messages = {}, {}
    deadline = time.monotonic() + args.seconds
    while time.monotonic() < deadline and leashed():
        for endpoint in publications.take(1000):
            name, kind = endpoint.topic_name, endpoint.type_name
            if endpoint.sample_info.valid_data and name not in readers:
                anything = make_idl_struct(kind.rpartition("::")[2], kind, {})
                topic = Topic(participant, name, anything, qos=qos(args))
                readers[name] = DataReader(participant, topic, qos=qos(args))
        for name, reader in readers.items():
            messages[name] = messages.get(name, 0) + len(ddspy_take(reader._ref, ANY, 1000))
        time.sleep(0.01)
    answer(heard=messages)


# --- services


def ask(args: argparse.Namespace, participant: DomainParticipant) -> None:
    """Calls a service as rmw_cyclonedds does: requests are lines of hexadecimal on standard input, CDR
    with its header; so is each reply."""
    package, _, name = args.service_type.split("/")

    def half(prefix: str, suffix: str, kind: str) -> Topic:
        dds_name = f"{package}::srv::dds_::{name}_{kind}_"
        anything = make_idl_struct(name, dds_name, {})
        return Topic(participant, f"{prefix}{args.service}{suffix}", anything, qos=reliable())

    def listen() -> DataReader:
        reader = DataReader(participant, half("rr", "Reply", "Response"), qos=reliable())
        wait_until(lambda: reader.get_subscription_matched_status().current_count > 0)
        return reader

    writer = DataWriter(participant, half("rq", "Request", "Request"), qos=reliable())
    reader = None if args.listen_late else listen()
    wait_until(lambda: subscribers(writer) > 0)
    for number, line in enumerate(sys.stdin, start=1):
        request = bytes.fromhex(line.strip())
        call = os.getpid().to_bytes(8, "little") + number.to_bytes(8, "little")
        message = request[:4] + call + request[4:]
        ddspy_write(writer._ref, message + bytes(-len(message) % 4))
        if reader is None:
            writer.wait_for_acks(duration(seconds=10))
            reader = listen()
        reply = None
        while reply is None and leashed():
            for data, info in ddspy_take(reader._ref, ANY, 100):
                if info.valid_data and data[4:20] == call:
                    reply = data[:4] + data[20:]
            time.sleep(0.001)
        answer(reply=reply.hex())


def reliable() -> Qos:
    """As services are in ROS 2."""
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.History.KeepLast(10),
        Policy.DataRepresentation(use_xcdrv2_representation=False),
    )


# --- the graph


def graph(args: argparse.Namespace, participant: DomainParticipant) -> None:
    """Tells all that is in the graph after `seconds`, or when `node` publishes all of `until`."""
    # As rmw_dds_common reads it: with one message kept, one participant would overwrite another.
    latched = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.TransientLocal,
        Policy.History.KeepAll,
        Policy.DataRepresentation(use_xcdrv2_representation=False),
    )
    info_type = ros_types.participant_entities_info(args.gid_bytes)
    info_topic = Topic(participant, "ros_discovery_info", info_type, qos=latched)
    infos = DataReader(participant, info_topic, qos=latched)
    kinds = {
        "publisher": BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
        "subscription": BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
    }
    participants, endpoints, nodes = {}, {}, []
    deadline = time.monotonic() + args.seconds
    while time.monotonic() < deadline and leashed():
        for message in infos.take(100):
            if getattr(message, "gid", None):
                participants[bytes(message.gid.data).hex()] = message.node_entities_info_seq
        for kind, reader in kinds.items():
            for endpoint in reader.take(1000):
                if endpoint.sample_info.valid_data:
                    endpoints[str(endpoint.key)] = describe_endpoint(kind, endpoint)
        nodes = [describe_node(gid, node) for gid, info in participants.items() for node in info]
        if args.until and all(announced_by(args.node, args.until, nodes, endpoints)):
            break
        time.sleep(0.05)
    answer(nodes=nodes, endpoints=list(endpoints.values()))


def announced_by(node_name: str, topics: list[str], nodes: list[dict], endpoints: dict) -> list[bool]:
    """For each topic, whether the node announces a writer there, and the writer is known."""
    gids = {gid for node in nodes if node["name"] == node_name for gid in node["writers"]}
    seen = {endpoint["topic"] for endpoint in endpoints.values() if endpoint["gid"] in gids}
    return [f"rt{topic}" in seen for topic in topics]


def describe_node(participant_gid: str, node) -> dict:
    namespace = node.node_namespace.rstrip("/")
    return {
        "name": f"{namespace}/{node.node_name}",
        "participant": participant_gid,
        "readers": [bytes(gid.data).hex() for gid in node.reader_gid_seq],
        "writers": [bytes(gid.data).hex() for gid in node.writer_gid_seq],
    }


def describe_endpoint(kind: str, endpoint) -> dict:
    policies = {type(policy).__name__: policy for policy in endpoint.qos}
    kinds = {policy.__scope__: type(policy).__name__.split(".")[-1] for policy in endpoint.qos}
    user_data = policies["Userdata"].data if "Userdata" in policies else b""
    return {
        "kind": kind,
        "gid": endpoint.key.bytes.hex(),
        "topic": endpoint.topic_name,
        "type": endpoint.type_name,
        "user_data": user_data.decode("ascii", "replace"),
        "reliability": kinds.get("Reliability"),
        "durability": kinds.get("Durability"),
    }


# --- what all of them need


def topics(args: argparse.Namespace, participant: DomainParticipant) -> list[Topic]:
    names = [args.topic] if args.topics == 1 else [f"{args.topic}{k}" for k in range(args.topics)]
    dds_type = ros_types.dds_type(args.type)
    return [Topic(participant, f"rt{name}", dds_type, qos=qos(args)) for name in names]


def qos(args: argparse.Namespace) -> Qos:
    reliable = Policy.Reliability.Reliable(duration(seconds=10))
    policies = [
        Policy.Reliability.BestEffort if args.best_effort else reliable,
        Policy.Durability.TransientLocal if args.transient_local else Policy.Durability.Volatile,
        Policy.History.KeepLast(args.depth),
        # A late joiner gets what this says, not what the history says; rmw_cyclonedds sets it, too.
        Policy.DurabilityService(
            cleanup_delay=duration(seconds=0),
            history=Policy.History.KeepLast(args.depth),
            max_samples=-1,
            max_instances=-1,
            max_samples_per_instance=-1,
        ),
        Policy.DataRepresentation(use_xcdrv2_representation=False),
    ]
    if args.deadline_ms:
        policies.append(Policy.Deadline(duration(milliseconds=args.deadline_ms)))
    type_hash = None if args.no_type_hash else ros_types.type_hash(args.type)
    if type_hash:
        policies.append(Policy.Userdata(f"typehash={type_hash};".encode()))
    return Qos(*policies)


def wait_until(condition) -> None:
    while not condition():
        if not leashed():
            sys.exit("not matched")
        time.sleep(0.01)


def leashed() -> bool:
    """Whether whoever started this program still holds its standard input open."""
    readable, _, _ = select.select([sys.stdin], [], [], 0)
    return not readable or bool(sys.stdin.buffer.peek(1))


def answer(**what) -> None:
    print(json.dumps(what), flush=True)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--domain", type=int, default=0)
    commands = parser.add_subparsers(required=True)
    for run in (publish, send, subscribe, eavesdrop):
        command = commands.add_parser(run.__name__, help=run.__doc__)
        command.set_defaults(run=run)
        if run != eavesdrop:
            command.add_argument("topic", help="a ROS name: /bench")
        command.add_argument("--type", default=payload.TYPE)
        command.add_argument("--topics", type=int, default=1, help="that many, numbered from 0")
        command.add_argument("--size", type=int, default=64, help="bytes of content")
        command.add_argument("--rate", type=float, default=100, help="messages a second and topic")
        command.add_argument("--burst", type=int, default=1, help="that many back to back")
        command.add_argument("--count", type=int, default=sys.maxsize, help="messages a topic")
        command.add_argument("--seconds", type=float, default=60, help="how long to subscribe")
        command.add_argument("--keep", type=int, default=0, help="print that many messages whole")
        command.add_argument("--subscribers", type=int, default=1, help="wait for so many")
        # A writer sees its reader before the reader sees it, and DDS offers no way to ask.
        command.add_argument("--settle-secs", type=float, default=2, help="pause before the first")
        command.add_argument("--depth", type=int, default=1000)
        command.add_argument("--best-effort", action="store_true")
        command.add_argument("--transient-local", action="store_true")
        command.add_argument("--deadline-ms", type=float)
        command.add_argument("--no-type-hash", action="store_true")
    command = commands.add_parser("ask", help=ask.__doc__)
    command.set_defaults(run=ask)
    command.add_argument("service", help="a ROS name: /teampulse/list_parameters")
    command.add_argument("service_type", help="its type: rcl_interfaces/srv/ListParameters")
    command.add_argument("--listen-late", action="store_true", help="open the reader of replies after a request")
    command = commands.add_parser("graph", help=graph.__doc__)
    command.set_defaults(run=graph)
    command.add_argument("--seconds", type=float, default=10)
    command.add_argument("--gid-bytes", type=int, default=16)
    command.add_argument("--node", default="/teampulse")
    command.add_argument("--until", nargs="*", help="topics")
    return parser.parse_args()


if __name__ == "__main__":
    main()
