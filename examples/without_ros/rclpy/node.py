"""A node: a participant in a ROS domain, with what it publishes and hears."""

import os
from collections.abc import Callable

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from rclpy.qos import QoSProfile

ANY = SampleState.Any | ViewState.Any | InstanceState.Any
# As rmw_cyclonedds configures every node; what the environment says comes after, and wins.
AS_ROS = (
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex></Discovery>"
)


class Publisher:
    """Publishes messages of one topic."""

    def __init__(self, topic: Topic, qos: QoSProfile, participant: DomainParticipant):
        self._writer = DataWriter(participant, topic, qos=qos.dds())

    def publish(self, message: object) -> None:
        self._writer.write(message)


class Subscription:
    """Hears the messages of one topic."""

    def __init__(self, topic: Topic, qos: QoSProfile, participant: DomainParticipant, callback):
        self._reader = DataReader(participant, topic, qos=qos.dds())
        self._callback = callback
        self.arrived = ReadCondition(self._reader, ANY)

    def hand_over(self) -> None:
        for message in self._reader.take(100):
            if message.sample_info.valid_data:
                self._callback(message)


class Node:
    """In the domain of `ROS_DOMAIN_ID`."""

    def __init__(self, name: str):
        os.environ["CYCLONEDDS_URI"] = f"{AS_ROS},{os.environ.get('CYCLONEDDS_URI', '')}"
        self.name = name
        self.participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
        self.subscriptions: list[Subscription] = []
        self.arrived = WaitSet(self.participant)

    def create_publisher(self, kind: type, name: str, qos: QoSProfile | int) -> Publisher:
        return Publisher(self._topic(kind, name), profile(qos), self.participant)

    def create_subscription(
        self, kind: type, name: str, callback: Callable, qos: QoSProfile | int
    ) -> Subscription:
        topic = self._topic(kind, name)
        subscription = Subscription(topic, profile(qos), self.participant, callback)
        self.arrived.attach(subscription.arrived)
        self.subscriptions.append(subscription)
        return subscription

    def _topic(self, kind: type, name: str) -> Topic:
        return Topic(self.participant, f"rt{name}", kind)


def profile(qos: QoSProfile | int) -> QoSProfile:
    return qos if isinstance(qos, QoSProfile) else QoSProfile(depth=qos)
