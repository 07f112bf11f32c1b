"""What the peers put into a message, so that whoever receives it can tell what is missing or broken.

The bytes of a `std_msgs/msg/UInt8MultiArray`: number (u64), time of writing (u64, CLOCK_MONOTONIC
[ns]), CRC-32 of everything else (u32), filler; all little-endian. `fastdds/payload.hpp` is its twin.
"""

import struct
import time
import zlib
from dataclasses import dataclass, field

TYPE = "std_msgs/msg/UInt8MultiArray"
HEAD = struct.Struct("<QQI")
CRC_AT = 16


def fill(buffer: bytearray, offset: int, number: int) -> None:
    """Writes message `number` into everything from `offset` on; the filler stays as it is."""
    HEAD.pack_into(buffer, offset, number, time.monotonic_ns(), 0)
    HEAD.pack_into(buffer, offset, number, HEAD.unpack_from(buffer, offset)[1], _crc(buffer, offset))


def read(buffer: bytes, offset: int = 0) -> tuple[int, int] | None:
    """The number and time of writing; `None` when the message is not as it was written."""
    if len(buffer) < offset + HEAD.size:
        return None
    number, written_ns, crc = HEAD.unpack_from(buffer, offset)
    return (number, written_ns) if crc == _crc(buffer, offset) else None


def _crc(buffer: bytes, offset: int) -> int:
    view = memoryview(buffer)
    head = zlib.crc32(view[offset : offset + CRC_AT])
    return zlib.crc32(view[offset + HEAD.size :], head)


@dataclass
class Tally:
    """What arrived on one topic."""

    numbers: list[int] = field(default_factory=list)
    latencies_ms: list[float] = field(default_factory=list)
    corrupt: int = 0

    def add(self, buffer: bytes, offset: int = 0) -> None:
        """Counts a message that has just arrived."""
        content = read(buffer, offset)
        if content is None:
            self.corrupt += 1
            return
        self.numbers.append(content[0])
        self.latencies_ms.append((time.monotonic_ns() - content[1]) / 1e6)

    def summary(self) -> dict:
        """Counts, as they are told on standard output."""
        seen = set(self.numbers)
        return {
            "received": len(self.numbers),
            "corrupt": self.corrupt,
            "first": min(seen, default=None),
            "last": max(seen, default=None),
            "missing": max(seen) - min(seen) + 1 - len(seen) if seen else 0,
            "duplicates": len(self.numbers) - len(seen),
            "out_of_order": sum(b < a for a, b in zip(self.numbers, self.numbers[1:])),
        }
