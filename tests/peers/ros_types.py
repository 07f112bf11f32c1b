"""The few ROS messages that the Python peer declares to DDS itself, field by field.

What it declares is compared by Cyclone DDS with what others declare; other types are declared by
name only, and travel as bytes.
"""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, sequence, uint8, uint32
from rosbags.typesys import Stores, get_typestore


@dataclass
@final
class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
    label: str
    size: uint32
    stride: uint32


@dataclass
@final
class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
    dim: sequence[MultiArrayDimension]
    data_offset: uint32


@dataclass
@final
class UInt8MultiArray(IdlStruct, typename="std_msgs::msg::dds_::UInt8MultiArray_"):
    layout: MultiArrayLayout
    data: sequence[uint8]


def participant_entities_info(gid_bytes: int) -> type[IdlStruct]:
    """The message of `ros_discovery_info`: gids have 24 bytes in Humble, 16 since Iron."""

    @dataclass
    @final
    class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
        data: array[uint8, gid_bytes]

    @dataclass
    @final
    class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
        node_namespace: str
        node_name: str
        reader_gid_seq: sequence[Gid]
        writer_gid_seq: sequence[Gid]

    @dataclass
    @final
    class ParticipantEntitiesInfo(
        IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
    ):
        gid: Gid
        node_entities_info_seq: sequence[NodeEntitiesInfo]

    return ParticipantEntitiesInfo


def dds_type(ros_type: str) -> type[IdlStruct]:
    """The type as it is declared to DDS."""
    if ros_type == "std_msgs/msg/UInt8MultiArray":
        return UInt8MultiArray
    package, _, name = ros_type.split("/")
    return make_idl_struct(name, f"{package}::msg::dds_::{name}_", {})


def type_hash(ros_type: str) -> str | None:
    """The hash that a stock node would announce; `None` for a type that Jazzy does not ship."""
    store = get_typestore(Stores.ROS2_JAZZY)
    return store.hash_rihs01(ros_type) if ros_type in store.types else None
