"""Faces and bodies that other programs see (REP-155): received as a person's, and published for others."""

import functools
import time

import bags
import harness
import numpy
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from tables import described, stamp_ns

WIDTH, HEIGHT, HZ, SECS = 640, 480, 20, 16.0
PERSON = "/humans/persons/p001"
# The face has another id from here on; for a second another one is nobody's.
LOST_SECS = 8.0
BLINKS = [3.5, 5.0, 6.5, 10.5, 12.0, 13.5]
# A quarter of a second at half of its depth.
CLOSES, STAYS, OPENS = 0.1, 0.1, 0.2
EYES = {"right": (250.0, 200.0), "left": (390.0, 200.0)}
# The points of an eye in the order of their codes, from its centre [px].
POINTS = [(-20, 0), (-7, -1), (7, -1), (20, 0), (7, 1), (-7, 1)]

SEEN = """
[[sources]]
type   = "hri"
person = "p001"
face   = "*"
body   = "*"
frame  = [640, 480]
position = "/mocap/p001"
[[sources]]
type      = "robots"
namespace = "/robot*"
[[sinks]]
type = "bag"
tidy = false
[features]
windows_secs = [3]
"""
PUBLISHED = """
[[sinks]]
type      = "hri"
streams   = ["/humans/persons/p001/hri/*"]
namespace = "/seen"
"""


@functools.cache
def store():
    """The types of Jazzy, and those of hri_msgs."""
    types = get_typestore(Stores.ROS2_JAZZY)
    text = (harness.ROOT / "crates/messages/definitions/hri_msgs.msgs").read_text()
    known = {}
    for body in text.split("\n["):
        name, _, fields = body.lstrip("[").partition("]\n")
        known.update(get_types_from_msg(fields, f"hri_msgs/msg/{name}"))
    types.register(known)
    return types


def kind(name: str):
    return store().types[name]


def cdr(message) -> str:
    return bytes(store().serialize_cdr(message, message.__msgtype__)).hex()


def header(at_ns: int, frame="camera"):
    secs, nanos = divmod(at_ns, 1_000_000_000)
    return kind("std_msgs/msg/Header")(kind("builtin_interfaces/msg/Time")(secs, nanos), frame)


def point(x: float, y: float, c=0.9):
    return kind("hri_msgs/msg/NormalizedPointOfInterest2D")(x / WIDTH, y / HEIGHT, c)


def opening(secs: float) -> float:
    """How far the eyes are open."""
    for begin in BLINKS:
        t = secs - begin
        if 0 <= t < CLOSES:
            return 1 - t / CLOSES
        if CLOSES <= t < CLOSES + STAYS:
            return 0.0
        if CLOSES + STAYS <= t < CLOSES + STAYS + OPENS:
            return (t - CLOSES - STAYS) / OPENS
    return 1.0


def face(secs: float, at_ns: int, noise) -> str:
    unknown = kind("hri_msgs/msg/NormalizedPointOfInterest2D")(0.0, 0.0, 0.0)
    points = [unknown] * 70
    for first, side in ((36, "right"), (42, "left")):
        x, y = EYES[side]
        for place, (dx, dy) in enumerate(POINTS):
            lid = 6.0 * dy * (0.1 + 0.9 * opening(secs))
            points[first + place] = point(x + dx + noise.normal(0, 0.1), y + lid + noise.normal(0, 0.1))
    return cdr(kind("hri_msgs/msg/FacialLandmarks")(header(at_ns), points, HEIGHT, WIDTH))


def body(at_ns: int) -> str:
    places = {0: (320, 150), 2: (260, 240), 5: (380, 240), 8: (280, 420), 11: (360, 420)}
    unknown = kind("hri_msgs/msg/NormalizedPointOfInterest2D")(0.0, 0.0, 0.0)
    points = [point(*places[code]) if code in places else unknown for code in range(18)]
    return cdr(kind("hri_msgs/msg/Skeleton2D")(header(at_ns), points))


def happy(at_ns: int) -> str:
    words = {name: value for name, value in vars(kind("hri_msgs/msg/Expression")).items() if name.isupper()}
    assert words["HAPPY"] == "happy"
    return cdr(kind("hri_msgs/msg/Expression")(header(at_ns), "happy", 0.5, 0.25, 0.8))


def pose(x: float, y: float):
    of = lambda name, *fields: kind(f"geometry_msgs/msg/{name}")(*fields)
    return of("Pose", of("Point", x, y, 0.0), of("Quaternion", 0.0, 0.0, 0.0, 1.0))


def standing(at_ns: int) -> str:
    return cdr(kind("geometry_msgs/msg/PoseStamped")(header(at_ns, "map"), pose(0.0, 0.0)))


def driving(at_ns: int, y: float) -> str:
    of = lambda name, *fields: kind(f"geometry_msgs/msg/{name}")(*fields)
    none, zeros = of("Vector3", 0.0, 0.0, 0.0), numpy.zeros(36)
    twist = of("TwistWithCovariance", of("Twist", none, none), zeros)
    where = of("PoseWithCovariance", pose(0.0, y), zeros)
    return cdr(kind("nav_msgs/msg/Odometry")(header(at_ns, "map"), "base_link", where, twist))


class Nodes:
    """Nodes that see people, a motion capture system and a robot."""

    def __init__(self, stage):
        send = lambda topic, name: stage.cyclone("send", topic, "--type", name, "--subscribers", 1)
        landmarks = "hri_msgs/msg/FacialLandmarks"
        self.faces = [send(f"/humans/faces/{id}/landmarks", landmarks) for id in ("af3d", "b092e")]
        self.expression = send("/humans/faces/af3d/expression", "hri_msgs/msg/Expression")
        self.body = send("/humans/bodies/67dd1/skeleton2d", "hri_msgs/msg/Skeleton2D")
        self.mocap = send("/mocap/p001", "geometry_msgs/msg/PoseStamped")
        self.robot = send("/robot1/odom", "nav_msgs/msg/Odometry")
        for each in (*self.faces, self.expression, self.body, self.mocap, self.robot):
            each.answer("matched")

    def begin(self) -> None:
        """A first message of each: the next ones are sent without a delay."""
        noise, now_ns = numpy.random.default_rng(4), time.time_ns()
        first = [
            (self.faces[0], face(0.0, now_ns, noise)),
            (self.faces[1], "0001"),
            (self.expression, happy(now_ns)),
            (self.body, body(now_ns)),
            (self.mocap, standing(now_ns)),
            (self.robot, driving(now_ns, 4.0)),
        ]
        for node, message in first:
            node.say(message)
            node.answer("sent")

    def see(self) -> int:
        """What they see for some seconds, from this time on [ns]."""
        noise, begin_ns = numpy.random.default_rng(5), time.time_ns()
        for picture in range(int(SECS * HZ)):
            secs = picture / HZ
            time.sleep(max(0.0, begin_ns / 1e9 + secs - time.time()))
            at_ns = begin_ns + int(secs * 1e9)
            self.faces[secs >= LOST_SECS].say(face(secs, at_ns, noise))
            if picture % 4 == 0:
                self.body.say(body(at_ns))
                if secs < LOST_SECS:
                    self.expression.say(happy(at_ns))
                self.mocap.say(standing(at_ns))
                self.robot.say(driving(at_ns, 4.0 - 0.1 * secs))
        return begin_ns


def values(bag, topic: str, name: str) -> numpy.ndarray:
    """A number of all windows of a stream."""
    place = list(described(bag)[topic].channels).index(name)
    return numpy.array([each.content.values[place] for each in bags.messages(bag, topic)])


def finite(numbers: numpy.ndarray) -> numpy.ndarray:
    return numbers[numpy.isfinite(numbers)]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The bag of a session, when it began to see somebody, and what was heard of what it published."""
    stage = harness.Stage(tmp_path_factory.mktemp("hri"), 98)
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(SEEN + PUBLISHED), "--out", out)
    listen = lambda topic, name: stage.cyclone(
        "subscribe", topic, "--type", f"hri_msgs/msg/{name}", "--keep", 100_000, "--seconds", 300
    )
    heard = {
        name: listen(f"/seen/{topic}", name)
        for topic, name in {
            "faces/p001/landmarks": "FacialLandmarks",
            "faces/p001/expression": "Expression",
            "bodies/p001/skeleton2d": "Skeleton2D",
            "faces/tracked": "IdsList",
        }.items()
    }
    for each in heard.values():
        each.answer("subscribed")
    nodes = Nodes(stage)
    # What is broken hurts nobody.
    for broken in ("0001", "00010000ff", "00010000" + "ff" * 900):
        nodes.faces[0].say(broken)
    nodes.begin()
    begin_ns = nodes.see()
    time.sleep(1)
    for each in heard.values():
        each.say_no_more()
    read = lambda name, sample: store().deserialize_cdr(bytes.fromhex(sample), f"hri_msgs/msg/{name}")
    messages = {
        name: [read(name, sample) for sample in each.answer("samples")["samples"]] for name, each in heard.items()
    }
    assert monitor.interrupt() == 0, monitor.report()
    yield harness.the_bag(out), begin_ns, messages
    stage.close()


def test_points_of_a_face_are_a_persons_under_any_id(session):
    bag, begin_ns, _ = session
    topic = f"{PERSON}/hri/landmarks"
    stream = described(bag)[topic]
    assert (stream.id, stream.signal, bags.origins(bag)[topic]) == ("p001", "face", "raw")
    x = list(stream.channels).index("right_eye_outside_x")
    assert (stream.channels[x + 1], stream.units[x]) == ("right_eye_outside_y", "px")
    seen = [each for each in bags.messages(bag, topic) if stamp_ns(each) >= begin_ns - 1_000_000]
    # Another face for a second is nobody's, while the first one may come back.
    assert SECS * HZ - 1.3 * HZ <= len(seen) <= SECS * HZ - 0.8 * HZ
    places = numpy.array([each.content.values[x : x + 2] for each in seen])
    assert numpy.abs(places - [230, 200]).max() < 1.0
    # Its times are those of the pictures.
    at = (numpy.array([stamp_ns(each) for each in seen]) - begin_ns) / 1e9 * HZ
    assert numpy.abs(at - at.round()).max() < 0.05


def test_features_run_on_what_others_see(session, figure):
    bag, begin_ns, _ = session
    middles = begin_ns / 1e9 + numpy.array(BLINKS) + (CLOSES / 2 + CLOSES + STAYS + OPENS / 2) / 2
    blinks = numpy.array([stamp_ns(each) / 1e9 for each in bags.messages(bag, f"{PERSON}/hri/landmarks/blinks")])
    assert len(blinks) == len(BLINKS), blinks - begin_ns / 1e9
    figure(f"blinks in landmarks of another program: {len(blinks)} of {len(BLINKS)}, at most {1e3 * abs(blinks - middles).max():.0f} ms off")
    assert abs(blinks - middles).max() < 0.1
    posture = f"{PERSON}/hri/skeleton2d/posture/w3"
    assert numpy.abs(finite(values(bag, posture, "BODY_Lean"))).max() < 0.01
    # The nose is 90 px above shoulders that are 120 px apart.
    assert numpy.abs(finite(values(bag, posture, "BODY_HeadHeight")) - 0.75).max() < 0.01
    expression = f"{PERSON}/hri/expression/expression/w3"
    [name] = [name for name in described(bag)[expression].channels if "Mean" in name and "happy" in name]
    assert numpy.abs(finite(values(bag, expression, name)) - 0.8).max() < 1e-6
    confidence = finite(values(bag, expression, "EXPRESSION_Confidence"))
    assert numpy.abs(confidence - (0.8 - 1 / 25) / (1 - 1 / 25)).max() < 1e-6


def test_distances_of_people_and_robots_are_known(session):
    bag, begin_ns, _ = session
    topic = f"{PERSON}/proximity/robot1"
    distances = finite(values(bag, topic, "distance"))
    assert len(distances) >= SECS - 4
    assert distances.max() <= 4.0 and abs(distances.min() - (4.0 - 0.1 * SECS)) < 0.3
    # At its ends the robot stands still.
    assert abs(numpy.median(finite(values(bag, topic, "approach_speed"))) - 0.1) < 0.01
    assert set(finite(values(bag, f"{PERSON}/proximity", "within"))) == {0.0}
    # Windows and baselines are those of all numbers.
    statistics = f"{topic}/statistics/w3"
    least = next(name for name in described(bag)[statistics].channels if "distance" in name and "minimum" in name)
    assert len(finite(values(bag, statistics, least))) >= 3


def test_what_is_seen_is_published_for_others(session):
    _, _, messages = session
    faces = messages["FacialLandmarks"]
    assert len(faces) > 10 * HZ, len(faces)
    corner = numpy.array([[face.landmarks[36].x * WIDTH, face.landmarks[36].y * HEIGHT] for face in faces])
    assert numpy.abs(corner - [230, 200]).max() < 1.0
    assert {(face.width, face.height) for face in faces} == {(WIDTH, HEIGHT)}
    assert all(face.landmarks[0].c == 0 for face in faces)
    assert {each.expression for each in messages["Expression"]} == {"happy"}
    assert abs(messages["Expression"][0].confidence - 0.8) < 1e-6
    neck = messages["Skeleton2D"][0].skeleton[1]
    assert abs(neck.x * WIDTH - 320) < 0.1 and abs(neck.y * HEIGHT - 240) < 0.1
    lists = [list(each.ids) for each in messages["IdsList"]]
    assert ["p001"] in lists and lists[-1] in ([], ["p001"]), lists


def test_a_person_manager_says_whose_face_it_is_and_nothing_of_people_is_published(stage):
    study = SEEN.split("face ")[0] + 'id = "gvbec"\n[[sinks]]\ntype = "bag"\ntidy = false\n'
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(study), "--out", out)
    faces = [
        stage.cyclone("send", f"/humans/faces/{id}/landmarks", "--type", "hri_msgs/msg/FacialLandmarks") for id in "ab"
    ]
    latched = ("--transient-local", "--depth", 1, "--type", "std_msgs/msg/String")
    manager = stage.cyclone("send", "/humans/persons/gvbec/face_id", *latched)
    for each in (*faces, manager):
        each.answer("matched")
    noise = numpy.random.default_rng(1)
    show = lambda secs: [each.say(face(secs, time.time_ns(), noise)) for each in faces]
    show(0.0)
    time.sleep(0.5)
    manager.say(cdr(kind("std_msgs/msg/String")("b")))
    time.sleep(0.5)
    for picture in range(60):
        show(picture / HZ)
        time.sleep(1 / HZ)
    graph = stage.cyclone("graph", "--seconds", 2).answer("nodes")
    [ours] = [node for node in graph["nodes"] if node["name"] == "/teampulse"]
    published = {end["topic"] for end in graph["endpoints"] if end["gid"] in ours["writers"]}
    assert published and not any("/humans/" in topic for topic in published), published
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    seen = bags.messages(bag, f"{PERSON}/hri/landmarks")
    assert len(seen) == 60, "those of one of both faces, since it is known whose it is"


def test_check_and_scan_know_people_whom_others_see(stage):
    study = stage.study(SEEN.split("[[sinks]]")[0])
    nobody = stage.ask("check", study)
    assert nobody.returncode == 5 and "no face or body of a person of the study is published" in nobody.stdout, nobody.stdout
    node = stage.cyclone("send", "/humans/faces/a/landmarks", "--type", "hri_msgs/msg/FacialLandmarks", "--subscribers", 0)
    node.answer("matched")
    scan = stage.ask("scan", "--seconds", 2)
    assert 'type   = "hri"' in scan.stdout, scan.stdout
    other = stage.ask("check", stage.study('[[sources]]\ntype = "topics"\nnames = ["/tf"]\n', "other.toml"))
    assert 'add [[sources]] with type = "hri"' in other.stdout, other.stdout
