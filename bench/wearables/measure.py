"""Measures what wearables cost the monitor, how late their readings are recorded, and how many are lost."""

import json
import os
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bags
import harness
from worn import OPERATOR, emulated

# The time until all devices stream and the shorter windows are full [s].
SETTLED_SECS = float(os.environ.get("SETTLED_SECS", "75"))
COUNTED_SECS = float(os.environ.get("COUNTED_SECS", "60"))
# `teampulse` with a sink that measures delays.
MEASURED = os.environ["BENCH_WEARABLES"]
PEOPLE = "/humans/persons/"
ROBOTS, STRAPS = 5, 30
MOST_SHARE = {"operator": 0.05, "straps": 0.40}
MOST_DELAY_MS = 20
# A beat may be in progress when the first measurement of a strap arrives, and when the last one does.
BEAT_SECS = 2.0


@dataclass
class Run:
    """A session with wearables."""

    # The share of a core that the monitor uses.
    share: float
    # The delays from the arrival of a reading to the queues of sinks [ms].
    delays_ms: list[float]
    readings: int
    # The number of readings about people that are known to be lost.
    lost: int
    # The missing seconds of each strap whose intervals between beats don't add up to the elapsed time.
    gaps_secs: dict[str, float]


def watch(kinds: list[str], people: int, robots: int, program: Path | str) -> Run:
    """Records the wearables of people, and robots, with a program."""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=68)
        try:
            return recorded(stage, emulated(kinds, people), robots, program)
        finally:
            stage.close()


def recorded(stage: harness.Stage, wearables: str, robots: int, program: Path | str) -> Run:
    devices = stage.teampulse("emulate", stage.study(wearables, "emulated.toml"))
    bus = devices.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=(\S+)", pipe="stdout")[1]
    devices.wait_for("emulating wearables")
    study = f'[session]\nname = "wearables"\n{devices.stdout}\n[[sinks]]\ntype = "bag"\n'
    delays = stage.folder / "delays.json"
    if program == MEASURED:
        study += f'[[sinks]]\ntype = "delays"\nfile = "{delays}"\nafter_secs = {SETTLED_SECS}\n'
    if robots:
        study += '[[sources]]\ntype = "robots"\nnamespace = "/robot*"\n'
        study += f"[simulate]\nrobots = {robots}\n"
    written, out = stage.study(study), stage.folder / "sessions"
    if robots:
        stage.teampulse("simulate", written).wait_for("simulating")
    environment = {"DBUS_SYSTEM_BUS_ADDRESS": bus}
    monitor = stage.start(program, "run", written, "--out", out, env=environment)
    time.sleep(SETTLED_SECS)
    cpu_before_secs, began = monitor.cpu_secs(), time.monotonic()
    time.sleep(COUNTED_SECS)
    share = (monitor.cpu_secs() - cpu_before_secs) / (time.monotonic() - began)
    code = monitor.interrupt(within_secs=120)
    if code != 0:
        sys.exit(f"the monitor ended with {code}\n{monitor.report()}")
    bag = harness.the_bag(out)
    streams = [
        stream
        for stream in json.loads(stage.ask("info", bag, "--json").stdout)["streams"]
        if stream["name"].startswith(PEOPLE)
    ]
    missing = set(expected(devices.stdout)) - {device_of(stream["name"]) for stream in streams}
    if missing:
        sys.exit(f"nothing of {missing} was recorded\n{monitor.report()}")
    counts = bags.counts(bag)
    raw = [topic for topic, origin in bags.origins(bag).items() if origin == "raw"]
    return Run(
        share=share,
        delays_ms=sorted(json.loads(delays.read_text())) if program == MEASURED else [],
        readings=sum(counts[topic] for topic in raw if topic.startswith(PEOPLE)),
        lost=sum(stream["lost"] or 0 for stream in streams),
        gaps_secs=gaps_secs(bag),
    )


def expected(lines: str) -> list[tuple[str, str]]:
    """Returns the person and the source of each device in the lines of a study."""
    words = [line.partition("=")[2].strip(' "') for line in lines.splitlines()]
    keys = [line.partition("=")[0].strip() for line in lines.splitlines()]
    types = [word for key, word in zip(keys, words) if key == "type"]
    people = [word for key, word in zip(keys, words) if key == "person"]
    return [(person, kind) for person, kind in zip(people, types)]


def device_of(topic: str) -> tuple[str, str]:
    person, device = topic.removeprefix(PEOPLE).split("/")[:2]
    return person, "polar" if device.startswith("polar") else device


def gaps_secs(bag: Path) -> dict[str, float]:
    """Returns the streams whose intervals between beats don't add up to the time in which they arrived, with the missing
    seconds; straps don't number intervals."""
    came = defaultdict(list)
    for message in bags.messages(bag, "/rr_interval"):
        came[message.topic].append((message.log_secs, message.content.values[0] / 1024))
    found = {}
    for topic, intervals in came.items():
        filled_secs = sum(secs for _, secs in intervals[1:])
        gap_secs = intervals[-1][0] - intervals[0][0] - filled_secs
        if abs(gap_secs) > BEAT_SECS:
            found[topic] = gap_secs
    return found


@cache
def operator() -> Run:
    return watch(OPERATOR, 1, ROBOTS, harness.TEAMPULSE)


@cache
def straps() -> Run:
    return watch(["polar_h10"], STRAPS, 0, harness.TEAMPULSE)


def cost(run: Run, most: float) -> tuple[bool, str]:
    return run.share < most, f"{run.share:.1%} of a core (bar {most:.0%})"


def losses(run: Run) -> tuple[bool, str]:
    gaps = f", gaps between beats: {run.gaps_secs}" if run.gaps_secs else ""
    return not run.lost and not run.gaps_secs, f"{run.lost} lost (bar 0) of {run.readings} readings{gaps}"


def one_operator():
    """one operator with an H10, a Myo, a Shimmer3 and an E4 beside five robots"""
    yield cost(operator(), MOST_SHARE["operator"])
    yield losses(operator())


def delay():
    """from the arrival of a reading of the same operator to the queue of the bag"""
    delays_ms = watch(OPERATOR, 1, ROBOTS, MEASURED).delays_ms
    p50_ms, p99_ms = (delays_ms[len(delays_ms) * share // 100] for share in (50, 99))
    text = f"p50 {p50_ms:.2f} ms, p99 {p99_ms:.2f} ms (bar {MOST_DELAY_MS} ms), most {delays_ms[-1]:.1f} ms"
    yield p99_ms < MOST_DELAY_MS, f"{text} of {len(delays_ms)} readings"


def thirty_straps():
    """30 people with an H10 each in one session"""
    yield cost(straps(), MOST_SHARE["straps"])
    yield losses(straps())


FIGURES = [one_operator, delay, thirty_straps]


def main() -> None:
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    missed = 0
    for figure in FIGURES:
        if wanted in figure.__name__:
            for met, text in figure():
                missed += not met
                print(f"{'pass' if met else 'FAIL'}  {figure.__doc__}: {text}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
