#!/usr/bin/env python3
"""Your own feature as a ROS node: how restless the skin is, once a second [uS]."""

from statistics import fmean

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from teampulse_msgs.msg import Sample, StreamDescription, Wave

INPUT = "/humans/persons/p001/simulated/eda_fingers"
OUTPUT = "/humans/persons/p001/own/skin_unrest"


def hear(wave):
    second.extend(wave.samples)
    if len(second) >= 128:
        mean = fmean(second)
        unrest = fmean(abs(value - mean) for value in second)
        output.publish(Sample(header=wave.header, device_time=wave.device_time, values=[unrest]))
        second.clear()


rclpy.init()
node, second = rclpy.create_node("skin_unrest"), []
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
streams = node.create_publisher(StreamDescription, "/teampulse/streams", latched)
streams.publish(
    StreamDescription(
        name=OUTPUT, type="teampulse_msgs/msg/Sample", signal="other", id="p001", device="own",
        inputs=[INPUT], method="mean absolute deviation of a second", doc="how restless the skin is",
        channels=["unrest"], units=["uS"], rate_hz=1.0,
    )
)  # fmt: skip
output = node.create_publisher(Sample, OUTPUT, 10)
node.create_subscription(Wave, INPUT, hear, 10)
rclpy.spin(node)
