"""The windows of a bag, computed live, and those of `extract`, so that both can be compared."""

import struct
from collections import defaultdict

import bags
from tables import stamp_ns

# By their codes, as `extract` words them.
REASONS = [
    None,
    "window too short",
    "data missing in the window",
    "data too poor",
    "not measured by this device",
    "undefined for these data",
    "no baseline yet to compare with",
    "there is none",
]


def windows(bag, topic) -> dict[float, list]:
    """The live windows by their ends [s]: of each value its bits, or why there is none."""
    return {
        secs(each): [
            bits(value) if reason == 0 else REASONS[reason]
            for value, reason in zip(each.content.values, each.content.reasons, strict=True)
        ]
        for each in bags.messages(bag, topic)
    }


def by_end(features: list[dict], window_secs: int) -> dict[float, list]:
    """The same of what `extract` printed, without a shorter window at the end."""
    ended = defaultdict(list)
    for each in features:
        if each["end_secs"] - each["start_secs"] > window_secs - 1e-3:
            value = each["value"]
            ended[each["end_secs"]].append(each["reason"] if value is None else bits(value))
    return dict(ended)


def secs(message) -> float:
    return stamp_ns(message) / 1e9


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def is_number(value) -> bool:
    return isinstance(value, bytes)
