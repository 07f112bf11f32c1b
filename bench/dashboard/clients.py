"""Measures what many viewers cost, and what a viewer behind a slow link receives: markers first."""

import asyncio
import contextlib
import json
import os
import struct
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from statistics import quantiles

import harness
import websockets
from cameras import Cameras
from figures import Figures

CLIENTS = 20
WATCHED_SECS = int(os.environ.get("SECONDS_EACH", "10"))
LINK_BYTES_PER_SEC = 5_000_000 // 8
# As many as a router holds for a link that is full.
LINK_QUEUE_BYTES = 64 << 10
PICTURE_BYTES = 45_600  # 1280 x 720 at JPEG quality 75
CAMERAS = ("front", "back")
MARKERS = 150
MARKERS_HZ = 5
STUDY = """
[session]
name = "slow_link"
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed", "back/compressed"]
[[sources]]
type = "people"
namespace = "/humans/persons/*"
[[sinks]]
type = "bag"
tidy = false
[simulate]
robots = 5
people = 1
"""


class Link:
    """Passes a connection through a link with this many bytes per second towards the client."""

    def __init__(self, port: int):
        self.port = port

    async def __aenter__(self):
        self._server = await asyncio.start_server(self._pass, "127.0.0.1", 0, limit=LINK_QUEUE_BYTES)
        return self._server.sockets[0].getsockname()[1]

    async def __aexit__(self, *_):
        self._server.close()

    async def _pass(self, reader, writer):
        theirs, ours = await asyncio.open_connection("127.0.0.1", self.port, limit=LINK_QUEUE_BYTES)
        with contextlib.suppress(ConnectionError):
            await asyncio.gather(self._copy(reader, ours, None), self._copy(theirs, writer, LINK_BYTES_PER_SEC))

    @staticmethod
    async def _copy(reader, writer, bytes_per_sec):
        free_at = time.monotonic()
        while content := await reader.read(4096):
            if bytes_per_sec:
                free_at = max(free_at, time.monotonic() - 0.005) + len(content) / bytes_per_sec
                await asyncio.sleep(max(0.0, free_at - time.monotonic()))
            writer.write(content)
            await writer.drain()
        writer.close()


async def view(address: str, wants, seen=None, until=None):
    """Views a session like a page: draws some streams and acknowledges pictures."""
    async with websockets.connect(f"{address.replace('http', 'ws')}/ws", max_size=None) as socket:
        async for message in socket:
            if isinstance(message, bytes):
                stream, channels = struct.unpack_from("<II", message)
                if channels == 0:
                    await socket.send(json.dumps({"type": "shown", "streams": [stream]}))
                    if seen is not None:
                        seen["pictures"] += 1
                continue
            content = json.loads(message)
            if content["type"] == "streams":
                chosen = [{"stream": each["id"], "points_per_sec": points} for each in content["streams"] for points in wants(each)]
                if chosen:
                    await socket.send(json.dumps({"type": "want", "streams": chosen}))
            elif content["type"] == "events" and seen is not None:
                now = time.monotonic()
                for each in content["events"]:
                    if each["kind"] == "marker":
                        seen["markers"].setdefault(each["label"], now)
            elif content["type"] == "missed" and seen is not None:
                seen["missed"] = content
            if until is not None and until.is_set():
                return


def as_team_page(stream) -> list[float]:
    return [60.0] if stream["shape"] == "wave" and stream["signal"] in ("ecg", "eda", "respiration") else []


async def many(address: str, monitor) -> tuple[float, float]:
    """Returns the processor use of the monitor without viewers, and with twenty [cores]."""

    async def taken() -> float:
        before_secs, began_secs = monitor.cpu_secs(), time.monotonic()
        await asyncio.sleep(WATCHED_SECS)
        return (monitor.cpu_secs() - before_secs) / (time.monotonic() - began_secs)

    alone = await taken()
    viewers = [asyncio.create_task(view(address, as_team_page)) for _ in range(CLIENTS)]
    await asyncio.sleep(3)
    watched = await taken()
    assert not any(viewer.done() for viewer in viewers)
    for viewer in viewers:
        viewer.cancel()
    await asyncio.gather(*viewers, return_exceptions=True)
    return alone, watched


async def slow(address: str) -> tuple[dict, dict[str, float]]:
    """Returns what a viewer behind a slow link sees, and when each marker was set."""
    seen = {"pictures": 0, "markers": {}, "missed": {}}
    until = asyncio.Event()
    port = int(address.rpartition(":")[2])

    def wants(stream) -> list[float]:
        return [0.0] if stream["name"].endswith("/compressed") else as_team_page(stream)

    def mark(label: str) -> float:
        content = json.dumps({"label": label}).encode()
        request = urllib.request.Request(f"{address}/api/events", content, {"Content-Type": "application/json"})
        at = time.monotonic()
        urllib.request.urlopen(request).read()
        return at

    async with Link(port) as through:
        viewer = asyncio.create_task(view(f"http://127.0.0.1:{through}", wants, seen, until))
        await asyncio.sleep(5)
        set_at = {}
        for number in range(MARKERS):
            set_at[f"m{number}"] = await asyncio.to_thread(mark, f"m{number}")
            await asyncio.sleep(1 / MARKERS_HZ)
        await asyncio.sleep(3)
        until.set()
        viewer.cancel()
        await asyncio.gather(viewer, return_exceptions=True)
    return seen, set_at


def main() -> int:
    figure = Figures()

    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=62)
        try:
            demo = stage.teampulse("demo", "--out", stage.folder / "demo")
            address = demo.wait_for(r"dashboard is at (http://\S+?)/?$")[1]
            time.sleep(5)
            alone, watched = asyncio.run(many(address, demo))
            demo.interrupt()
        finally:
            stage.close()
    figure(f"the demo with {CLIENTS} viewers: {watched:.0%} of a core (bar 25 %); without any {alone:.0%}", watched < 0.25)

    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=63)
        try:
            study, out = stage.study(STUDY), stage.folder / "sessions"
            monitor = stage.teampulse("run", study, "--out", out)
            address = monitor.wait_for(r"dashboard is at (http://\S+?)/?$")[1]
            stage.teampulse("simulate", study)
            # No pictures, as nothing here decodes them.
            files = [b"\xff\xd8\xff" + os.urandom(PICTURE_BYTES - 3) for _ in range(4)]
            with Cameras(stage, [f"/robot1/{name}/compressed" for name in CAMERAS], files):
                seen, set_at = asyncio.run(slow(address))
            code = monitor.interrupt()
            info = json.loads(stage.ask("info", harness.the_bag(out), "--json").stdout)
        finally:
            stage.close()
    arrived = seen["markers"]
    late = [1000 * (arrived[label] - at) for label, at in set_at.items() if label in arrived]
    cuts = quantiles(late, n=100)
    lost = sum(each.get("lost") or 0 for each in info["streams"])
    figure(f"over 5 Mbit/s with two 720p cameras: {len(set_at) - len(late)} of {len(set_at)} markers lost (bar 0)", len(late) == len(set_at))
    figure(f"  from a marker to the viewer: p50 {cuts[49]:.0f} ms, p99 {cuts[98]:.0f} ms (bar 300)", cuts[98] <= 300)
    pictures_hz = seen["pictures"] / (8 + MARKERS / MARKERS_HZ)
    figure(f"  pictures: {pictures_hz:.1f} per second; skipped and counted {seen['missed'].get('pictures', 0)}", seen["missed"].get("pictures", 0) > 0)
    figure(f"  the recording beside it: {lost} messages lost (bar 0), exit code {code}", lost == 0 and code == 0)
    return figure.exit_code()


if __name__ == "__main__":
    sys.exit(main())
