"""Faces of people in front of a camera are hidden before a picture is recorded, whatever the models do."""

import io
import json
import re
import time
import urllib.request

import bags
import harness
import numpy
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from PIL import Image
from tables import described, stamp_ns
from test_faces import stamped
from test_models import jpeg, placed

CAMERA = "/robot1/front/compressed"
HIDDEN = "/robot1/front/blurred/compressed"
WIDTH, HEIGHT, CELL = 320, 240, 8
# A face is 64 px wide: eight times eight cells that are dark or bright, and a nose of a colour that the model knows.
FACE, CELLS, NOSE = 64, 8, (230, 30, 200)
STUDY = """
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed"]
faces = "blur"
[[workers]]
type = "blur"
descriptors = ["DESCRIPTOR"]
[[sinks]]
type = "bag"
tidy = false
"""
OF_FACES = f"""
[input]
size = [{WIDTH}, {HEIGHT}]
scale = 0.00392156862745098
[output]
kind = "yolo"
version = "v8"
finds = "face"
"""


def detector() -> bytes:
    """A model that finds noses by their colour, and says that a face is around each."""
    colour = numpy.array(NOSE, numpy.float32) / 255
    apart = numpy.zeros((6, 3, 1, 1), numpy.float32)
    for part in range(3):
        apart[part, part], apart[3 + part, part] = 1, -1
    offset = numpy.concatenate([-colour, colour]).astype(numpy.float32)
    likeness = numpy.full((1, 6, 1, 1), -1, numpy.float32)
    rows, columns = HEIGHT // CELL, WIDTH // CELL
    x, y = numpy.meshgrid((numpy.arange(columns) + 0.5) * CELL, (numpy.arange(rows) + 0.5) * CELL)
    sides = numpy.full(rows * columns, FACE)
    boxes = numpy.stack([x.ravel(), y.ravel(), sides, sides]).astype(numpy.float32)[None]
    weights = {"apart": apart, "offset": offset, "likeness": likeness, "one": numpy.ones(1, numpy.float32), "boxes": boxes}
    weights["row"] = numpy.array([1, 1, rows * columns], numpy.int64)
    nodes = [
        helper.make_node("Conv", ["picture", "apart", "offset"], ["differences"], kernel_shape=[1, 1]),
        helper.make_node("Relu", ["differences"], ["absolute"]),
        helper.make_node("Conv", ["absolute", "likeness", "one"], ["like"], kernel_shape=[1, 1]),
        helper.make_node("Relu", ["like"], ["alike"]),
        helper.make_node("AveragePool", ["alike"], ["pooled"], kernel_shape=[CELL, CELL], strides=[CELL, CELL]),
        helper.make_node("Reshape", ["pooled", "row"], ["scores"]),
        helper.make_node("Concat", ["boxes", "scores"], ["found"], axis=1),
    ]
    of = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    weights = [numpy_helper.from_array(value, name) for name, value in weights.items()]
    made = helper.make_graph(nodes, "faces", [of("picture", [1, 3, HEIGHT, WIDTH])], [of("found", [1, 5, rows * columns])], weights)
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model)
    return model.SerializeToString()


class Person:
    """Somebody whose face is a pattern of bits."""

    def __init__(self, seed: int):
        self.bits = numpy.random.default_rng(seed).integers(0, 2, (CELLS, CELLS)).astype(bool)

    def drawn(self, place) -> numpy.ndarray:
        """A picture with the face in the middle of this place [px], or without it."""
        pixels = numpy.full((HEIGHT, WIDTH, 3), (90, 120, 90), numpy.uint8)
        if place is not None:
            left, top = (int(each) - FACE // 2 for each in place)
            side = FACE // CELLS
            face = numpy.where(self.bits[..., None], numpy.uint8(220), numpy.uint8(30)).repeat(side, 0).repeat(side, 1)
            face = numpy.broadcast_to(face, (FACE, FACE, 3)).copy()
            rows, columns = numpy.mgrid[:FACE, :FACE] - (FACE - 1) / 2
            face[rows**2 + columns**2 <= 12**2] = NOSE
            pixels[top : top + FACE, left : left + FACE] = face
        return pixels

    def known(self, pixels: numpy.ndarray) -> float:
        """How many of the bits that no nose covers can be read anywhere in a picture: at most 1, by chance about half."""
        side, grey = FACE // CELLS, pixels.astype(float).mean(2)
        rows, columns = grey.shape
        whole = numpy.pad(grey.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
        sums = whole[side:, side:] - whole[:-side, side:] - whole[side:, :-side] + whole[:-side, :-side]
        middle = numpy.zeros((CELLS, CELLS), bool)
        middle[2:6, 2:6] = True
        rest = numpy.argwhere(~middle)
        height, width = rows - FACE + 1, columns - FACE + 1
        cells = numpy.stack([sums[r * side : r * side + height, c * side : c * side + width] for r, c in rest])
        clear = numpy.abs(cells - cells.mean(0)) > 20 * side**2
        right = ((cells > cells.mean(0)) == self.bits[tuple(rest.T)][:, None, None]) & clear
        return right.mean(0).max()


def shown(camera, pictures, hz=25.0) -> dict[int, bytes]:
    """Shows pictures, each with its time. Returns them by their time [ns]."""
    sent = {}
    for picture in pictures:
        at = time.time_ns()
        camera.say(stamped(picture, at))
        sent[at] = picture
        time.sleep(1 / hz)
    return sent


@pytest.fixture
def started(stage, tmp_path):
    """Starts a monitor that hides faces, and a camera."""

    def start(model: bytes, more: str = "", digest=None, study=STUDY):
        descriptor = placed(tmp_path, model, OF_FACES + more, digest)
        out = stage.folder / "sessions"
        study = stage.study(study.replace("DESCRIPTOR", str(descriptor)))
        monitor = stage.teampulse("run", study, "--out", out)
        camera = stage.cyclone("send", CAMERA, "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
        camera.answer("matched")
        return monitor, camera, out

    return start


def opened(picture: bytes) -> numpy.ndarray:
    return numpy.asarray(Image.open(io.BytesIO(picture)))


def test_known_faces_are_in_no_picture_that_is_recorded(started):
    person = Person(1)
    monitor, camera, out = started(detector())
    path = [(60 + 2 * step, 80 + step // 2) for step in range(100)]
    # The model overlooks the face in some pictures: its nose has another colour there.
    faces = [person.drawn(place) for place in path]
    for overlooked in range(5, len(faces), 7):
        faces[overlooked][(faces[overlooked] == NOSE).all(2)] = (200, 200, 60)
    assert all(person.known(face) == 1 for face in faces)
    empty = jpeg(person.drawn(None))
    harness.eventually(lambda: shown(camera, [empty]) and "front/blurred/compressed" in monitor.stderr, within_secs=60)
    # The camera itself is listed with its health, and its pictures are shown to nobody.
    address = monitor.wait_for(r"the dashboard is at (http://\S+)/")[1]
    with urllib.request.urlopen(f"{address}/api/streams") as answer:
        private = {each["name"]: each["private"] for each in json.load(answer)}
    assert (private[CAMERA], private[HIDDEN]) == (True, False)
    sent = shown(camera, [empty] * 30 + [jpeg(face) for face in faces] + [empty] * 30)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    stream = described(bag)[HIDDEN]
    assert (stream.id, stream.inputs, bags.origins(bag)[HIDDEN]) == ("robot1", [CAMERA], "raw")
    assert CAMERA not in bags.counts(bag)
    recorded = {stamp_ns(each): bytes(each.content.data) for each in bags.messages(bag, HIDDEN)}
    kept = {at: (recorded[at], picture) for at, picture in sent.items() if at in recorded}
    assert len(kept) >= 0.9 * len(sent), f"{len(kept)} of {len(sent)}"
    assert max(person.known(opened(picture)) for picture in recorded.values()) < 0.9
    # Where nobody was for half a second before and after, pictures are as they came.
    times = list(sent)
    far = [at for at in times[:10] + times[-10:] if at in kept]
    assert far and all(kept[at][0] == kept[at][1] for at in far)
    # Nor is a picture with the face anywhere else in what the session wrote.
    everything = b"".join(file.read_bytes() for file in out.rglob("*") if file.is_file())
    assert not any(picture[200:400] in everything for picture in map(jpeg, faces))


@pytest.mark.parametrize(
    ("model", "more", "digest", "words"),
    [
        (detector, "", "0" * 64, "has the SHA-256"),
        (lambda: b"no model", "", None, "load the model `model`"),
        (detector, "class = 7\n", None, "at least 12 numbers"),
    ],
)
def test_what_no_model_has_looked_at_is_not_recorded(started, model, more, digest, words):
    person = Person(2)
    monitor, camera, out = started(model(), more, digest)
    picture = jpeg(person.drawn((100, 100)))
    harness.eventually(lambda: shown(camera, [picture] * 5) and re.search(words, monitor.stderr), within_secs=60)
    assert monitor.interrupt() in (0, 3), monitor.report()
    everything = b"".join(file.read_bytes() for file in out.rglob("*") if file.is_file())
    assert picture[200:400] not in everything
    assert not {CAMERA, HIDDEN} & set(bags.counts(harness.the_bag(out)))


def test_pictures_that_can_not_be_looked_at_are_left_out_and_counted(started):
    person = Person(3)
    monitor, camera, out = started(detector())
    empty = jpeg(person.drawn(None))
    harness.eventually(lambda: shown(camera, [empty]) and "front/blurred/compressed" in monitor.stderr, within_secs=60)
    broken = jpeg(person.drawn((100, 100)))[:-1000]
    shown(camera, [empty, broken, b"no picture", empty])
    harness.eventually(lambda: "unprocessed frames are not recorded" in monitor.stderr)
    assert monitor.interrupt() in (0, 3), monitor.report()
    recorded = [bytes(each.content.data) for each in bags.messages(harness.the_bag(out), HIDDEN)]
    assert recorded and all(picture == empty for picture in recorded)
