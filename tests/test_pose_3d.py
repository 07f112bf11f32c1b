"""Points of pictures in space, by the depth pictures of the same camera: from the messages of other programs to the bag."""

import re
import time

import bags
import harness
import numpy
import pytest
from tables import described, stamp_ns
from test_hri import cdr, header, kind
from test_models import MADE, NAMES, OF_JOINTS, drawn, make, placed

WIDTH, HEIGHT = make.SIZE
JOINTS = make.JOINTS
COLOUR, DEPTH, INFO = "/robot1/front/compressed", "/robot1/depth/image_raw", "/robot1/depth/camera_info"
POINTS = "/humans/persons/p001/robot1_front/model"
SKELETON = "/humans/persons/p001/hri/skeleton2d"
FX, FY, CX, CY = 220.0, 230.0, 127.0, 96.5
WALL_M = 4.0
IMAGE = "sensor_msgs/msg/Image"

BAG = """
[[sinks]]
type = "bag"
tidy = false
"""
OF_A_MODEL = f"""
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed", "depth/image_raw"]
topics = ["depth/camera_info"]
[[workers]]
type = "model"
streams = ["{COLOUR}"]
descriptors = ["DESCRIPTOR"]
person = "p001"
[[workers]]
type = "pose_3d"
points = ["{POINTS}"]
depth = "{DEPTH}"
{BAG}"""
OF_A_NODE = f"""
[[sources]]
type = "hri"
person = "p001"
body = "*"
frame = [{WIDTH}, {HEIGHT}]
[[sources]]
type = "topics"
names = ["{DEPTH}", "{INFO}"]
[[workers]]
type = "pose_3d"
points = ["{SKELETON}"]
depth = "{DEPTH}"
{BAG}"""


def jpeg_message(content: bytes, at_ns: int) -> str:
    data = numpy.frombuffer(content, numpy.uint8)
    return cdr(kind("sensor_msgs/msg/CompressedImage")(header(at_ns), "jpeg", data))


def depth_message(metres: numpy.ndarray, encoding: str, at_ns: int) -> str:
    """A depth picture; distances of 0 are holes."""
    if encoding == "16UC1":
        pixels = numpy.round(metres * 1000).astype("<u2")
    else:
        pixels = numpy.where(metres == 0, numpy.nan, metres).astype("<f4")
    height, width = pixels.shape
    data = numpy.frombuffer(pixels.tobytes(), numpy.uint8)
    return cdr(kind(IMAGE)(header(at_ns), height, width, encoding, 0, width * pixels.itemsize, data))


def info_message(at_ns: int) -> str:
    k = numpy.array([FX, 0, CX, 0, FY, CY, 0, 0, 1.0])
    p = numpy.array([FX, 0, CX, 0, 0, FY, CY, 0, 0, 0, 1.0, 0])
    roi = kind("sensor_msgs/msg/RegionOfInterest")(0, 0, 0, 0, False)
    whole = (HEIGHT, WIDTH, "plumb_bob", numpy.zeros(5), k, numpy.eye(3).ravel(), p, 0, 0, roi)
    return cdr(kind("sensor_msgs/msg/CameraInfo")(header(at_ns), *whole))


class Body:
    """Joints at known places in a picture and in space: one in a hole of the depth picture, one at an edge."""

    def __init__(self, places: numpy.ndarray, random):
        self.places = places
        self.distances = random.uniform(0.8, 2.0, len(places))
        self.in_space = numpy.column_stack(
            [(places - [CX, CY]) / [FX, FY] * self.distances[:, None], self.distances]
        )
        self.hole, self.edge = 3, 5
        rows, columns = numpy.mgrid[:HEIGHT, :WIDTH]
        away = numpy.hypot(columns[..., None] - places[:, 0], rows[..., None] - places[:, 1])
        nearest = away.argmin(axis=2)
        self.depth = numpy.where(away.min(axis=2) <= 6, self.distances[nearest], WALL_M)
        self.depth[away[..., self.hole] <= 6] = 0
        beside = (away[..., self.edge] <= 6) & (columns > places[self.edge, 0])
        self.depth[beside] = WALL_M
        self.seen = [joint for joint in range(len(places)) if joint not in (self.hole, self.edge)]

    def check(self, values) -> float:
        """The largest error of a joint in space [m]."""
        found = numpy.array(values[:-2]).reshape(-1, 4)[: len(self.places)]
        for joint in (self.hole, self.edge):
            assert numpy.isnan(found[joint, :3]).all() and found[joint, 3] == 0, (joint, found[joint])
        assert tuple(values[-2:]) == (1, 1), "holes and edges"
        assert (found[self.seen, 3] > 0).all()
        return numpy.linalg.norm(found[self.seen, :3] - self.in_space[self.seen], axis=1).max()


class Camera:
    """A camera for colour and depth on ROS, each frame with one stamp."""

    def __init__(self, stage):
        self.stage = stage
        self.depth = self.sender(DEPTH, IMAGE)
        self.info = self.sender(INFO, "sensor_msgs/msg/CameraInfo")

    def sender(self, topic: str, name: str):
        sender = self.stage.cyclone("send", topic, "--type", name, "--subscribers", 1)
        sender.answer("matched")
        return sender

    def show(self, body: Body, encoding: str, at_ns: int) -> None:
        self.info.say(info_message(at_ns))
        self.depth.say(depth_message(body.depth, encoding, at_ns))


def run(stage, study: str):
    out = stage.folder / "sessions"
    return stage.teampulse("run", stage.study(study), "--out", out), out


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_joints_that_a_model_finds_are_in_space_within_a_centimetre(stage, tmp_path, figure, encoding):
    descriptor = placed(tmp_path, (MADE / "joints.onnx").read_bytes(), OF_JOINTS)
    monitor, out = run(stage, OF_A_MODEL.replace("DESCRIPTOR", str(descriptor)))
    random = numpy.random.default_rng(11)
    picture, places = drawn(random)
    body = Body(places, random)
    camera = Camera(stage)
    colour = camera.sender(COLOUR, "sensor_msgs/msg/CompressedImage")

    def show() -> bool:
        at_ns = time.time_ns()
        colour.say(jpeg_message(picture, at_ns))
        camera.show(body, encoding, at_ns)
        return f"{POINTS.removeprefix('/humans/persons/p001/')}_3d ok" in monitor.stderr

    harness.eventually(show, within_secs=60)
    for _ in range(60):
        show()
        time.sleep(0.05)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    topic = f"{POINTS}_3d"
    stream = described(bag)[topic]
    assert (stream.id, bags.origins(bag)[topic]) == ("p001", "raw")
    assert list(stream.inputs) == [POINTS, DEPTH, INFO]
    assert list(stream.channels[:4]) == [f"{NAMES[0]}_{part}" for part in ("x", "y", "z", "score")]
    assert list(stream.units[:4]) == ["m", "m", "m", "1"] and list(stream.channels[-2:]) == ["holes", "edges"]
    found = bags.messages(bag, topic)
    assert len(found) >= 10
    worst = max(body.check(each.content.values) for each in found)
    figure(f"joints in space from {encoding}: at most {1e3 * worst:.1f} mm off in {len(found)} frames")
    assert worst <= 0.01
    # Each has the time of its frame, to the nanosecond.
    assert {stamp_ns(each) for each in found} <= {stamp_ns(each) for each in bags.messages(bag, POINTS)}


def test_a_skeleton_of_another_program_is_in_space_and_frames_without_depth_are_counted(stage):
    monitor, out = run(stage, OF_A_NODE)
    random = numpy.random.default_rng(12)
    _, places = drawn(random)
    body = Body(places, random)
    camera = Camera(stage)
    skeleton = camera.sender("/humans/bodies/b1/skeleton2d", "hri_msgs/msg/Skeleton2D")
    point = kind("hri_msgs/msg/NormalizedPointOfInterest2D")
    unknown = point(0.0, 0.0, 0.0)
    points = [point(x / WIDTH, y / HEIGHT, 0.9) for x, y in places] + [unknown] * (18 - JOINTS)

    def see(at_ns: int) -> None:
        skeleton.say(cdr(kind("hri_msgs/msg/Skeleton2D")(header(at_ns), points)))

    # Points and depth pictures alone: what is missing is said.
    def lacking() -> bool:
        at_ns = time.time_ns()
        see(at_ns)
        camera.depth.say(depth_message(body.depth, "16UC1", at_ns))
        return f"nothing has arrived on {INFO}; publish the sensor_msgs/msg/CameraInfo" in monitor.stderr

    harness.eventually(lacking, within_secs=30)
    camera.show(body, "16UC1", time.time_ns())
    time.sleep(1.5)
    begin_ns = time.time_ns()
    for frame in range(60):
        at_ns = time.time_ns()
        see(at_ns)
        # The camera for depth fails after half of them.
        if frame < 30:
            camera.show(body, "16UC1", at_ns)
        time.sleep(0.05)
    time.sleep(1.5)
    assert f"{DEPTH} has no picture within 0.05 s" in monitor.stderr, monitor.stderr
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    found = [each for each in bags.messages(bag, f"{SKELETON}_3d") if stamp_ns(each) >= begin_ns - 1_000_000]
    assert 25 <= len(found) <= 40, len(found)
    assert max(body.check(each.content.values) for each in found) <= 0.01
    assert all(numpy.isnan(each.content.values[4 * JOINTS]) for each in found), "a point that was not seen"
    assert int(re.findall(r"lost on the way (\d+)", monitor.stderr)[-1]) >= 20, monitor.stderr
