"""What a camera shows, in numbers: pictures that another program encoded, to values in the bag."""

import io
import re
import time

import bags
import harness
import numpy
import pytest
from PIL import Image, ImageDraw
from tables import described, stamp_ns
from test_dashboard_video import compressed

CAMERA = "/robot1/front/compressed"
NUMBERS = "/humans/persons/p001/robot1_front/frames"
STUDY = f"""
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed"]
[[workers]]
type = "frames"
streams = ["{CAMERA}"]
person = "p001"
[[sinks]]
type = "bag"
tidy = false
"""
SIZE = (320, 240)
WALL, SKIN = (110, 130, 150), (200, 140, 115)
FACE = (96, 96)


def jpeg(left: int | None, size=SIZE, quality=90) -> bytes:
    """A face in front of a wall, or the wall alone."""
    picture = Image.new("RGB", size, WALL)
    if left is not None:
        ImageDraw.Draw(picture).rectangle((left, 72, left + FACE[0] - 1, 72 + FACE[1] - 1), fill=SKIN)
    file = io.BytesIO()
    picture.save(file, "JPEG", quality=quality)
    return file.getvalue()


class Camera:
    """A program that publishes pictures, twenty times a second."""

    def __init__(self, stage):
        kind = "sensor_msgs/msg/CompressedImage"
        self.program = stage.cyclone("send", CAMERA, "--type", kind, "--subscribers", 1)
        self.program.answer("matched")

    def show(self, *files: bytes) -> None:
        for file in files:
            self.program.say(compressed(file, "jpeg"))
            time.sleep(0.05)

    def show_until(self, file: bytes, found) -> None:
        """A picture that another one replaces before it is looked at is skipped."""

        def look() -> bool:
            self.show(file)
            return found()

        harness.eventually(look)


@pytest.fixture
def session(stage):
    """A monitor that looks at a camera, the camera, and the folder of its sessions."""
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(STUDY), "--out", out)
    return monitor, Camera(stage), out


def numbers(bag) -> tuple[list[str], numpy.ndarray]:
    """The names of the numbers, and those of each frame."""
    stream = described(bag)[NUMBERS]
    return stream.channels, numpy.array([each.content.values for each in bags.messages(bag, NUMBERS)])


def test_a_person_in_view_is_numbers_in_the_bag(session):
    monitor, camera, out = session
    camera.show(*(jpeg(place) for place in 20 * (48, 64, 80)), *(20 * [jpeg(None)]))
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    stream = described(bag)[NUMBERS]
    assert (stream.id, stream.signal, stream.inputs) == ("p001", "video", [CAMERA])
    assert bags.origins(bag)[NUMBERS] == "raw"
    channels, values = numbers(bag)
    assert len(values) > 40
    of = {name: values[:, place] for place, name in enumerate(channels)}
    inside = of["skin"] > 0
    assert 20 < inside.sum() < len(values)
    # The face lies on the borders of blocks of eight pixels.
    assert of["skin"][inside] == pytest.approx(FACE[0] * FACE[1] / (SIZE[0] * SIZE[1]), abs=0.005)
    for name, part in zip(("red", "green", "blue"), SKIN, strict=True):
        assert of[name][inside] == pytest.approx(part / 255, abs=0.02), name
    assert of["presence"][inside][5:].min() == 1 and of["presence"][~inside].max() == 0
    assert numpy.nanmax(of["moving"][inside]) > 0.02 and of["moving"][-1] == 0
    # Each has the time of its picture, which has no stamp of its own: that of its arrival.
    arrived = numpy.array([each.log_secs for each in bags.messages(bag, CAMERA)])
    taken = numpy.array([stamp_ns(each) / 1e9 for each in bags.messages(bag, NUMBERS)])
    assert all(numpy.abs(arrived - time).min() < 0.1 for time in taken)


def test_pictures_that_are_none_are_named_and_counted_and_the_next_is_seen(session):
    monitor, camera, out = session
    whole = jpeg(48)
    huge = bytearray(whole)
    frame = huge.index(b"\xff\xc0")
    huge[frame + 5 : frame + 9] = (12_000).to_bytes(2, "big") * 2
    for broken, words in (
        (whole[: len(whole) // 2], "truncated"),
        (bytes(huge), "12000 × 12000"),
        (b"GIF89a" + bytes(50), "of format `jpeg`"),
    ):
        camera.show(whole)
        camera.show_until(broken, lambda words=words: words in monitor.stderr)
    # Frames that change their size, and one that is smaller than any block.
    camera.show(b"", jpeg(48, size=(640, 480)), jpeg(48, size=(6, 6)), *(5 * [whole]))
    assert monitor.interrupt() == 0, monitor.report()
    # Three kinds, an empty one, and what was sent again while nothing had been said yet.
    assert int(re.search(r"lost on the way (\d+)", monitor.stderr)[1]) >= 4, monitor.stderr
    _, values = numbers(harness.the_bag(out))
    assert len(values) >= 3 and values[-1][0] > 0.3
