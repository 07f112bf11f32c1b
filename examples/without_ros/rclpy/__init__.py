"""A stand-in for `rclpy` where no ROS is installed: enough for nodes that listen and publish.

It speaks the same on the wire, through PyPI's `cyclonedds`:

    PYTHONPATH=examples/without_ros python3 examples/own_feature.py
"""

from cyclonedds.util import duration

from rclpy.node import Node


def init() -> None:
    """Does nothing: a node joins its domain by itself."""


def create_node(name: str) -> Node:
    """A node in the domain of `ROS_DOMAIN_ID`."""
    return Node(name)


def spin(node: Node) -> None:
    """Hands over what the node's subscriptions hear, until Ctrl-C."""
    while True:
        spin_once(node)


def spin_once(node: Node, *, timeout_sec: float = 1.0) -> None:
    """Waits for something to hear, and hands it over."""
    node.arrived.wait(duration(seconds=timeout_sec))
    for subscription in node.subscriptions:
        subscription.hand_over()
