"""Models of ONNX files, from the pictures of another program to numbers in the bag, and those that misbehave."""

import hashlib
import io
import os
import re
import signal
import sys
import time
from pathlib import Path

import bags
import harness
import numpy
import pytest
from onnx import TensorProto, helper, numpy_helper
from PIL import Image
from tables import described, stamp_ns
from test_dashboard_video import compressed

MADE = harness.ROOT / "crates/vision/tests/models"
sys.path.append(str(MADE))
import make  # noqa: E402

CAMERA = "/robot1/front/compressed"
FOUND = "/humans/persons/p001/robot1_front/model"
WIDTH, HEIGHT = make.SIZE
IS_SEEN = "robot1_front/model ok"
NAMES = [f"j{joint}" for joint in range(make.JOINTS)]
OF_JOINTS = f"""
[input]
size = [{WIDTH}, {HEIGHT}]
scale = 0.00392156862745098
[output]
kind = "heatmap"
radius = 5
names = {NAMES}
"""
OF_ONE = '[input]\nsize = [8, 8]\nresize = "stretch"\n[output]\nkind = "regression"\nnames = ["level"]\n'


def placed(folder: Path, model: bytes, rest: str, digest: str | None = None) -> Path:
    """A model and its descriptor in a folder."""
    (folder / "model.onnx").write_bytes(model)
    head = f'name = "model"\nfile = "model.onnx"\nlicence = "MIT"\nsha256 = "{digest or hashlib.sha256(model).hexdigest()}"\n'
    path = folder / "model.toml"
    path.write_text(head + rest)
    return path


def graph(nodes, weights=None) -> bytes:
    """A model from a picture of 8 x 8 pixels to a number."""
    of = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    weights = [numpy_helper.from_array(numpy.asarray(value), name) for name, value in (weights or {}).items()]
    made = helper.make_graph(nodes, "model", [of("picture", [1, 3, 8, 8])], [of("level", None)], weights)
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    return model.SerializeToString()


def mean() -> bytes:
    return graph([helper.make_node("ReduceMean", ["picture"], ["level"], axes=[1, 2, 3], keepdims=0)])


def slow() -> bytes:
    """A model that multiplies matrices for seconds."""
    nodes, last = [helper.make_node("ReduceMean", ["picture"], ["m"], keepdims=0)], "grown"
    nodes.append(helper.make_node("Mul", ["ones", "m"], ["grown"]))
    for step in range(24):
        nodes.append(helper.make_node("MatMul", [last, "ones"], [f"s{step}"]))
        last = f"s{step}"
    nodes.append(helper.make_node("ReduceMean", [last], ["level"], keepdims=0))
    return graph(nodes, {"ones": numpy.full((1400, 1400), 1 / 1400, numpy.float32)})


def huge(side: int) -> bytes:
    """A model that needs an array of this many times this many numbers."""
    nodes = [
        helper.make_node("ReduceMean", ["picture"], ["m"], keepdims=0),
        helper.make_node("Expand", ["m", "shape"], ["grown"]),
        helper.make_node("ReduceMean", ["grown"], ["level"], keepdims=0),
    ]
    return graph(nodes, {"shape": numpy.array([side, side], numpy.int64)})


def study(stage, descriptor: Path, more: str = "") -> Path:
    return stage.study(f"""
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed"]
[[workers]]
type = "model"
streams = ["{CAMERA}"]
descriptors = ["{descriptor}"]
person = "p001"
{more}
[[sinks]]
type = "bag"
tidy = false
""")


@pytest.fixture
def started(stage):
    """Starts a monitor with a model, and a camera."""

    def start(descriptor: Path, more: str = "", **options):
        out = stage.folder / "sessions"
        monitor = stage.teampulse("run", study(stage, descriptor, more), "--out", out, **options)
        kind = "sensor_msgs/msg/CompressedImage"
        camera = stage.cyclone("send", CAMERA, "--type", kind, "--subscribers", 1)
        camera.answer("matched")
        return monitor, camera, out

    return start


def show_until(camera, picture: bytes, found):
    """A camera shows a picture again and again until something is found."""
    message = compressed(picture, "jpeg")

    def look():
        camera.say(message)
        return found()

    return harness.eventually(look, within_secs=60)


def plain(level=100, size=(64, 48)) -> bytes:
    return jpeg(numpy.full((size[1], size[0], 3), level, numpy.uint8))


def jpeg(pixels) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=100, subsampling=0)
    return file.getvalue()


def drawn(random) -> tuple[bytes, numpy.ndarray]:
    """A picture with a disc for each joint in front of dark noise, and the places of the joints."""
    places = numpy.empty((0, 2))
    while len(places) < make.JOINTS:
        place = random.uniform([10, 10], [WIDTH - 10, HEIGHT - 10])
        if not len(places) or numpy.hypot(*(places - place).T).min() >= 12:
            places = numpy.vstack([places, place])
    pixels = random.uniform(0, 20, (HEIGHT, WIDTH, 3))
    rows, columns = numpy.mgrid[:HEIGHT, :WIDTH]
    for place, colour in zip(places, make.colours(), strict=True):
        pixels[(columns - place[0]) ** 2 + (rows - place[1]) ** 2 <= 16] = 255 * colour
    return jpeg(numpy.clip(pixels + 0.5, 0, 255).astype(numpy.uint8)), places


def show_some(camera, count: int, picture: bytes | None = None) -> None:
    for _ in range(count):
        camera.say(compressed(picture or plain(), "jpeg"))
        time.sleep(0.03)


def onnx_runtime() -> Path:
    import onnxruntime

    return next((Path(onnxruntime.__file__).parent / "capi").glob("libonnxruntime.so.*"))


def model_process(monitor) -> int | None:
    """The process in which a monitor runs its models."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
            parent = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, IndexError):
            continue
        if parent == monitor.pid and b"__model" in words:
            return int(folder.name)
    return None


@pytest.mark.parametrize("engine", ["rten", "ONNX Runtime"])
def test_joints_of_a_drawn_person_are_in_the_bag(started, tmp_path, engine):
    library = f'onnx_runtime = "{onnx_runtime()}"' if engine == "ONNX Runtime" else ""
    descriptor = placed(tmp_path, (MADE / "joints.onnx").read_bytes(), OF_JOINTS)
    monitor, camera, out = started(descriptor, library)
    random = numpy.random.default_rng(3)
    truth = dict(drawn(random) for _ in range(8))
    show_until(camera, next(iter(truth)), lambda: IS_SEEN in monitor.stderr)
    for picture in truth:
        show_some(camera, 30, picture)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    stream = described(bag)[FOUND]
    assert (stream.id, stream.inputs, bags.origins(bag)[FOUND]) == ("p001", [CAMERA], "raw")
    assert "licence MIT" in stream.doc and engine in stream.method
    assert list(stream.channels[:3]) == ["j0_x", "j0_y", "j0_score"] and list(stream.units[:3]) == ["px", "px", "1"]
    assert list(stream.channels[-2:]) == ["frame_width", "frame_height"]
    arrived = {picture: [] for picture in truth}
    for each in bags.messages(bag, CAMERA):
        arrived[bytes(each.content.data)].append(each.log_secs)
    seen = set()
    for found in bags.messages(bag, FOUND):
        places = numpy.array(found.content.values[:-2]).reshape(-1, 3)[:, :2]
        errors = {picture: numpy.hypot(*(places - joints).T).max() for picture, joints in truth.items()}
        picture = min(errors, key=errors.get)
        assert errors[picture] <= 0.5
        # It has the time of its picture, which has no stamp of its own: that of its arrival.
        taken = stamp_ns(found) / 1e9
        assert arrived[picture][0] - 0.3 < taken < arrived[picture][-1] + 0.3
        seen.add(picture)
    assert len(seen) >= 2, f"{len(seen)} pictures"


@pytest.mark.parametrize(
    ("model", "more", "words"),
    [
        (lambda: b"no model", "", "load the model `model` with rten"),
        (lambda: huge(600_000), "", r"their process ended with .*memory allocation of 1440000000000 bytes failed"),
        (lambda: huge(20_000), "memory_mib = 512", r"their process ended with .*memory allocation"),
        (lambda: huge(20_000), f'memory_mib = 512\nonnx_runtime = "{onnx_runtime()}"', "run the model `model`"),
        (slow, "patience_secs = 0.3", "process a frame within 0.3 s"),
        (mean, 'onnx_runtime = "/nowhere/libonnxruntime.so"', "use /nowhere/libonnxruntime.so as ONNX Runtime"),
    ],
    ids=["no_model", "a_terabyte", "much_memory", "much_memory_onnx_runtime", "hangs", "no_library"],
)
def test_a_model_that_can_not_run_is_a_fault_and_the_session_goes_on(started, tmp_path, model, more, words):
    monitor, camera, out = started(placed(tmp_path, model(), OF_ONE), more)
    show_until(camera, plain(), lambda: re.search(words, monitor.stderr))
    show_some(camera, 20)
    assert monitor.is_running()
    monitor.interrupt()
    bag = harness.the_bag(out)
    labels = [each.content.label for each in bags.messages(bag, "/session/events")]
    assert any(re.search(words, label) for label in labels), labels
    assert len(bags.messages(bag, CAMERA)) >= 20


def test_a_file_that_is_not_the_one_of_its_descriptor_is_not_run(started, tmp_path):
    monitor, camera, out = started(placed(tmp_path, mean(), OF_ONE, digest="0" * 64))
    show_until(camera, plain(), lambda: "its file has the SHA-256" in monitor.stderr)
    monitor.interrupt()
    assert FOUND not in bags.origins(harness.the_bag(out))


def test_a_process_of_models_that_crashes_is_started_again(started, tmp_path):
    monitor, camera, out = started(placed(tmp_path, mean(), OF_ONE))
    show_until(camera, plain(), lambda: IS_SEEN in monitor.stderr)
    first = model_process(monitor)
    os.kill(first, signal.SIGABRT)
    show_until(camera, plain(), lambda: "signal: 6" in monitor.stderr)
    show_until(camera, plain(), lambda: model_process(monitor) not in (None, first))
    crashed = time.time()
    show_some(camera, 40)
    assert monitor.interrupt() == 0, monitor.report()
    assert model_process(monitor) is None
    times = [stamp_ns(each) / 1e9 for each in bags.messages(harness.the_bag(out), FOUND)]
    assert times[0] < crashed < times[-1]


def test_a_model_that_ends_with_its_session_leaves_no_process(started, tmp_path):
    monitor, camera, _ = started(placed(tmp_path, slow(), OF_ONE))
    process = harness.eventually(lambda: model_process(monitor))
    monitor.kill()
    harness.eventually(lambda: not Path(f"/proc/{process}").exists())
    assert camera.is_running()


def test_frames_that_a_slow_model_skips_are_counted(started, tmp_path):
    monitor, camera, out = started(placed(tmp_path, slow(), OF_ONE))
    show_until(camera, plain(), lambda: IS_SEEN in monitor.stderr)
    show_some(camera, 40)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    shown, found = (len(bags.messages(bag, topic)) for topic in (CAMERA, FOUND))
    assert found < shown / 2
    # What was found has the time of its frame, however long it took.
    assert all(stamp_ns(each) / 1e9 < each.log_secs - 0.2 for each in bags.messages(bag, FOUND))
    processed = re.search(r"model: processed (\d+) of (\d+) samples", monitor.stderr)
    assert processed and int(processed[1]) < int(processed[2]) / 2, monitor.stderr


def test_frames_that_change_their_size_and_pictures_that_are_none_are_looked_at_or_counted(started, tmp_path):
    monitor, camera, out = started(placed(tmp_path, mean(), OF_ONE))
    for broken, words in ((plain()[:-10], "truncated"), (b"GIF89a" + bytes(50), "of format `jpeg`")):
        show_until(camera, broken, lambda words=words: words in monitor.stderr)
    show_until(camera, plain(level=50, size=(640, 480)), lambda: IS_SEEN in monitor.stderr)
    for size in ((6, 6), (1, 300), (64, 48)):
        show_some(camera, 10, plain(level=200, size=size))
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    levels = {round(each.content.values[0]) for each in bags.messages(bag, FOUND)}
    assert 50 in levels and 200 in levels
    assert int(re.search(r"lost on the way (\d+)", monitor.stderr)[1]) >= 2, monitor.stderr


def test_at_most_as_many_frames_are_looked_at_as_asked(started, tmp_path):
    monitor, camera, out = started(placed(tmp_path, mean(), OF_ONE), "max_hz = 4")
    show_until(camera, plain(), lambda: IS_SEEN in monitor.stderr)
    show_some(camera, 60)
    assert monitor.interrupt() == 0, monitor.report()
    times = [stamp_ns(each) / 1e9 for each in bags.messages(harness.the_bag(out), FOUND)]
    assert len(times) >= 2 and numpy.diff(times).min() > 0.9 / 4 - 0.01


def test_a_downloaded_model_is_added_verified_and_refused_once_it_changes(stage):
    model = stage.folder / "downloaded.onnx"
    model.write_bytes((MADE / "net.onnx").read_bytes())
    listed = stage.ask("models", "list")
    assert listed.returncode == 0 and "licence  MIT" in listed.stdout
    added = stage.ask("models", "add", "fer", model)
    assert added.returncode == 0, added.stderr
    descriptor = Path(added.stdout.strip())
    assert hashlib.sha256(model.read_bytes()).hexdigest() in descriptor.read_text()
    assert "downloaded.onnx" in stage.ask("models", "list", stage.folder).stdout
    assert stage.ask("models", "add", "fer", model).returncode == 1, "it is there already"
    assert stage.ask("models", "add", "dream", model).returncode == 2
    page = stage.folder / "page.onnx"
    page.write_text("<!DOCTYPE html>")
    answer = stage.ask("models", "add", "yunet", page)
    assert answer.returncode == 1 and "is not an ONNX file" in answer.stderr, answer.stderr
    # It is of other pixels than the model that the descriptor is for, but runs: it averages over them.
    for option in ([], ["--onnx-runtime", onnx_runtime()]):
        verified = stage.ask("models", "verify", *option, descriptor)
        assert ("scores 1 × 7" in verified.stdout) == (verified.returncode == 0), verified.stderr
    model.write_bytes(b"another")
    verified = stage.ask("models", "verify", descriptor)
    assert verified.returncode == 1 and "SHA-256" in verified.stderr
