"""Hands that a model finds in the pictures of another program: a stream for each side in the bag."""

import hashlib
from pathlib import Path

import bags
import harness
import numpy
from tables import described
from test_models import CAMERA, MADE, jpeg, show_some, show_until, study

HANDS = "/humans/persons/p001/robot1_front/hand"
INPUT = 'layout = "nhwc"\nscale = 0.00392156862745098\n'
PALM = f'[input]\nsize = [32, 16]\n{INPUT}[output]\nkind = "ssd"\nfinds = "hand"\nanchors = [[16, 1]]\n'
HAND = f'[input]\nsize = [8, 8]\n{INPUT}source = "hand"\n[output]\nkind = "hand"\nnames = ["wrist", "thumb_tip"]\n'


def placed(folder: Path, name: str, rest: str) -> Path:
    model = (MADE / f"{name}.onnx").read_bytes()
    (folder / f"{name}.onnx").write_bytes(model)
    head = f'name = "{name}"\nfile = "{name}.onnx"\nlicence = "MIT"\nsha256 = "{hashlib.sha256(model).hexdigest()}"\n'
    (folder / f"{name}.toml").write_text(head + rest)
    return folder / f"{name}.toml"


def test_each_hand_has_a_stream_of_a_person(stage, tmp_path):
    both = '", "'.join(str(placed(tmp_path, name, rest)) for name, rest in (("palms", PALM), ("hand", HAND)))
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", study(stage, both), "--out", out)
    camera = stage.cyclone("send", CAMERA, "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
    camera.answer("matched")
    # Dark on the left: the model takes what is bright for a right hand.
    pixels = numpy.full((160, 320, 3), 20, numpy.uint8)
    pixels[:, 160:] = 200
    picture = jpeg(pixels)
    show_until(camera, picture, lambda: "robot1_front/hand_right ok" in monitor.stderr)
    show_some(camera, 20, picture)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    for side, x in (("left", 0), ("right", 160)):
        topic = f"{HANDS}_{side}"
        stream = described(bag)[topic]
        assert (stream.id, list(stream.inputs), bags.origins(bag)[topic]) == ("p001", [CAMERA], "raw")
        assert list(stream.channels) == [
            *(f"{name}_{part}" for name in ("wrist", "thumb_tip") for part in ("x", "y", "score")), "frame_width", "frame_height",
        ]  # fmt: skip
        found = numpy.array([each.content.values for each in bags.messages(bag, topic)])
        # Each pixel of the model's input is 10 of the picture; the centre of the first is at 4.5.
        expected = [x + 58.25, 34.25, 0.9, x + 110.75, 86.75, 0.9, 320, 160]
        assert len(found) >= 5 and numpy.abs(found - expected).max() < 0.01, found[0]
