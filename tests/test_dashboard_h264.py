"""Video of H.264 on the dashboard: frames that need those before, live and in a recording, as the browser decodes them."""

import base64
import struct
import threading
import time

import bags
import harness
import pytest
from test_dashboard_pages import SHOTS, address_of, chromium, screens  # noqa: F401

STUDY = """
[session]
name = "h264"
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/h264", "side/h264", "back/ffmpeg"]
[[sinks]]
type = "bag"
tidy = false
"""
FRONT, SIDE, BACK = "/robot1/front/h264", "/robot1/side/h264", "/robot1/back/ffmpeg"
VIDEO, PACKET = "foxglove_msgs/msg/CompressedVideo", "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
HZ, GROUP, GROUPS, SIZE = 10, 40, 3, (320, 240)
# The greys of three columns are the digits of a frame's number, to base 8, so that it can be read back. A group begins with
# a frame that needs none before.
ENCODED = """async ([group, groups, width, height]) => {
  const canvas = new OffscreenCanvas(width, height);
  const x = canvas.getContext("2d");
  const frames = [];
  let wrong;
  const encoder = new VideoEncoder({
    output: (chunk) => {
      const bytes = new Uint8Array(chunk.byteLength);
      chunk.copyTo(bytes);
      frames.push([chunk.type, btoa(String.fromCharCode(...bytes))]);
    },
    error: (error) => (wrong = error),
  });
  encoder.configure({codec: "avc1.42e01e", width, height, bitrate: 400_000, framerate: 10, latencyMode: "realtime", avc: {format: "annexb"}});
  for (let k = 0; k < group * groups; k += 1) {
    [0, 1, 2].forEach((digit) => {
      const grey = 20 + 30 * (Math.floor(k / 8 ** digit) % 8);
      x.fillStyle = `rgb(${grey}, ${grey}, ${grey})`;
      x.fillRect((digit * width) / 3, 0, width / 3 + 1, height);
    });
    const frame = new VideoFrame(canvas, {timestamp: k * 100_000});
    encoder.encode(frame, {keyFrame: k % group === 0});
    frame.close();
    await encoder.flush();
  }
  if (wrong) throw wrong;
  return frames;
}"""
# The number of the frame that a canvas shows; -1 without one.
NUMBER = """(canvas) => {
  if (canvas.width < 10) return -1;
  const {data} = canvas.getContext("2d").getImageData(0, canvas.height / 2, canvas.width, 1);
  const digit = (place) => Math.round((data[4 * Math.floor(((place + 0.5) / 3) * canvas.width)] - 20) / 30);
  return digit(0) + 8 * digit(1) + 64 * digit(2);
}"""


@pytest.fixture(scope="module")
def encoded(chromium, tmp_path_factory):  # noqa: F811
    """Frames that this browser encodes, each with its number; they need those before, but for the first of each group."""
    context = chromium.new_context()
    page = context.new_page()
    # An empty page of this machine is a secure one, without a server.
    page.route("http://localhost/", lambda route: route.fulfill(body="<title>encoder</title>", content_type="text/html"))
    page.goto("http://localhost/")
    if not page.evaluate("'VideoEncoder' in window"):
        pytest.skip("this browser has no WebCodecs")
    frames = page.evaluate(ENCODED, [GROUP, GROUPS, *SIZE])
    context.close()
    # An encoder may put in more of those that need none before.
    alone = [k for k, (kind, _) in enumerate(frames) if kind == "key"]
    assert {k * GROUP for k in range(GROUPS)} <= set(alone) and len(alone) < 2 * GROUPS
    return [base64.b64decode(content) for _, content in frames]


def text(content: str) -> bytes:
    return struct.pack("<I", len(content) + 1) + content.encode() + b"\0"


def padded(content: bytes, width: int) -> bytes:
    return content + bytes(-len(content) % width)


def header(stamp_secs: float = 0.0) -> bytes:
    return struct.pack("<iI", int(stamp_secs), int(stamp_secs % 1 * 1e9)) + text("camera")


def video(frame: bytes, video_format="h264", stamp_secs=0.0) -> str:
    """A foxglove_msgs/CompressedVideo, as hexadecimal."""
    body = padded(header(stamp_secs), 4) + struct.pack("<I", len(frame)) + frame
    return (b"\0\1\0\0" + padded(body, 4) + text(video_format)).hex()


def packet(frame: bytes) -> str:
    """An ffmpeg_image_transport_msgs/FFMPEGPacket, as hexadecimal."""
    body = padded(header(), 4) + struct.pack("<ii", *SIZE) + text("libx264;yuv420p;bgr8;bgr8")
    body = padded(body, 8) + struct.pack("<QBB", 7, 1, 0)
    return (b"\0\1\0\0" + padded(body, 4) + struct.pack("<I", len(frame)) + frame).hex()


class Camera:
    """A program that publishes frames at a steady pace, again and again, until it is stopped."""

    def __init__(self, sender, messages):
        self.sender, self.messages, self.is_over, self.sent = sender, messages, threading.Event(), 0
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self) -> None:
        began = time.monotonic()
        while not self.is_over.is_set():
            self.sender.say(self.messages(self.sent))
            self.sent += 1
            self.is_over.wait(max(0.0, began + self.sent / HZ - time.monotonic()))

    def stop(self) -> None:
        self.is_over.set()
        self.thread.join()


@pytest.fixture
def published(stage):
    """Publishes frames on topics."""
    cameras = []

    def publish(topic: str, kind: str, messages) -> Camera:
        sender = stage.cyclone("send", topic, "--type", kind, "--subscribers", 1)
        sender.answer("matched")
        cameras.append(Camera(sender, messages))
        return cameras[-1]

    yield publish
    for camera in cameras:
        camera.stop()


def shown(page, topic: str):
    """Reads the number of the frame that is shown of a camera."""
    canvas = page.locator(f".videos figure:has(b[title='{topic}']) canvas.picture").first
    canvas.wait_for()
    return lambda: canvas.evaluate(NUMBER)


def words(page, topic: str) -> str:
    return page.locator(f".videos figure:has(b[title='{topic}'])").first.inner_text()


def test_video_is_seen_live_from_its_last_whole_frame_on_and_what_cannot_be_shown_has_a_reason(stage, screens, encoded, published):  # noqa: F811
    count = len(encoded)
    monitor = stage.teampulse("run", stage.study(STUDY), "--out", stage.folder / "sessions")
    front = published(FRONT, VIDEO, lambda k: video(encoded[k % count], stamp_secs=time.time()))
    published(BACK, PACKET, lambda k: packet(encoded[k % count]))
    side = published(SIDE, VIDEO, lambda k: video(encoded[k % count], "h265"))
    address = address_of(monitor)
    page = screens(address).page
    for topic in (FRONT, BACK):
        number = shown(page, topic)
        harness.eventually(lambda: number() >= 0)
        # First it catches up with the present, from the last whole frame on.
        page.wait_for_timeout(1000)
        # Every frame is decoded: none of them is of another moment than those beside it.
        seen, began = [number()], time.monotonic()
        for _ in range(20):
            page.wait_for_timeout(50)
            seen.append(number())
        due = HZ * (time.monotonic() - began)
        steps = [(after - before) % count for before, after in zip(seen, seen[1:])]
        assert max(steps) <= due / 4 + 5 and 0.5 * due - 5 <= sum(steps) <= due + 10, (topic, seen, due)
    # It is shown as soon as it comes.
    behind = (front.sent - 1 - shown(page, FRONT)()) % count
    assert behind <= 5 or behind == count - 1
    assert "h265" in words(page, SIDE)
    side.messages = lambda k: video(b"\1\2\3\4" + encoded[k % count])
    harness.eventually(lambda: "Annex B" in words(page, SIDE))
    side.messages = lambda k: video(encoded[k % count])
    harness.eventually(lambda: shown(page, SIDE)() >= 0, within_secs=2 * GROUP / HZ + 10)
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / "h264-team.png")

    # One who joins in the middle of a group need not wait for the next.
    harness.eventually(lambda: 5 <= front.sent % GROUP <= 8, within_secs=2 * GROUP / HZ)
    began = front.sent
    late = screens(address).page
    number = shown(late, FRONT)
    harness.eventually(lambda: number() >= 0)
    assert (front.sent - began) < GROUP - 8, "before the next group began"
    # One on whose page no video is decoded reads why, and where it would be.
    plain = screens(address).page
    plain.add_init_script("delete globalThis.VideoDecoder")
    plain.reload()
    harness.eventually(lambda: "secure pages only" in words(plain, FRONT))
    plain.screenshot(path=SHOTS / "h264-not-secure.png")
    assert monitor.interrupt() == 0, monitor.report()


def test_a_jump_in_a_recording_starts_at_the_last_whole_frame_before(stage, screens, encoded, published, figure):  # noqa: F811
    count, out = len(encoded), stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(STUDY), "--out", out)
    front = published(FRONT, VIDEO, lambda k: video(encoded[k % count], stamp_secs=time.time()))
    harness.eventually(lambda: front.sent >= 1.2 * count, within_secs=60)
    front.stop()
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    # As they came, with the definition of their type.
    recorded = bags.messages(bag, FRONT)
    frames = [bytes(message.content.data) for message in recorded]
    assert len(recorded) > count and {message.content.format for message in recorded} == {"h264"}
    # Which of them came first is not known; frames may be equal.
    first = next(k for k in range(count) if frames == [encoded[(k + place) % count] for place in range(len(frames))])
    numbers = [(first + place) % count for place in range(len(frames))]
    began = min(stamp for _, stamp, _ in bags.stored(bag)) / 1e9

    player = stage.teampulse("play", bag, "--no-ros")
    page = screens(player.wait_for(r"the dashboard is at (http://\S+)/")[1] + "/", linked="connected").page
    page.wait_for_selector("[data-testid=player] >> text='click or drag to go there'")
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-label=Play]")
    number = shown(page, FRONT)
    page.keyboard.press("Home")
    page.wait_for_timeout(500)
    took = []
    for _ in range(10):
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(100)
        clock = page.locator("[data-testid=position] b").inner_text()
        at = began + sum(60**place * float(part) for place, part in enumerate(reversed(clock.split(":"))))
        before = [k for k, message in zip(numbers, recorded) if message.log_secs <= at]
        if not before:
            continue
        started = time.monotonic()
        # The position is read to a tenth of a second.
        after = [k for k, message in zip(numbers, recorded) if at <= message.log_secs < at + 0.15]
        harness.eventually(lambda: number() in [before[-1], *after])
        took.append(time.monotonic() - started)
    assert len(took) >= 5
    figure(f"after a jump the frame of that moment is shown within {max(took):.2f} s of {len(took)} jumps, in groups of {GROUP} frames")
    # And it goes on from there.
    page.keyboard.press("Space")
    seen = []
    for _ in range(30):
        seen.append(number())
        page.wait_for_timeout(50)
    assert len(set(seen)) >= 5 and all((b - a) % count <= 12 for a, b in zip(seen, seen[1:])), seen
    page.screenshot(path=SHOTS / "h264-replay.png")
