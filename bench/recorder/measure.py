"""What `teampulse run` takes to record what another process publishes, and what it loses."""

import json
import os
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

import bags
import harness

SECONDS = int(os.environ.get("SECONDS_EACH", "30"))


@dataclass
class Load:
    """What a publisher publishes."""

    topics: int
    rate_hz: int
    size_bytes: int
    burst: int = 1

    def arguments(self) -> list:
        # Whole bursts only: a burst cut short is none.
        count = self.rate_hz * SECONDS // self.burst * self.burst
        return [
            *("--topics", self.topics, "--rate", self.rate_hz, "--size", self.size_bytes),
            *("--burst", self.burst, "--count", count),
        ]


@dataclass
class Recording:
    """How a recording went."""

    sent: int
    lost: int
    seconds: float
    recorder_cpu_secs: float
    publisher_cpu_secs: float

    def share(self) -> str:
        """How much of a core both needed."""
        publisher = self.publisher_cpu_secs / self.seconds
        recorder = self.recorder_cpu_secs / self.seconds
        return f"publisher {publisher:.0%}, recorder {recorder:.0%} of a core"


def record(load: Load, peer: str = "cyclone", settings: str = "") -> Recording:
    """Records a load, and counts what of it is in the bag."""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=60)
        try:
            recorder, out = stage.record("/bench*", settings=settings)
            publisher = getattr(stage, peer)("publish", "/bench", *load.arguments())
            publisher.answer("begun")
            cpu_before_secs = recorder.cpu_secs()
            sent = publisher.answer("sent", within_secs=SECONDS * 3 + 30)
            cpu_secs = recorder.cpu_secs() - cpu_before_secs
            code = recorder.interrupt(within_secs=60)
            if code != 0:
                sys.exit(f"the recorder ended with {code}\n{recorder.report()}")
            kept = sum(
                len(set(tally.numbers)) for tally in bags.tallies(harness.the_bag(out)).values()
            )
        finally:
            stage.close()
    total = sent["sent"] * sent["topics"]
    return Recording(total, total - kept, sent["seconds"], cpu_secs, sent["cpu_secs"])


def fifty_topics() -> tuple[bool, str]:
    """50 topics x 1000 Hz x 64 B"""
    result = record(Load(topics=50, rate_hz=1000, size_bytes=64))
    return result.lost == 0, f"{result.lost} of {result.sent} lost (bar 0); {result.share()}"


def kilobytes() -> tuple[bool, str]:
    """10 topics x 5000 Hz x 1 KiB"""
    result = record(Load(topics=10, rate_hz=5000, size_bytes=1024))
    return result.lost == 0, f"{result.lost} of {result.sent} lost (bar 0); {result.share()}"


def cyclone_bursts() -> tuple[bool, str]:
    """bursts of 73 x 1 KiB at 500 Hz, Cyclone DDS publisher"""
    result = record(Load(topics=1, rate_hz=500, size_bytes=1024, burst=73))
    return result.lost == 0, f"{result.lost} of {result.sent} lost (bar 0); {result.share()}"


def fastdds_bursts() -> tuple[bool, str]:
    """bursts of 73 x 1 KiB at 500 Hz, Fast DDS publisher"""
    load = Load(topics=1, rate_hz=500, size_bytes=1024, burst=73)
    result = record(load, peer="fastdds")
    return result.lost == 0, f"{result.lost} of {result.sent} lost (bar 0); {result.share()}"


def cpu_per_message() -> tuple[bool, str]:
    """20,000 messages/s x 1 KiB, uncompressed"""
    load = Load(topics=10, rate_hz=2000, size_bytes=1024)
    result = record(load, settings='compression = "none"')
    cpu_us = result.recorder_cpu_secs / result.sent * 1e6
    told = f"{cpu_us:.2f} µs of CPU a message (bar 6); {result.lost} lost; {result.share()}"
    return cpu_us <= 6 and result.lost == 0, told


def cpu_per_compressed_message() -> tuple[bool, str]:
    """20,000 messages/s x 1 KiB, compressed as by default"""
    result = record(Load(topics=10, rate_hz=2000, size_bytes=1024))
    cpu_us = result.recorder_cpu_secs / result.sent * 1e6
    return result.lost == 0, f"{cpu_us:.2f} µs of CPU a message (no bar); {result.lost} lost"


HUNDRED_ROBOTS = """
[session]
name = "hundred"
[[sources]]
type = "robots"
namespace = "/robot*"
[[sinks]]
type = "bag"
[simulate]
robots = 100
arena_side_m = 60
wifi_hz = 5
odometry_hz = 20
battery_hz = 2
diagnostics_hz = 1
"""
RATES_HZ = {"odom": 20, "battery_state": 2, "wifi": 5, "diagnostics": 1}


def hundred_robots() -> tuple[bool, str]:
    """100 robots, monitored and recorded"""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=61)
        try:
            study, out = stage.study(HUNDRED_ROBOTS), Path(folder) / "sessions"
            monitor = stage.teampulse("run", study, "--out", out)
            stage.teampulse("simulate", study)
            # Until all 400 topics are discovered; then what it takes to stay on them.
            time.sleep(10)
            cpu_before_secs, began = monitor.cpu_secs(), time.monotonic()
            time.sleep(SECONDS)
            share = (monitor.cpu_secs() - cpu_before_secs) / (time.monotonic() - began)
            code = monitor.interrupt(within_secs=60)
            if code != 0:
                sys.exit(f"the monitor ended with {code}\n{monitor.report()}")
            topics, missing = robots_missed(harness.the_bag(out))
            losses = told_losses(stage, harness.the_bag(out))
        finally:
            stage.close()
    told = f"{topics} topics, {missing} messages missing (bar 0), told: {losses}; "
    told += f"recorder {share:.0%} of a core (bar 40 %)"
    return topics == 400 and missing == 0 and share < 0.4, told


def robots_missed(bag: Path) -> tuple[int, int]:
    """How many robots' topics there are, and how many messages are missing between the first and
    the last of each, as their rates say."""
    arrived_secs = defaultdict(list)
    for topic, log_ns, _ in bags.stored(bag):
        if topic.count("/") == 2 and topic.rpartition("/")[2] in RATES_HZ:
            arrived_secs[topic].append(log_ns / 1e9)
    missing = 0
    for topic, secs in arrived_secs.items():
        rate_hz = RATES_HZ[topic.rpartition("/")[2]]
        missing += round((max(secs) - min(secs)) * rate_hz) + 1 - len(secs)
    return len(arrived_secs), missing


def told_losses(stage: harness.Stage, bag: Path) -> dict:
    """The losses that the bag tells of, by where; `None` is unknown."""
    streams = json.loads(stage.ask("info", bag, "--json").stdout)["streams"]
    return dict(Counter(str(stream["lost"]) for stream in streams))


FIGURES = [
    fifty_topics,
    kilobytes,
    cyclone_bursts,
    fastdds_bursts,
    cpu_per_message,
    cpu_per_compressed_message,
    hundred_robots,
]


def main() -> None:
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    missed = 0
    for figure in FIGURES:
        if wanted in figure.__name__:
            met, told = figure()
            missed += not met
            print(f"{'pass' if met else 'FAIL'}  {figure.__doc__}, {SECONDS} s: {told}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
