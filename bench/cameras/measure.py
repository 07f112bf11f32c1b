"""Measures what two cameras, a microphone and all wearables cost beside five robots, with and without a model that
processes a camera."""

import hashlib
import io
import json
import os
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bags
import harness
import mobilenet
import numpy
import test_blur as blur
from cameras import Cameras
from PIL import Image
from test_microphone import Server
from tables import stamp_ns
from test_models import jpeg, model_process, placed
from test_ros_audio import vowel
from worn import OPERATOR, emulated

# The time until all devices stream and the shorter windows are full [s].
SETTLED_SECS = float(os.environ.get("SETTLED_SECS", "60"))
COUNTED_SECS = float(os.environ.get("COUNTED_SECS", "60"))
MEASURED = os.environ["BENCH_WEARABLES"]
TOPICS = [f"/robot{robot}/front/compressed" for robot in (1, 2)]
MODEL_HZ = 10
SIZE = (640, 480)
MOST_SHARE, MOST_MORE, MOST_CHANGE = 0.35, 0.35, 0.20
HIDDEN_FRAMES, HIDDEN_HZ = int(os.environ.get("HIDDEN_FRAMES", "10000")), 40.0
SOURCES = """
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed"]
[[sources]]
type = "microphone"
person = "p001"
device = "room.monitor"
[simulate]
robots = 5
"""
DESCRIPTOR = f"""
name = "expression"
file = "model.onnx"
licence = "none"
[input]
size = [{mobilenet.SIDE}, {mobilenet.SIDE}]
scale = 0.00392156862745098
[output]
kind = "classes"
labels = {[f"c{label}" for label in range(mobilenet.CLASSES)]}
"""


@dataclass
class Run:
    """A session with cameras."""

    # The shares of a core used by the monitor, and by the process of its models.
    share: float
    of_models: float
    # The delays from the arrival of a person's reading to the queues of sinks [ms].
    delays_ms: list[float]
    frames: int
    lost: int
    # The number of frames per second that the model processed.
    seen_hz: float


def drawn(count: int) -> list[bytes]:
    """Returns pictures like those of a camera: a disc that moves in front of noise."""
    random, files = numpy.random.default_rng(1), []
    rows, columns = numpy.mgrid[: SIZE[1], : SIZE[0]]
    for picture in range(count):
        pixels = random.normal(120, 8, (SIZE[1], SIZE[0], 3))
        pixels[(columns - 100 - 400 * picture / count) ** 2 + (rows - 240) ** 2 <= 60**2] = (200, 40, 40)
        file = io.BytesIO()
        Image.fromarray(numpy.clip(pixels, 0, 255).astype(numpy.uint8)).save(file, "JPEG", quality=80)
        files.append(file.getvalue())
    return files


def worker(folder: Path) -> str:
    """Returns the part of a study that processes a camera with a model."""
    file = mobilenet.model()
    (folder / "model.onnx").write_bytes(file)
    descriptor = folder / "model.toml"
    descriptor.write_text(f'sha256 = "{hashlib.sha256(file).hexdigest()}"{DESCRIPTOR}')
    return f'[[workers]]\ntype = "model"\nstreams = ["{TOPICS[0]}"]\nmax_hz = {MODEL_HZ}\ndescriptors = ["{descriptor}"]\n'


def watch(has_model: bool) -> Run:
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=67)
        server = Server(stage)
        try:
            return recorded(stage, server, has_model)
        finally:
            server.kill()
            stage.close()


def recorded(stage: harness.Stage, server: Server, has_model: bool) -> Run:
    devices = stage.teampulse("emulate", stage.study(emulated(OPERATOR, 1), "emulated.toml"))
    bus = devices.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=(\S+)", pipe="stdout")[1]
    devices.wait_for("emulating wearables")
    delays, out = stage.folder / "delays.json", stage.folder / "sessions"
    study = f'[session]\nname = "cameras"\n{devices.stdout}\n[[sinks]]\ntype = "bag"\n{SOURCES}'
    study += f'[[sinks]]\ntype = "delays"\nfile = "{delays}"\nafter_secs = {SETTLED_SECS}\n'
    written = stage.study(study + (worker(stage.folder) if has_model else ""))
    stage.teampulse("simulate", written).wait_for("simulating")
    environment = {**server.env, "DBUS_SYSTEM_BUS_ADDRESS": bus}
    monitor = stage.start(MEASURED, "run", written, "--out", out, env=environment)
    over = threading.Event()
    speech = threading.Thread(target=speaks, args=(server, over))
    speech.start()
    try:
        with Cameras(stage, TOPICS, drawn(30)):
            time.sleep(SETTLED_SECS)
            model, began = model_process(monitor), time.monotonic()
            before = [monitor.cpu_secs(), cpu_secs(model)]
            time.sleep(COUNTED_SECS)
            after, lasted = [monitor.cpu_secs(), cpu_secs(model)], time.monotonic() - began
    finally:
        over.set()
        speech.join()
    code = monitor.interrupt(within_secs=120)
    if code != 0:
        sys.exit(f"the monitor ended with {code}\n{monitor.report()}")
    bag = harness.the_bag(out)
    streams = json.loads(stage.ask("info", bag, "--json").stdout)["streams"]
    counts = bags.counts(bag)
    voices = [topic for topic in counts if topic.endswith("/voice")]
    if not voices:
        sys.exit(f"nothing was heard\n{monitor.report()}")
    seen = bags.messages(bag, f"{TOPICS[0]}/expression") if has_model else []
    return Run(
        share=(after[0] - before[0]) / lasted,
        of_models=(after[1] - before[1]) / lasted,
        delays_ms=sorted(json.loads(delays.read_text())),
        frames=sum(counts[topic] for topic in TOPICS),
        lost=sum(stream["lost"] or 0 for stream in streams),
        seen_hz=(len(seen) - 1) / (seen[-1].log_secs - seen[0].log_secs) if len(seen) > 1 else 0.0,
    )


def speaks(server: Server, over: threading.Event) -> None:
    """Plays a voice into the microphone until `over` is set."""
    sound = vowel(140, 4.0)
    while not over.is_set():
        server.play(sound)


def cpu_secs(process: int | None) -> float:
    if process is None:
        return 0.0
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / harness.CLOCK_TICKS


@cache
def without() -> Run:
    return watch(has_model=False)


@cache
def with_model() -> Run:
    return watch(has_model=True)


def p99_ms(run: Run) -> float:
    return run.delays_ms[len(run.delays_ms) * 99 // 100]


def cost():
    """two cameras of 640 x 480 at 30 Hz, a microphone, an H10, a Myo, a Shimmer3 and an E4 beside five robots"""
    run = without()
    yield run.share < MOST_SHARE, f"{run.share:.1%} of a core (bar {MOST_SHARE:.0%})"
    yield run.lost == 0, f"{run.lost} lost (bar 0), {run.frames} frames recorded"


def model():
    """the same with a model as large as MobileNetV2 at 10 Hz, in pure Rust"""
    run, more = with_model(), with_model().share + with_model().of_models - without().share
    text = f"{more:.1%} of a core more (bar {MOST_MORE:.0%}), of which its process {run.of_models:.1%}"
    yield more < MOST_MORE and run.seen_hz > 0.9 * MODEL_HZ, f"{text}; {run.seen_hz:.1f} frames per second"
    yield run.lost == 0, f"{run.lost} lost (bar 0)"
    before, after = p99_ms(without()), p99_ms(run)
    change = after / before - 1
    yield change < MOST_CHANGE, f"p99 from arrival to the queue of the bag {before:.2f} → {after:.2f} ms ({change:+.0%}, bar {MOST_CHANGE:.0%})"


def hidden():
    """pictures in which the face of one of ten people moves, and a model overlooks it in every seventh"""
    with tempfile.TemporaryDirectory() as folder:
        stage = harness.Stage(Path(folder), domain=67)
        try:
            recorded, readable = hidden_in(stage)
        finally:
            stage.close()
    yield recorded >= HIDDEN_FRAMES, f"{recorded} recorded (bar {HIDDEN_FRAMES})"
    yield readable == 0, f"{readable} with a face that can be read (bar 0)"


def hidden_in(stage: harness.Stage) -> tuple[int, int]:
    """Returns how many pictures were recorded, and in how many a face is recognisable."""
    descriptor = placed(stage.folder, blur.detector(), blur.OF_FACES)
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(blur.STUDY.replace("DESCRIPTOR", str(descriptor))), "--out", out)
    camera = stage.cyclone("send", blur.CAMERA, "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
    camera.answer("matched")
    empty = jpeg(blur.Person(0).drawn(None))
    harness.eventually(lambda: blur.shown(camera, [empty]) and "blurred" in monitor.stderr, within_secs=60)
    places = {}
    for each in range(round(1.02 * HIDDEN_FRAMES)):
        person, step = blur.Person(1 + each // 500 % 10), each % 500
        place = (160 + 110 * numpy.sin(step / 40), 120 + 70 * numpy.cos(step / 55))
        pixels = person.drawn(place)
        if each % 7 == 3:
            pixels[(pixels == blur.NOSE).all(2)] = (200, 200, 60)
        (at,) = blur.shown(camera, [jpeg(pixels)], hz=HIDDEN_HZ)
        places[at] = person, place
    blur.shown(camera, [empty] * 60)
    if monitor.interrupt(within_secs=60) != 0:
        sys.exit(monitor.report())
    recorded = readable = 0
    for each in bags.messages(harness.the_bag(out), blur.HIDDEN):
        if (at := stamp_ns(each)) in places:
            (person, (x, y)), pixels = places[at], blur.opened(bytes(each.content.data))
            # The place of the face, with a margin of some pixels.
            left, top = max(int(x) - 40, 0), max(int(y) - 40, 0)
            recorded += 1
            readable += person.known(pixels[top : int(y) + 40, left : int(x) + 40]) >= 0.9
    return recorded, readable


FIGURES = [cost, model, hidden]


def main() -> None:
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    missed = 0
    for figure in FIGURES:
        if wanted in figure.__name__:
            for met, text in figure():
                missed += not met
                print(f"{'pass' if met else 'FAIL'}  {figure.__doc__}: {text}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
