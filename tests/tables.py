"""The raw signals of a bag as tables, as `teampulse extract` reads them."""

import json
import math
from collections.abc import Iterable
from pathlib import Path

import bags


def described(bag) -> dict:
    """The newest description of each stream."""
    return {each.content.name: each.content for each in bags.messages(bag, "/teampulse/streams")}


def stamp_ns(message) -> int:
    stamp = message.content.header.stamp
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def rows(wave) -> Iterable[tuple[int, list[float]]]:
    """The samples of a wave: when each was measured [ns], and its channels."""
    width = wave.content.channels
    values = [float(value) for value in wave.content.samples]
    for place in range(len(values) // width):
        # Halves away from zero, as Rust rounds.
        after_ns = math.floor(wave.content.period_ns * place + 0.5)
        yield stamp_ns(wave) + after_ns, values[place * width : (place + 1) * width]


def write(waves, stream, path: Path) -> Path:
    """Writes waves of a stream as a table, to the nanosecond and every bit."""
    with path.open("w") as table:
        print("measured_secs", *stream.channels, sep=",", file=table)
        for wave in waves:
            for at_ns, values in rows(wave):
                secs = f"{at_ns // 1_000_000_000}.{at_ns % 1_000_000_000:09}"
                print(secs, *map(repr, values), sep=",", file=table)
    return path


def extracted(stage, table: Path, stream, window_secs: int) -> dict:
    """What `extract --method causal` computes of a table, in windows that begin each second."""
    answer = stage.ask(
        *("extract", table, "--signal", stream.signal, "--rate", stream.rate_hz, "--json"),
        *("--time", "measured_secs", "--column", ",".join(stream.channels)),
        *("--unit", stream.units[0], "--method", "causal", "--window", window_secs, "--hop", 1),
    )
    assert answer.returncode == 0, answer.stderr
    return json.loads(answer.stdout)
