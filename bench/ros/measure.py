"""Measures what receiving from another process costs on our bus, without a session behind it."""

import os
import sys
import tempfile
from pathlib import Path

import harness

SECONDS = 10

LOADS = {
    "1 topic x 1000 Hz x 64 B": (1, 1000, 64),
    "1 topic x 1000 Hz x 1 KiB": (1, 1000, 1024),
    "1 topic x 200 Hz x 64 KiB": (1, 200, 64 << 10),
    "1 topic x 30 Hz x 1 MiB": (1, 30, 1 << 20),
    "10 topics x 2000 Hz x 1 KiB": (10, 2000, 1024),
    "10 topics x 5000 Hz x 1 KiB": (10, 5000, 1024),
    "10 topics x 10000 Hz x 1 KiB": (10, 10000, 1024),
    "50 topics x 1000 Hz x 64 B": (50, 1000, 64),
}


def measure(topics: int, rate_hz: int, size_bytes: int) -> tuple[bool, str]:
    """Makes the peer publish to the bus; counts the messages received, their latency, and the cost."""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=62)
        try:
            receiver = stage.start(os.environ["BENCH_ROS"], topics)
            receiver.answer("subscribed")
            # With a single topic, the peer would not number it.
            name = "/bench" if topics > 1 else "/bench0"
            count = rate_hz * SECONDS
            load = ("--topics", topics, "--rate", rate_hz, "--size", size_bytes, "--count", count)
            publisher = stage.cyclone("publish", name, *load)
            publisher.answer("begun")
            cpu_before_secs = receiver.cpu_secs()
            publisher.answer("sent", within_secs=SECONDS * 3)
            cpu_secs = receiver.cpu_secs() - cpu_before_secs
            receiver.say_no_more()
            counted = receiver.answer("messages")
        finally:
            stage.close()
    missing = count * topics - counted["messages"]
    text = f"{missing} of {count * topics} lost (bar 0), {counted['lost']} by its own count, "
    text += f"in {counted['gaps']} places; "
    text += f"latency p50 {counted['p50_ms']} ms, p99 {counted['p99_ms']} ms; "
    text += f"{cpu_secs / (count * topics) * 1e6:.1f} µs of CPU a message"
    return missing == 0, text


def main() -> None:
    missed = 0
    for name, load in LOADS.items():
        met, text = measure(*load)
        missed += not met
        print(f"{'pass' if met else 'FAIL'}  {name}, {SECONDS} s: {text}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
