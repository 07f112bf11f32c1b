"""Quality of service: as far as a topic of teampulse needs it."""

from dataclasses import dataclass
from enum import Enum

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration


class DurabilityPolicy(Enum):
    TRANSIENT_LOCAL = Policy.Durability.TransientLocal
    VOLATILE = Policy.Durability.Volatile


@dataclass(frozen=True)
class QoSProfile:
    """Reliable; so many messages are kept."""

    depth: int
    durability: DurabilityPolicy = DurabilityPolicy.VOLATILE

    def dds(self) -> Qos:
        """As DDS calls it; ROS 2 encodes by the first version of XCDR."""
        history = Policy.History.KeepLast(self.depth)
        return Qos(
            Policy.Reliability.Reliable(duration(seconds=10)),
            self.durability.value,
            history,
            # A late joiner gets what is set here, whatever the history holds.
            Policy.DurabilityService(duration(seconds=0), history, -1, -1, -1),
            Policy.DataRepresentation(use_xcdrv2_representation=False),
        )
