"""Measures what it costs `teampulse run` to record what another process publishes, and how much is lost."""

import json
import os
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bags
import harness
from ruamel.yaml import YAML

SECONDS = int(os.environ.get("SECONDS_EACH", "30"))
# The exit code of a recorder that has lost messages.
DATA_LOST = 3
BUSY = "while True: pass"


@dataclass
class Load:
    """The messages that publishers send."""

    topics: int
    rate_hz: int
    size_bytes: int
    burst: int = 1

    def arguments(self, publishers: int) -> list:
        """Returns what each of this many publishers, which share the topics, is to publish."""
        # Only whole bursts count.
        count = self.rate_hz * SECONDS // self.burst * self.burst
        topics = self.topics // publishers
        return [
            *("--topics", topics, "--rate", self.rate_hz, "--size", self.size_bytes),
            *("--burst", self.burst, "--count", count),
        ]


@dataclass
class Recording:
    """The result of a recording."""

    sent: int
    lost: int
    places: str
    seconds: float
    recorder_cpu_secs: float
    publisher_cpu_secs: float
    # Messages that the publisher overwrote before its socket had them: no recorder can have those.
    unsent: int = 0
    # The processor time used besides that of the publisher, the recorder and the processes that keep cores busy.
    others_cpu_secs: float = 0

    def share(self) -> str:
        """Returns the share of a core that both needed."""
        publishers = self.publisher_cpu_secs / self.seconds
        recorder = self.recorder_cpu_secs / self.seconds
        return f"publishers {publishers:.0%}, recorder {recorder:.0%} of a core"

    def rate_hz(self) -> float:
        """Returns how many messages per second the publishers sent: they are limited by their own processor, and by
        messages that are not yet acknowledged."""
        return self.sent / self.seconds

    def cpu_us(self) -> float:
        """Returns the processor time per message in the recorder."""
        return self.recorder_cpu_secs / self.sent * 1e6


def record(
    load: Load,
    peer: str = "cyclone",
    settings: str = "",
    busy: int = 0,
    options: Sequence = (),
    publishers: int = 1,
) -> Recording:
    """Records a load beside this many processes that use a core each, and counts the messages in the bag."""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=60)
        try:
            recorder, out = stage.record("/bench*", settings=settings)
            arguments = [*load.arguments(publishers), *options]
            publishing = [
                getattr(stage, peer)("publish", f"/bench_{name}", *arguments)
                for name in "abcdefgh"[:publishers]
            ]
            spinning = [stage.start(sys.executable, "-c", BUSY) for _ in range(busy)]
            ours = [recorder, *publishing, *spinning]
            for publisher in publishing:
                publisher.answer("begun")
            cpu_before_secs, dropped_before = recorder.cpu_secs(), dropped(recorder.pid)
            others_before_secs = machine_cpu_secs() - sum(each.cpu_secs() for each in ours)
            sent_by = [each.answer("sent", within_secs=SECONDS * 3 + 30) for each in publishing]
            cpu_secs = recorder.cpu_secs() - cpu_before_secs
            others_secs = machine_cpu_secs() - sum(each.cpu_secs() for each in ours)
            packets = dropped(recorder.pid) - dropped_before
            code = recorder.interrupt(within_secs=60)
            if code not in (0, DATA_LOST):
                sys.exit(f"the recorder ended with {code}\n{recorder.report()}")
            bag = harness.the_bag(out)
            kept, places = kept_of(bag), losses_by_place(bag, packets)
        finally:
            stage.close()
    total = sum(sent["sent"] * sent["topics"] for sent in sent_by)
    handed_over = sum(sent.get("handed_over", sent["sent"] * sent["topics"]) for sent in sent_by)
    return Recording(
        sent=total,
        lost=handed_over - kept,
        places=places,
        seconds=max(sent["seconds"] for sent in sent_by),
        recorder_cpu_secs=cpu_secs,
        publisher_cpu_secs=sum(sent["cpu_secs"] for sent in sent_by),
        unsent=total - handed_over,
        others_cpu_secs=others_secs - others_before_secs,
    )


def machine_cpu_secs() -> float:
    """Returns the processor time that all processes have used so far."""
    user, nice, system, _idle, _waiting, irq, soft_irq = map(
        int, Path("/proc/stat").read_text().split()[1:8]
    )
    return (user + nice + system + irq + soft_irq) / harness.CLOCK_TICKS


def kept_of(bag: Path) -> int:
    """Returns the number of the publisher's messages in the bag."""
    return sum(count for topic, count in bags.counts(bag).items() if topic.startswith("/bench"))


def dropped(pid: int) -> int:
    """Returns how many packets the kernel has dropped so far because a receive buffer of a process was full."""
    links = (os.readlink(file) for file in Path(f"/proc/{pid}/fd").iterdir())
    sockets = {link[8:-1] for link in links if link.startswith("socket:[")}
    lines = Path(f"/proc/{pid}/net/udp").read_text().splitlines()[1:]
    return sum(int(fields[12]) for fields in map(str.split, lines) if fields[9] in sockets)


def losses_by_place(bag: Path, packets: int) -> str:
    """Returns where messages were lost, as far as the kernel and the bag show."""
    metadata = YAML(typ="safe").load(bag / "metadata.yaml")["rosbag2_bagfile_information"]
    notes = metadata.get("custom_data") or {}
    lost = {
        place: sum(
            int(value)
            for key, value in notes.items()
            if key.startswith(f"{place}:/bench") and value != "unknown"
        )
        for place in ("lost_source", "lost_queue")
    }
    return (
        f"{packets} packets dropped by the recorder's sockets, {lost['lost_source']} messages "
        f"lost on the way and not sent again in time, {lost['lost_queue']} dropped in its queue"
    )


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


def unprivileged() -> tuple[bool, str]:
    """10 topics x 5000 Hz x 1 KiB, the recorder without rights over the network and priorities"""
    rights = "-net_admin,-sys_nice"
    with tempfile.TemporaryDirectory() as folder:
        as_usual, wrapped = harness.TEAMPULSE, Path(folder) / "teampulse"
        setpriv = f"setpriv --inh-caps={rights} --bounding-set={rights}"
        wrapped.write_text(f'#!/bin/sh\nexec {setpriv} {as_usual} "$@"\n')
        wrapped.chmod(0o755)
        try:
            harness.TEAMPULSE = wrapped
            result = record(Load(topics=10, rate_hz=5000, size_bytes=1024))
        finally:
            harness.TEAMPULSE = as_usual
    # A smaller limit holds too little of this rate for a bar to apply.
    has_bar = harness.rmem_max_bytes() >= 4 << 20
    bar = "bar 0" if has_bar else "no bar"
    text = f"{result.lost} of {result.sent} lost ({bar}), rmem_max {harness.rmem_max_bytes() >> 10} KiB"
    return result.lost == 0 or not has_bar, f"{text}; {result.places}"


def cpu_per_message() -> tuple[bool, str]:
    """20,000 messages/s x 1 KiB, uncompressed"""
    load = Load(topics=10, rate_hz=2000, size_bytes=1024)
    result = record(load, settings='compression = "none"')
    cpu_us = result.recorder_cpu_secs / result.sent * 1e6
    text = f"{cpu_us:.2f} µs of CPU a message (bar 6); {result.lost} lost; {result.share()}"
    return cpu_us <= 6 and result.lost == 0, text


def cpu_per_compressed_message() -> tuple[bool, str]:
    """20,000 messages/s x 1 KiB, compressed as by default"""
    result = record(Load(topics=10, rate_hz=2000, size_bytes=1024))
    cpu_us = result.recorder_cpu_secs / result.sent * 1e6
    return result.lost == 0, f"{cpu_us:.2f} µs of CPU a message (no bar); {result.lost} lost"


def silent_topics() -> tuple[bool, str]:
    """6,000 silent topics"""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=63)
        try:
            recorder, _ = stage.record("/bench*")
            publisher = stage.cyclone("publish", "/bench", "--topics", 6000, "--count", 0)
            publisher.answer("sent", within_secs=180)
            time.sleep(5)
            cpu_before_secs, began = recorder.cpu_secs(), time.monotonic()
            time.sleep(SECONDS)
            share = (recorder.cpu_secs() - cpu_before_secs) / (time.monotonic() - began)
        finally:
            stage.close()
    return share < 0.05, f"recorder {share:.1%} of a core (bar 5 %)"


def fast(
    load: Load, peer: str, most_us: float | None = None, busy: int = 0, publishers: int = 1
) -> tuple[bool, str]:
    """Sets up publishers as rclcpp does with `QoS(1000)`: reliable, with the last 1,000 messages of each topic kept,
    the kernel's default send buffers, and Fast DDS sending within `publish()`."""
    options = ["--synchronous"] if peer == "fastdds" else []
    result = record(load, peer=peer, busy=busy, options=options, publishers=publishers)
    bar = "no bar" if most_us is None else f"bar {most_us:g}"
    text = f"{result.lost} of {result.sent} lost (bar 0): {result.places}; "
    if result.unsent:
        text += f"{result.unsent} more overwritten by publishers before they were sent; "
    text += f"{result.cpu_us():.2f} µs of CPU a message ({bar}); "
    text += f"{result.rate_hz():,.0f} messages/s came out; {result.share()}, "
    text += f"other programs {result.others_cpu_secs / result.seconds:.0%}"
    return result.lost == 0 and (most_us is None or result.cpu_us() <= most_us), text


FAST = Load(topics=10, rate_hz=10_000, size_bytes=1024)
HALF_AS_FAST = Load(topics=10, rate_hz=5_000, size_bytes=1024)


def fast_cyclone() -> tuple[bool, str]:
    """100,000 messages/s x 1 KiB, Cyclone DDS publisher"""
    return fast(FAST, "cyclone", most_us=5)


def fast_fastdds() -> tuple[bool, str]:
    """100,000 messages/s x 1 KiB, two Fast DDS publishers"""
    # One fills a core at some 80,000.
    return fast(FAST, "fastdds", most_us=5, publishers=2)


def busy_cyclone() -> tuple[bool, str]:
    """50,000 messages/s x 1 KiB beside a busy core, Cyclone DDS publisher"""
    return fast(HALF_AS_FAST, "cyclone", busy=1)


def busy_fastdds() -> tuple[bool, str]:
    """50,000 messages/s x 1 KiB beside a busy core, Fast DDS publisher"""
    return fast(HALF_AS_FAST, "fastdds", busy=1)


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
            # First until all 400 topics are discovered; then the cost of following them is measured.
            time.sleep(10)
            cpu_before_secs, began = monitor.cpu_secs(), time.monotonic()
            time.sleep(SECONDS)
            share = (monitor.cpu_secs() - cpu_before_secs) / (time.monotonic() - began)
            code = monitor.interrupt(within_secs=60)
            if code != 0:
                sys.exit(f"the monitor ended with {code}\n{monitor.report()}")
            topics, missing = robots_missed(harness.the_bag(out))
            losses = reported_losses(stage, harness.the_bag(out))
        finally:
            stage.close()
    text = f"{topics} topics, {missing} messages missing (bar 0), reported: {losses}; "
    text += f"recorder {share:.0%} of a core (bar 40 %)"
    return topics == 400 and missing == 0 and share < 0.4, text


def robots_missed(bag: Path) -> tuple[int, int]:
    """Returns how many robots' topics there are, and how many messages are missing between the first and the last of
    each, by their rates."""
    arrived_secs = defaultdict(list)
    for topic, log_ns, _ in bags.stored(bag):
        if topic.count("/") == 2 and topic.rpartition("/")[2] in RATES_HZ:
            arrived_secs[topic].append(log_ns / 1e9)
    missing = 0
    for topic, secs in arrived_secs.items():
        rate_hz = RATES_HZ[topic.rpartition("/")[2]]
        expected = round((max(secs) - min(secs)) * rate_hz) + 1
        # A first message that came late adds one to the count, which must not compensate for a loss on another topic.
        missing += max(0, expected - len(secs))
    return len(arrived_secs), missing


def reported_losses(stage: harness.Stage, bag: Path) -> dict:
    """Returns the losses that the bag reports, by place; `None` is unknown."""
    streams = json.loads(stage.ask("info", bag, "--json").stdout)["streams"]
    return dict(Counter(str(stream["lost"]) for stream in streams))


FIGURES = [
    fifty_topics,
    kilobytes,
    unprivileged,
    cyclone_bursts,
    fastdds_bursts,
    cpu_per_message,
    cpu_per_compressed_message,
    fast_cyclone,
    fast_fastdds,
    busy_cyclone,
    busy_fastdds,
    silent_topics,
    hundred_robots,
]


def main() -> None:
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    missed = 0
    for figure in FIGURES:
        if wanted in figure.__name__:
            met, text = figure()
            missed += not met
            print(f"{'pass' if met else 'FAIL'}  {figure.__doc__}, {SECONDS} s: {text}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
