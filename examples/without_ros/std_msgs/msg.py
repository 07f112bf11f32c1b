"""`std_msgs/msg`, as far as it is needed here."""

from dataclasses import dataclass, field

from builtin_interfaces.msg import Time
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""
