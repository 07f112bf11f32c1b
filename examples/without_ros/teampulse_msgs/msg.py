"""The messages of `msgs/teampulse_msgs`, as Cyclone DDS for Python needs them; documented there."""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, float64, int64, sequence, uint8, uint32, uint64
from std_msgs.msg import Header


@dataclass
@final
class Sample(IdlStruct, typename="teampulse_msgs::msg::dds_::Sample_"):
    header: Header = field(default_factory=Header)
    device_time: int64 = 0
    index: uint64 = 0
    values: sequence[float64] = field(default_factory=list)


@dataclass
@final
class Wave(IdlStruct, typename="teampulse_msgs::msg::dds_::Wave_"):
    header: Header = field(default_factory=Header)
    device_time: int64 = 0
    index: uint64 = 0
    period_ns: float64 = 0.0
    channels: uint32 = 0
    samples: sequence[float64] = field(default_factory=list)


@dataclass
@final
class Feature(IdlStruct, typename="teampulse_msgs::msg::dds_::Feature_"):
    header: Header = field(default_factory=Header)
    window_secs: float64 = 0.0
    coverage: float32 = 0.0
    quality: float32 = 0.0
    values: sequence[float64] = field(default_factory=list)
    sigmas: sequence[float64] = field(default_factory=list)
    reasons: sequence[uint8] = field(default_factory=list)


@dataclass
@final
class Event(IdlStruct, typename="teampulse_msgs::msg::dds_::Event_"):
    header: Header = field(default_factory=Header)
    device_time: int64 = 0
    kind: str = ""
    label: str = ""
    value: float64 = 0.0
    duration_secs: float64 = 0.0


@dataclass
@final
class StreamDescription(IdlStruct, typename="teampulse_msgs::msg::dds_::StreamDescription_"):
    header: Header = field(default_factory=Header)
    name: str = ""
    type: str = ""
    signal: str = ""
    about: uint8 = 0
    id: str = ""
    device: str = ""
    origin: uint8 = 0
    inputs: sequence[str] = field(default_factory=list)
    method: str = ""
    channels: sequence[str] = field(default_factory=list)
    units: sequence[str] = field(default_factory=list)
    rate_hz: float64 = 0.0
    scales: sequence[float64] = field(default_factory=list)
    doc: str = ""
    family: str = ""
    window_secs: float64 = 0.0
    beside: str = ""
