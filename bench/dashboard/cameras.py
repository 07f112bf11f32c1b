"""Cameras of a team: JPEG pictures as ROS messages, sent at the cameras' rate."""

import base64
import struct
import threading
import time

HZ = 30

# Draws a moving disc in front of noise, as a JPEG as large as those of cameras.
DRAW = """async ([width, height, count]) => {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  const files = [];
  for (let k = 0; k < count; k += 1) {
    for (let x = 0; x < width; x += 8) for (let y = 0; y < height; y += 8) {
      context.fillStyle = `hsl(${(x + y) / 4} 30% ${30 + 40 * Math.random()}%)`;
      context.fillRect(x, y, 8, 8);
    }
    context.fillStyle = "#c22";
    context.beginPath();
    context.arc(100 + (400 * k) / count, 240, 60, 0, 7);
    context.fill();
    const blob = await canvas.convertToBlob({type: "image/jpeg", quality: 0.75});
    const bytes = new Uint8Array(await blob.arrayBuffer());
    files.push(btoa(String.fromCharCode(...bytes)));
  }
  return files;
}"""


def drawn(page, size: tuple[int, int], count: int) -> list[bytes]:
    """Returns pictures drawn by a browser page, as JPEG files."""
    return [base64.b64decode(each) for each in page.evaluate(DRAW, [*size, count])]


def compressed(file: bytes, stamp_ns: int = 0) -> bytes:
    """Returns a `sensor_msgs/CompressedImage` as CDR."""
    secs, nanos = divmod(stamp_ns, 10**9)
    head = struct.pack("<4s iI I5s3x I5s3x I", b"\0\1\0\0", secs, nanos, 5, b"cam1\0", 5, b"jpeg\0", len(file))
    return head + file


class Cameras:
    """Sends pictures on topics of a robot, each at its rate, until the context is left; a monitor must be running."""

    def __init__(self, stage, topics: list[str], files: list[bytes]):
        self._over = threading.Event()
        self._pictures = [compressed(each).hex() for each in files]
        kind = ("--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
        self._senders = [stage.cyclone("send", topic, *kind) for topic in topics]

    def __enter__(self):
        for sender in self._senders:
            sender.answer("matched")
        self._films = [threading.Thread(target=self._film, args=(sender,)) for sender in self._senders]
        for film in self._films:
            film.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        for film in self._films:
            film.join()

    def _film(self, sender) -> None:
        began_secs, sent = time.monotonic(), 0
        while not self._over.is_set():
            time.sleep(max(0.0, began_secs + sent / HZ - time.monotonic()))
            sender.say(self._pictures[sent % len(self._pictures)])
            sent += 1
