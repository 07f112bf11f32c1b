"""Measures what features of people cost, how late they are, and whether they find the truth, over ROS."""

import json
import os
import sys
import tempfile
import time
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import harness
from closed_loop import FOUND, ORDERS, Session

HERE = Path(__file__).parent
LISTENER = [sys.executable, HERE / "listen.py"]
WITHOUT_ROS = harness.ROOT / "examples/without_ros"

# A baseline and three levels without a rest; then more time until the longest window is full.
PHASE_SECS = 60
WINDOWS_SECS = [30, 60, 300]
DISCOVERED_SECS = 15
FULL_SECS = 330
COUNTED_SECS = 30
SENSORS = {
    "ecg": "heart",
    "ppg": "pulse",
    "eda_fingers": "skin",
    "emg": "muscle",
    "eeg": "brain",
    "respiration": "breath",
    "temperature": "skin_temperature",
    "acceleration": "movement",
}
MANY = 30
LISTENED = "/humans/persons/p001/simulated"
MOST_SHARE = {1: 0.02, MANY: 0.50}
# Memory that does not grow with the windows: buffers, and what the allocator retains.
MOST_GROWN_SHARE = 0.15
MOST_LATENCY_MS = 20
LATENCY_RUNS = 3


def study(people: int, features: bool) -> str:
    """Returns a study with this many simulated people, with or without features of them. Publishing costs nothing while
    nobody subscribes."""
    return f"""
        publish = ["{LISTENED}/*/*/w30"]
        [session]
        name = "people"
        [[sources]]
        type = "people"
        [features]
        windows_secs = {WINDOWS_SECS}
        disable = {[] if features else json.dumps(of_people())}
        [[sinks]]
        type = "bag"
        [simulate]
        robots = 1
        people = {people}
        [simulate.task]
        baseline_secs = {PHASE_SECS}
        level_secs = {PHASE_SECS}
        rest_secs = 0
        rounds = 1
    """


@cache
def of_people() -> list[str]:
    """Returns the names of all features."""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=66)
        listed = stage.ask("list", "features").stdout.splitlines()
        stage.close()
    named = (line[2:] for line in listed if line.startswith("  ") and not line.startswith("   "))
    return [line.partition(":")[0] for line in named]


@dataclass
class Run:
    """The cost of a session, by the seconds since its start."""

    # The share of a core, and the memory [bytes].
    share: dict[int, float] = field(default_factory=dict)
    memory: dict[int, int] = field(default_factory=dict)
    # The latencies at a listener to one person at that time [ms], several times.
    latencies_ms: list[list[float]] = field(default_factory=list)
    session: Session | None = None


def watch(people: int, features: bool, at_secs: list[int]) -> Run:
    """Watches a session at some moments of it, and reads its bag if features were computed."""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=67)
        try:
            written, out = stage.study(study(people, features)), Path(folder) / "sessions"
            monitor = stage.teampulse("run", written, "--out", out)
            simulator = stage.teampulse("simulate", written)
            simulator.wait_for("simulating")
            began, run = time.monotonic(), Run()
            for secs in at_secs:
                time.sleep(max(0.0, began + secs - time.monotonic()))
                run.memory[secs] = memory_bytes(monitor.pid)
                run.share[secs] = share(monitor)
            if features and people == 1:
                run.latencies_ms = [heard_latencies_ms(stage) for _ in range(LATENCY_RUNS)]
            code = monitor.interrupt(within_secs=120)
            if code != 0:
                sys.exit(f"the monitor ended with {code}\n{monitor.report()}")
            simulator.interrupt()
            if features and people == MANY:
                run.session = Session(harness.the_bag(out), people, PHASE_SECS)
        finally:
            stage.close()
    return run


def share(monitor: harness.Program) -> float:
    """Returns the share of a core that the session uses for a while."""
    cpu_before_secs, began = monitor.cpu_secs(), time.monotonic()
    time.sleep(COUNTED_SECS)
    return (monitor.cpu_secs() - cpu_before_secs) / (time.monotonic() - began)


def memory_bytes(pid: int) -> int:
    status = Path(f"/proc/{pid}/status").read_text()
    return 1024 * int(status.partition("VmRSS:")[2].split()[0])


# The times of measurements: when the windows are full, and a minute later.
WATCHED_SECS = [DISCOVERED_SECS, FULL_SECS, FULL_SECS + 2 * COUNTED_SECS]


@cache
def with_features(people: int) -> Run:
    return watch(people, True, WATCHED_SECS)


@cache
def without_features(people: int) -> Run:
    return watch(people, False, [DISCOVERED_SECS])


def cost(people: int) -> tuple[bool, str]:
    full, bare = with_features(people).share[FULL_SECS], without_features(people).share
    of_features = full - bare[DISCOVERED_SECS]
    text = f"{of_features:.1%} of a core (bar {MOST_SHARE[people]:.0%}); the process {full:.1%}"
    return of_features < MOST_SHARE[people], f"{text}, without features {bare[DISCOVERED_SECS]:.1%}"


def one_operator():
    """all features of one operator, windows of 30, 60 and 300 s full"""
    yield cost(1)


def thirty_operators():
    """all features of 30 operators, windows of 30, 60 and 300 s full"""
    yield cost(MANY)


def memory():
    """memory with 30 operators, when windows are full and a minute later"""
    held = [with_features(MANY).memory[secs] / 2**20 for secs in WATCHED_SECS]
    grown = held[2] / held[1] - 1
    text = f"{held[0]:.0f} MiB at first, {held[1]:.0f} full, {held[2]:.0f} later: "
    yield grown < MOST_GROWN_SHARE, f"{text}{grown:+.1%} (bar {MOST_GROWN_SHARE:+.0%})"


def heard_latencies_ms(stage: harness.Stage) -> list[float]:
    pairs = [f"{LISTENED}/{each},{LISTENED}/{each}/{leaf}/w30" for each, leaf in SENSORS.items()]
    path = {"PYTHONPATH": os.pathsep.join([str(WITHOUT_ROS), *sys.path])}
    listener = stage.start(*LISTENER, COUNTED_SECS, *pairs, env=path)
    return listener.answer("latencies_ms", within_secs=2 * COUNTED_SECS)["latencies_ms"]


def latency():
    """from the arrival of the sample that ends a window to the arrival of the window, at a listener"""
    for heard_ms in with_features(1).latencies_ms:
        p50_ms, p99_ms = (sorted(heard_ms)[len(heard_ms) * share // 100] for share in (50, 99))
        text = f"p50 {p50_ms:.1f} ms, p99 {p99_ms:.1f} ms (bar {MOST_LATENCY_MS} ms)"
        yield p99_ms < MOST_LATENCY_MS, f"{text} of {len(heard_ms)} windows"


def found():
    """the features of 30 operators against the truth, in each phase"""
    session = with_features(MANY).session
    yield from (figure(session) for figure in FOUND)


def order():
    """30 operators' means in order of load (a check of our pipeline, not of nature)"""
    session = with_features(MANY).session
    yield from (figure(session) for figure in ORDERS)


FIGURES = [one_operator, latency, thirty_operators, memory, found, order]


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
