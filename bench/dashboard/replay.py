"""Measures how soon a click on the timeline is shown in a recording of an hour, also in one with a camera."""

import shutil
import struct
import sys
import tempfile
from pathlib import Path

import harness
from cameras import HZ, compressed, drawn
from figures import Figures
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from playwright.sync_api import sync_playwright

RECORDED_SECS = 60
COPIES = 60
JUMPS = (0.9, 0.1, 0.55, 0.2, 0.75, 0.05, 0.97, 0.4, 0.65, 0.3)
BAR_SECS = 0.5
IMAGE = "\n".join((
    "std_msgs/Header header", "string format", "uint8[] data", 80 * "=", "MSG: std_msgs/Header", "builtin_interfaces/Time stamp",
    "string frame_id", 80 * "=", "MSG: builtin_interfaces/Time", "int32 sec", "uint32 nanosec",
))
FLAGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]

# Records when the page has all data of the clicked time, and when pictures were drawn.
WATCH = """
window.ready = [];
window.drawn = [];
const Socket = WebSocket;
window.WebSocket = class extends Socket {
  constructor(...all) {
    super(...all);
    this.addEventListener("message", ({data}) => {
      if (typeof data === "string" && data.startsWith('{"type":"ready"')) ready.push(performance.now());
    });
  }
};
const paint = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (image, ...rest) {
  if (image instanceof ImageBitmap) drawn.push(performance.now());
  return paint.call(this, image, ...rest);
};
addEventListener("pointerdown", (event) => (window.clicked = performance.now()), true);
"""


def an_hour_of(bag: Path, out: Path, pictures: list[bytes]) -> None:
    """Writes a recording repeatedly, each time later, with the stamps of our own messages and pictures of a camera."""
    with next(bag.glob("*.mcap")).open("rb") as stream, out.open("wb") as written:
        messages = [(schema, channel, message) for schema, channel, message in make_reader(stream).iter_messages()]
        first, last = messages[0][2].log_time, messages[-1][2].log_time
        writer = Writer(written, compression=CompressionType.ZSTD, chunk_size=4 << 20)
        writer.start(profile="ros2")
        schemas, channels = {}, {}
        for schema, channel, _ in messages:
            if channel.id in channels:
                continue
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, schemas[schema.id], channel.metadata)
        if pictures:
            schema = writer.register_schema("sensor_msgs/msg/CompressedImage", "ros2msg", IMAGE.encode())
            metadata = {"offered_qos_profiles": "", "topic_type_hash": ""}
            camera = writer.register_channel("/robot1/front/compressed", "cdr", schema, metadata)
        for copy in range(COPIES):
            shift = copy * (last - first + 1)
            due = first
            for schema, channel, message in messages:
                while pictures and due <= message.log_time:
                    stamp = due + shift
                    file = pictures[(due - first) * HZ // 10**9 % len(pictures)]
                    writer.add_message(camera, stamp, compressed(file, stamp), stamp)
                    due += 10**9 // HZ
                data = message.data
                if schema.name.startswith("teampulse_msgs/") and len(data) >= 12:
                    secs, nanos = struct.unpack_from("<iI", data, 4)
                    stamp = secs * 10**9 + nanos + shift
                    data = data[:4] + struct.pack("<iI", stamp // 10**9, stamp % 10**9) + data[12:]
                writer.add_message(channels[channel.id], message.log_time + shift, data, message.publish_time + shift, message.sequence)
        writer.finish()


def jumps_secs(browser, address: str, page_name: str, has_camera: bool) -> list[float]:
    """Returns the time from each click until the page has the clicked time, with its picture."""
    page = browser.new_page(viewport={"width": 1280, "height": 720}, bypass_csp=True)
    page.add_init_script(WATCH)
    page.goto(f"{address}#/{page_name}")
    page.wait_for_selector("text='click or drag to go there'", timeout=120_000)
    page.wait_for_timeout(2000)
    if has_camera:
        page.wait_for_function("drawn.length > 0")
    took = []
    for share in JUMPS:
        box = page.locator(".player canvas").first.bounding_box()
        page.evaluate("ready.length = drawn.length = 0")
        page.mouse.click(box["x"] + 88 + (box["width"] - 88) * share, box["y"] + box["height"] / 2)
        page.wait_for_function("ready.length > 0")
        if has_camera:
            page.wait_for_function("drawn.at(-1) > ready.at(-1)")
        last = "drawn.find((at) => at > ready.at(-1))" if has_camera else "ready.at(-1)"
        took.append(page.evaluate(f"{last} - clicked") / 1000)
        page.wait_for_timeout(300)
    page.close()
    return took


def main() -> int:
    figure = Figures()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        stage = harness.Stage(Path(folder), domain=62)
        try:
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            artist = browser.new_page()
            files = drawn(artist, (640, 480), 30)
            artist.close()
            demo, hour = stage.demo(RECORDED_SECS), stage.folder / "hour.mcap"
            for page, pictures, words in (("session", [], ""), ("signals", files, ", with a camera of 30 Hz,")):
                an_hour_of(demo, hour, pictures)
                player = stage.teampulse("play", hour, "--no-ros")
                address = player.wait_for(r"dashboard is at (http://\S+)")[1]
                took = jumps_secs(browser, address, page, bool(pictures))
                player.interrupt()
                hours, gigabytes = COPIES * RECORDED_SECS / 3600, hour.stat().st_size / 1e9
                text = f"a click on the timeline of {hours:.0f} h{words} ({gigabytes:.1f} GB) lands after {sorted(took)[len(took) // 2]:.2f} s"
                figure(f"{text}, at most {max(took):.2f} s (bar {BAR_SECS})", max(took) <= BAR_SECS)
            browser.close()
        finally:
            stage.close()
    return figure.exit_code()


if __name__ == "__main__":
    sys.exit(main())
