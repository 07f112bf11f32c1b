"""What the programs of a test send on their network, byte for byte."""

import socket
import struct
import threading
from collections import defaultdict
from pathlib import Path

EVERY_PROTOCOL = 3
# SO_RCVBUFFORCE, which Python has no name for.
FORCED_RECEIVE_BUFFER = 33
ETHERNET_BYTES = 14
UDP_BYTES, UDP = 8, 17
# Enough for seconds in which Python has other things to do [bytes].
BUFFER_BYTES = 64 << 20


class Sniffer:
    """Keeps every datagram that is sent over loopback, by the port that it comes from."""

    def __init__(self):
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(EVERY_PROTOCOL))
        self._socket.setsockopt(socket.SOL_SOCKET, FORCED_RECEIVE_BUFFER, BUFFER_BYTES)
        self._socket.bind(("lo", 0))
        self._socket.settimeout(0.2)
        self._sent: dict[int, list[bytes]] = defaultdict(list)
        self._is_over = threading.Event()
        self._listening = threading.Thread(target=self._listen, daemon=True)
        self._listening.start()

    def _listen(self) -> None:
        while not self._is_over.is_set():
            try:
                frame, (_, _, kind, *_) = self._socket.recvfrom(1 << 17)
            except TimeoutError:
                continue
            packet = frame[ETHERNET_BYTES:]
            # Each passes twice: once going out, once coming in.
            if kind == socket.PACKET_OUTGOING and packet[0] >> 4 == 4 and packet[9] == UDP:
                datagram = packet[4 * (packet[0] & 15) :]
                (port,) = struct.unpack_from(">H", datagram)
                self._sent[port].append(datagram[UDP_BYTES:])

    def stop(self) -> dict[int, list[bytes]]:
        """All that was sent, by port."""
        self._is_over.set()
        self._listening.join()
        self._socket.close()
        return dict(self._sent)


def ports(pid: int) -> set[int]:
    """The UDP ports of a process."""
    files = (each.readlink().name for each in Path(f"/proc/{pid}/fd").iterdir())
    inodes = {name[len("socket:[") : -1] for name in files if name.startswith("socket:[")}
    lines = Path(f"/proc/{pid}/net/udp").read_text().splitlines()[1:]
    rows = (line.split() for line in lines)
    return {int(row[1].rpartition(":")[2], 16) for row in rows if row[9] in inodes}
