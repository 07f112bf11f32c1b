"""Receives what the sensors of a person publish and what teampulse computes from it, and measures the delay between
them: from the arrival of the wave that ends a window to the arrival of the window."""

import json
import sys
import time
from dataclasses import dataclass, field

import rclpy
from teampulse_msgs.msg import Feature, Wave

NANOS = 1_000_000_000


@dataclass
class Sensor:
    """The messages received about one sensor."""

    # The last sample [ns] and the arrival [ns of the monotonic clock] of each wave.
    waves: list[tuple[int, int]] = field(default_factory=list)
    # The end [ns] and the arrival of each window.
    windows: list[tuple[int, int]] = field(default_factory=list)

    def hear_wave(self, wave: Wave) -> None:
        arrived_ns = time.monotonic_ns()
        last = len(wave.samples) // wave.channels - 1
        self.waves.append((stamp_ns(wave) + round(wave.period_ns * last), arrived_ns))

    def hear_window(self, window: Feature) -> None:
        self.windows.append((stamp_ns(window), time.monotonic_ns()))

    def latencies_ms(self):
        """A window is over with the first sample at or after its end."""
        for end_ns, heard_ns in self.windows:
            caused_ns = next((came_ns for last_ns, came_ns in self.waves if last_ns >= end_ns), None)
            if caused_ns is not None and self.waves[0][0] < end_ns:
                yield (heard_ns - caused_ns) / 1e6


def stamp_ns(message) -> int:
    return message.header.stamp.sec * NANOS + message.header.stamp.nanosec


def main() -> None:
    secs, *pairs = sys.argv[1:]
    rclpy.init()
    node, sensors = rclpy.create_node("listener"), []
    for wave, window in (pair.split(",") for pair in pairs):
        sensor = Sensor()
        node.create_subscription(Wave, wave, sensor.hear_wave, 1000)
        node.create_subscription(Feature, window, sensor.hear_window, 1000)
        sensors.append(sensor)
    deadline = time.monotonic() + float(secs)
    while time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.1)
    print(json.dumps({"latencies_ms": [ms for each in sensors for ms in each.latencies_ms()]}))


main()
