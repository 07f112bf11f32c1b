"""What the peers put into a message, so that its receiver knows what is missing or broken.

The bytes of a `std_msgs/msg/UInt8MultiArray`: number (u64), time of writing (u64, CLOCK_MONOTONIC
[ns]), CRC-32 of everything else (u32), filler; all little-endian. Its twin is
`fastdds/payload.hpp`.
"""

import struct
import time
import zlib
from dataclasses import dataclass, field
from itertools import pairwise

TYPE = "std_msgs/msg/UInt8MultiArray"
HEAD = struct.Struct("<QQI")
CRC_AT = 16


def fill(buffer: bytearray, offset: int, number: int) -> None:
    """Writes message `number` into everything from `offset` on; the filler stays as it is."""
    written_ns = time.monotonic_ns()
    HEAD.pack_into(buffer, offset, number, written_ns, 0)
    HEAD.pack_into(buffer, offset, number, written_ns, _crc(memoryview(buffer)[offset:]))


def content(cdr: bytes) -> memoryview:
    """The bytes in a UInt8MultiArray with an empty layout: after a header and three lengths."""
    size = int.from_bytes(cdr[12:16], "little")
    return memoryview(cdr)[16 : 16 + size]


def read(content: memoryview) -> tuple[int, int] | None:
    """The number and time of writing; `None` when the message is not as it was written."""
    if len(content) < HEAD.size:
        return None
    number, written_ns, crc = HEAD.unpack_from(content)
    return (number, written_ns) if crc == _crc(content) else None


def _crc(content: memoryview) -> int:
    return zlib.crc32(content[HEAD.size :], zlib.crc32(content[:CRC_AT]))


@dataclass
class Tally:
    """What arrived on one topic."""

    numbers: list[int] = field(default_factory=list)
    corrupt: int = 0

    def add(self, cdr: bytes) -> int | None:
        """Counts a message; gives the time of writing [ns], unless it is corrupt."""
        head = read(content(cdr))
        if head is None:
            self.corrupt += 1
            return None
        self.numbers.append(head[0])
        return head[1]

    def summary(self) -> dict:
        """Counts, as they are printed on standard output."""
        seen = set(self.numbers)
        return {
            "received": len(self.numbers),
            "corrupt": self.corrupt,
            "first": min(seen, default=None),
            "last": max(seen, default=None),
            "missing": max(seen) - min(seen) + 1 - len(seen) if seen else 0,
            "duplicates": len(self.numbers) - len(seen),
            "out_of_order": sum(b < a for a, b in pairwise(self.numbers)),
        }
