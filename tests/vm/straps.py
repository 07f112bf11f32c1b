"""A Polar H10 and another maker's strap as GATT servers of PyPI's `bumble`, on virtual controllers whose other
end is the kernel's Bluetooth stack. Their bytes follow Polar's and the Bluetooth SIG's documents.

Writes what they sent, and when, to a file once a second. usage: straps.py FILE"""

import asyncio
import json
import struct
import sys
import time
from pathlib import Path

from bumble.controller import Controller
from bumble.core import UUID, AdvertisingData
from bumble.device import Device
from bumble.gatt import Characteristic, CharacteristicValue, Service
from bumble.hci import Address
from bumble.host import Host
from bumble.link import LocalLink
from bumble.transport import open_transport
from heart import FRAME_SAMPLES, H10, OTHER, ecg_uv, interval_steps

PMD = "FB005C8{}-02E7-F387-1CAD-8ACD2D8DF0C8"
SAMPLES_PER_SEC = 130
# The H10 counts ns since 2000-01-01.
EPOCH_NS = 946_684_800_000_000_000
DROP_AFTER_FRAMES = 20

READ, WRITE = Characteristic.Properties.READ, Characteristic.Properties.WRITE
NOTIFY, INDICATE = Characteristic.Properties.NOTIFY, Characteristic.Properties.INDICATE
READABLE, WRITEABLE = Characteristic.Permissions.READABLE, Characteristic.Permissions.WRITEABLE


class Link(LocalLink):
    """Finds the sender of a packet by the address it connected with: Linux connects with its public one."""

    def send_acl_data(self, sender_controller, destination_address, transport, data):
        link = sender_controller.le_connections.get(destination_address)
        own = link.self_address if link else sender_controller.random_address
        if there := self.find_le_controller(destination_address):
            asyncio.get_running_loop().call_soon(
                lambda: there.on_link_acl_data(own, transport, data)
            )


class Strap:
    """What every strap has: heart rate with intervals, and a battery."""

    def __init__(self, link: LocalLink, name: str, address: str, log: dict):
        self.log, self.beat = log, 0
        self.rate = Characteristic(UUID.from_16_bits(0x2A37), NOTIFY, READABLE, b"")
        battery = Characteristic(UUID.from_16_bits(0x2A19), READ | NOTIFY, READABLE, bytes([87]))
        host = Host()
        host.controller = Controller(name, link=link, public_address=address)
        self.device = Device(name, address=Address(address), host=host)
        self.device.add_services(
            [
                Service(UUID.from_16_bits(0x180D), [self.rate]),
                Service(UUID.from_16_bits(0x180F), [battery]),
            ]
        )
        uuids = AdvertisingData.INCOMPLETE_LIST_OF_16_BIT_SERVICE_CLASS_UUIDS
        self.device.advertising_data = bytes(
            AdvertisingData(
                [
                    (AdvertisingData.COMPLETE_LOCAL_NAME, name.encode()),
                    (uuids, bytes([0x0D, 0x18])),
                ]
            )
        )
        self.device.on("connection", self.connected)

    def connected(self, connection) -> None:
        self.log["connected_secs"].append(time.time())
        connection.on("disconnection", lambda _: self.disconnected())

    def disconnected(self) -> None:
        self.log["disconnected_secs"].append(time.time())

    async def begin(self) -> None:
        await self.device.power_on()
        await self.device.start_advertising(auto_restart=True)

    async def beats(self) -> None:
        """A measurement a second with the intervals since the last, whoever listens."""
        due_secs = time.time()
        reported_until_secs = 0.0
        while True:
            due_secs += 1
            await asyncio.sleep(max(0, due_secs - time.time()))
            intervals = []
            while reported_until_secs + interval_steps(self.beat) / 1024 <= due_secs - began_secs:
                reported_until_secs += interval_steps(self.beat) / 1024
                intervals.append(interval_steps(self.beat))
                self.beat += 1
            value = struct.pack(f"<BB{len(intervals)}H", 0x10 if intervals else 0, 75, *intervals)
            if self.device.connections:
                await self.device.notify_subscribers(self.rate, value)
                self.log["intervals"].append([time.time(), intervals])


class PolarH10(Strap):
    """Also an ECG, on Polar's measurement data service."""

    def __init__(self, link: LocalLink, log: dict):
        super().__init__(link, "Polar H10 1A000001", H10, log)
        self.streams = False
        self.control = Characteristic(
            PMD.format(1),
            READ | WRITE | INDICATE,
            READABLE | WRITEABLE,
            CharacteristicValue(read=self.features, write=self.asked),
        )
        self.data = Characteristic(PMD.format(2), NOTIFY, READABLE, b"")
        self.device.add_services([Service(PMD.format(0), [self.control, self.data])])

    def disconnected(self) -> None:
        super().disconnected()
        self.streams = False

    @staticmethod
    def features(_connection) -> bytes:
        """ECG and acceleration."""
        return bytes([0x0F, 0b0000_0101, *[0] * 15])

    def asked(self, _connection, value: bytes) -> None:
        command, measurement = value[0], value[1] if len(value) > 1 else 0
        self.log["commands"].append(value.hex())
        rate_130_hz_of_14_bits = bytes([0, 1, 0x82, 0, 1, 1, 14, 0])
        if measurement != 0:
            answer = bytes([0xF0, command, measurement, 3, 0])  # not supported
        elif command == 1:
            answer = bytes([0xF0, 1, 0, 0, 0]) + rate_130_hz_of_14_bits
        else:
            self.streams = command == 2
            answer = bytes([0xF0, command, 0, 0, 0])
        indicated = self.device.indicate_subscribers(self.control, answer)
        asyncio.get_running_loop().create_task(indicated)

    async def ecg(self) -> None:
        """Frames of 73 samples, and one loss of the link after some of them."""
        frame, sent = 0, 0
        while True:
            frame += 1
            due_secs = began_secs + frame * FRAME_SAMPLES / SAMPLES_PER_SEC
            await asyncio.sleep(max(0, due_secs - time.time()))
            if not (self.streams and self.device.connections):
                continue
            first, last = (frame - 1) * FRAME_SAMPLES, frame * FRAME_SAMPLES
            stamp_ns = int(began_secs * 1e9) + last * 1_000_000_000 // SAMPLES_PER_SEC - EPOCH_NS
            samples = b"".join(struct.pack("<i", ecg_uv(n))[:3] for n in range(first, last))
            head = bytes([0]) + struct.pack("<Q", stamp_ns) + bytes([0])
            await self.device.notify_subscribers(self.data, head + samples)
            self.log["frames"].append([time.time(), first])
            sent += 1
            if sent == DROP_AFTER_FRAMES:
                self.streams = False
                await next(iter(self.device.connections.values())).disconnect()


async def write(logs: dict, file: Path) -> None:
    while True:
        await asyncio.sleep(1)
        unfinished = file.with_suffix(".new")
        unfinished.write_text(json.dumps(logs))
        unfinished.rename(file)


def new_log() -> dict:
    names = ("connected_secs", "disconnected_secs", "intervals", "frames", "commands")
    return {name: [] for name in names}


async def main() -> None:
    link = Link()
    kernel = await open_transport("vhci")
    _adapter = Controller(
        "adapter",
        host_source=kernel.source,
        host_sink=kernel.sink,
        link=link,
        public_address="00:AA:01:00:00:01",
    )
    logs = {"h10": new_log(), "other": new_log()}
    h10, other = PolarH10(link, logs["h10"]), Strap(link, "Strap 7", OTHER, logs["other"])
    await h10.begin()
    await other.begin()
    print("advertising", flush=True)
    await asyncio.gather(h10.beats(), h10.ecg(), other.beats(), write(logs, Path(sys.argv[1])))


began_secs = time.time()
asyncio.run(main())
