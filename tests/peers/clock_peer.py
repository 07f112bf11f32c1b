#!/usr/bin/env python3
"""Asks a `teampulse_msgs/srv/ProbeClock` over PyPI's Cyclone DDS, as any ROS node would.

A service is two topics. In the mapping of rmw_cyclonedds each message begins with the id of the
client and the number of the request. Prints one JSON object: how far the other clock is ahead, by
the fastest of the exchanges, and how long that one took.
"""

import argparse
import json
import os
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import int32, int64, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from cyclone_peer import AS_ROS

PACKAGE = "teampulse_msgs::srv::dds_::"
CLIENT = 0x0102030405060708


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Request(IdlStruct, typename=f"{PACKAGE}ProbeClock_Request_"):
    client: uint64
    number: int64
    sent: Time


@dataclass
@final
class Reply(IdlStruct, typename=f"{PACKAGE}ProbeClock_Response_"):
    client: uint64
    number: int64
    sent: Time
    received: Time
    replied: Time


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--count", type=int, default=20, help="exchanges")
    parser.add_argument("service", help="a ROS name: /teampulse/probe_clock")
    args = parser.parse_args()
    os.environ["CYCLONEDDS_URI"] = f"{AS_ROS},{os.environ.get('CYCLONEDDS_URI', '')}"
    participant = DomainParticipant(args.domain)
    qos = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(10),
        Policy.DataRepresentation(use_xcdrv2_representation=False),
    )
    requests = Topic(participant, f"rq{args.service}Request", Request, qos=qos)
    replies = Topic(participant, f"rr{args.service}Reply", Reply, qos=qos)
    reader = DataReader(participant, replies, qos=qos)
    writer = DataWriter(participant, requests, qos=qos)
    deadline = time.monotonic() + 20
    while not (
        writer.get_publication_matched_status().current_count
        and reader.get_subscription_matched_status().current_count
    ):
        if time.monotonic() > deadline:
            sys.exit("nobody offers the service")
        time.sleep(0.05)
    # We know the server before the server knows us, and DDS offers no way to ask.
    time.sleep(0.5)
    exchanges = [each for k in range(args.count) if (each := exchange(writer, reader, k))]
    if not exchanges:
        sys.exit("nobody answers")
    round_trip_secs, offset_secs = min(exchanges)
    answer = {"offset_secs": offset_secs, "round_trip_secs": round_trip_secs}
    print(json.dumps(answer | {"exchanges": len(exchanges)}), flush=True)


def exchange(writer: DataWriter, reader: DataReader, number: int) -> tuple[float, float] | None:
    """Asks once; gives round trip and offset."""
    sent_ns = time.time_ns()
    writer.write(Request(client=CLIENT, number=number, sent=Time(*divmod(sent_ns, 10**9))))
    deadline = time.monotonic() + 1
    while time.monotonic() < deadline:
        for reply in reader.take(10):
            arrived_ns = time.time_ns()
            if (reply.client, reply.number) == (CLIENT, number):
                assert nanos(reply.sent) == sent_ns
                there, back = nanos(reply.received) - sent_ns, arrived_ns - nanos(reply.replied)
                return (there + back) / 1e9, (there - back) / 2e9
        time.sleep(0.0002)
    return None


def nanos(stamp: Time) -> int:
    return stamp.sec * 10**9 + stamp.nanosec


if __name__ == "__main__":
    main()
