"""Cameras on the dashboard: what a robot publishes is seen on its pages, live and in a recording."""

import contextlib
import struct
import time
import zlib

import harness
import numpy
from rosbags.typesys import Stores, get_typestore
from test_dashboard_pages import AXE, SHOTS, address_of, chromium, screens, serious  # noqa: F401

STUDY = """
[session]
name = "video"
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["camera/image_raw", "front/compressed", "depth"]
[commands]
dashboard = ["mark", "stop"]
[[sinks]]
type = "bag"
tidy = false
[simulate]
robots = 2
camera_hz = 10
seed = 3
"""
SIZE = (64, 48)
# The sum of the red, green and blue of all pixels of a canvas.
LOOK = """(canvas) => {
  const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const sum = [0, 0, 0];
  for (let at = 0; at < data.length; at += 4) for (const k of [0, 1, 2]) sum[k] += data[at + k];
  return {size: [canvas.width, canvas.height], sum};
}"""


def png(colour: tuple[int, int, int]) -> bytes:
    """A picture of one colour."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    width, height = SIZE
    rows = (b"\0" + bytes(colour) * width) * height
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def compressed(content: bytes, picture_format="png") -> str:
    """A message, as hexadecimal."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")
    name = "sensor_msgs/msg/CompressedImage"
    message = types[name](header=header, format=picture_format, data=numpy.frombuffer(content, dtype="uint8"))
    return bytes(store.serialize_cdr(message, name)).hex()


def camera(page, name: str):
    """The picture of a camera on a page."""
    figure = page.locator(f".videos figure:has(b[title='{name}'])").first
    figure.wait_for()
    return figure


def sent_until(sender, message: str, found) -> None:
    """Sends a picture again and again, as a camera does, until something is found."""

    def look() -> bool:
        sender.say(message)
        time.sleep(0.2)
        return found()

    harness.eventually(look)


def test_cameras_are_seen_live_and_in_a_recording(stage, screens):  # noqa: F811
    study, out = stage.study(STUDY), stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out)
    address = address_of(monitor)
    simulated = stage.teampulse("simulate", study)
    sender = stage.cyclone("send", "/robot2/front/compressed", "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
    depth = stage.cyclone("send", "/robot2/depth", "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
    for program in (sender, depth):
        program.answer("matched")
    page = screens(address).page

    # A robot's own pixels, as they change; and a file of another program, as it came.
    arena = camera(page, "/robot1/camera/image_raw").locator("canvas")
    harness.eventually(lambda: arena.evaluate(LOOK)["size"] == list(SIZE))
    first = arena.evaluate(LOOK)["sum"]
    assert min(first) > 0
    harness.eventually(lambda: arena.evaluate(LOOK)["sum"] != first)
    front = camera(page, "/robot2/front/compressed").locator("canvas")
    pixels = SIZE[0] * SIZE[1]
    for colour in ((200, 10, 10), (10, 200, 10)):
        of_colour = [part * pixels for part in colour]
        sent_until(sender, compressed(png(colour)), lambda: front.evaluate(LOOK)["sum"] == of_colour)
    # What no browser knows has a reason; what is cut off hurts nobody.
    unknown = camera(page, "/robot2/depth")
    nothing_known = compressed(b"\0" * 100, "16UC1; compressedDepth png")
    sent_until(depth, nothing_known, lambda: "compressedDepth" in unknown.inner_text())
    front_words = camera(page, "/robot2/front/compressed")
    sent_until(sender, compressed(png((10, 10, 10))[:20]), lambda: "decoded" in front_words.inner_text())
    of_blue = [10 * pixels, 10 * pixels, 200 * pixels]
    sent_until(sender, compressed(png((10, 10, 200))), lambda: front.evaluate(LOOK)["sum"] == of_blue)
    for name in ("team", "signals"):
        page.goto(f"{address}#/{name}")
        harness.eventually(lambda: camera(page, "/robot1/camera/image_raw").locator("canvas").evaluate(LOOK)["size"] == list(SIZE))
        page.screenshot(path=SHOTS / f"video_{name}.png")
        if AXE.exists():
            assert serious(page) == [], name

    # Long enough for three moments of the recording. A robot that is gone leaves a picture that is plainly old.
    page.wait_for_timeout(3000)
    assert simulated.interrupt() == 0
    harness.eventually(lambda: "ago" in camera(page, "/robot1/camera/image_raw").inner_text())
    assert monitor.interrupt() == 0

    player = stage.teampulse("play", harness.the_bag(out), "--no-ros")
    address = player.wait_for(r"the dashboard is at (http://\S+)/")[1]
    page = screens(f"{address}/", linked="connected").page
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-label=Play]")
    arena = camera(page, "/robot1/camera/image_raw").locator("canvas")
    page.keyboard.press("Home")
    seen = set()

    def position() -> str:
        return page.locator("[data-testid=position] b").inner_text()

    # The robots came some time after the recording began.
    for _ in range(20):
        before = position()
        page.keyboard.press("ArrowRight")
        harness.eventually(lambda: position() != before)
        with contextlib.suppress(AssertionError):
            harness.eventually(lambda: min(look := arena.evaluate(LOOK)["sum"]) > 0 and tuple(look) not in seen, 3)
            seen.add(tuple(arena.evaluate(LOOK)["sum"]))
        if len(seen) == 3:
            break
    assert len(seen) == 3, "each moment has its picture"
