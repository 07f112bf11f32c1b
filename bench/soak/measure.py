"""Measures how much memory eight hours of recording leave in use, what very many topics and robots cost, and what a
slow or failing worker costs the others."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import harness

HOURS = 8
DEMO_SECS = 185
# From the end of this hour on, memory may grow by at most this share: it must not grow with the recording.
SETTLED_HOUR, MOST_GROWN = 2, 0.05
MOST_HELD_KIB = 150 << 10
# The most processor time that recording and replaying many topics may take, each [s].
FEW_TOPICS, MANY_TOPICS, MOST_SECS = 5_000, 20_000, 15
# How much longer readings may take with a slow or failing worker than without one.
WORKERS, WORKED_SECS, WORKED_TURNS = ("none", "slow", "failing", "panicking"), 5, 4
MOST_SLOWER, SLACK_US = 1.2, 100

# How many times as much an endpoint of many robots that come and go may cost as one of a few robots.
FEW_ROBOTS, MANY_ROBOTS, MOST_TIMES, ROUNDS = 100, 1_000, 2.0, 3


def soak(*arguments) -> list[dict]:
    command = [os.environ["BENCH_SOAK"], *map(str, arguments)]
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return [json.loads(line) for line in output.splitlines()]


def hours() -> tuple[bool, str]:
    """8 hours of the demo, accelerated"""
    with tempfile.TemporaryDirectory() as folder:
        bag = os.environ.get("BAG") or harness.Stage(Path(folder), domain=77).demo(DEMO_SECS)
        held_kib = [line["most_kib"] for line in soak("hours", bag, HOURS + 0.01)]
    grown = held_kib[-1] / held_kib[SETTLED_HOUR - 1] - 1
    text = f"{' '.join(f'{kib / 1024:.1f}' for kib in held_kib)} MiB at most in each hour; "
    text += f"{grown:+.1%} from hour {SETTLED_HOUR} to {HOURS} (bar {MOST_GROWN:+.0%}), "
    text += f"at most {max(held_kib) / 1024:.0f} (bar {MOST_HELD_KIB >> 10})"
    return grown <= MOST_GROWN and max(held_kib) <= MOST_HELD_KIB, text


def topics() -> tuple[bool, str]:
    """20,000 topics, recorded and replayed"""
    [few] = soak("topics", FEW_TOPICS)
    [many] = soak("topics", MANY_TOPICS)
    recorded, replayed = (
        (many[place], many[place] / few[place]) for place in ("recorded_secs", "replayed_secs")
    )
    text = f"recorded in {recorded[0]:.1f} s and replayed in {replayed[0]:.1f} s of CPU (bar "
    text += f"{MOST_SECS} each); {recorded[1]:.1f} and {replayed[1]:.1f} times what {FEW_TOPICS:,} take"
    return max(recorded[0], replayed[0]) <= MOST_SECS, text


def workers() -> tuple[bool, str]:
    """a worker that takes 2 s per item, fails or panics"""
    # In turns, so that other load on the machine affects all alike; the best run of each counts.
    runs = [[soak("worker", kind, WORKED_SECS)[0] for kind in WORKERS] for _ in range(WORKED_TURNS)]
    whole = all(run["offered"] == run["received"] == run["recorded"] for turn in runs for run in turn)
    p99_us = [min(turn[place]["p99_us"] for turn in runs) for place in range(len(WORKERS))]
    most_us = p99_us[0] * MOST_SLOWER + SLACK_US
    text = ", ".join(f"{kind} {us}" for kind, us in zip(WORKERS, p99_us))
    text = f"p99 from source to sink {text} us (bar {most_us:.0f}); "
    text += "all received and recorded" if whole else "NOT all received and recorded"
    return whole and max(p99_us) <= most_us, text


def endpoints() -> tuple[bool, str]:
    """the endpoints of 1,000 robots that come, leave and come again"""
    few, many = (
        min(soak("endpoints", robots)[0]["each_us"] for _ in range(ROUNDS))
        for robots in (FEW_ROBOTS, MANY_ROBOTS)
    )
    text = f"{many:.0f} us of CPU each, of {FEW_ROBOTS} robots {few:.0f} us: "
    text += f"{many / few:.2f} times as much (bar {MOST_TIMES:.0f})"
    return many <= MOST_TIMES * few, text


FIGURES = [endpoints, topics, workers, hours]


def main() -> None:
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    missed = 0
    for figure in FIGURES:
        if wanted in figure.__name__:
            met, text = figure()
            missed += not met
            print(f"{'pass' if met else 'FAIL'}  {figure.__doc__}: {text}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
