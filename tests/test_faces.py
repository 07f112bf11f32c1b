"""A face that is drawn blinks in front of a camera: the model finds its eyes, and the bag has its blinks."""

import functools
import itertools
import time

import bags
import harness
import numpy
from rosbags.typesys import Stores, get_typestore
from tables import described, stamp_ns
from test_models import FOUND, HEIGHT, IS_SEEN, OF_JOINTS, WIDTH, jpeg, make, placed, started

assert started, "a fixture"

# An eye: its width, and the height of an open and a closed one [px]; the lids' points are beside each other, so that none is
# hidden when it closes.
EYE, OPEN, CLOSED = 60, 21, 4
POINTS = {"outside": (-30, 0), "inside": (30, 0), "top_1": (-7, -1), "top_2": (7, -1), "bottom_1": (-18, 1), "bottom_2": (18, 1)}
CENTRES = {"right_eye": (64, 100), "left_eye": (192, 100)}
# A blink [s]: the eyes close, stay and open again.
CLOSES, STAYS, OPENS = 0.1, 0.06, 0.16
BLINKS, BEFORE, HZ = 20, 6.0, 25.0


def opening(t: float, blinks) -> float:
    """The height of the eyes [px], in steps of a sixteenth, so that few pictures have to be drawn."""
    closed = 0.0
    for begin in blinks:
        since = t - begin
        part = min(since / CLOSES, 1.0) if since < CLOSES + STAYS else 1.0 - (since - CLOSES - STAYS) / OPENS
        closed = max(closed, min(max(part, 0.0), 1.0))
    return round(16 * (OPEN + (CLOSED - OPEN) * closed)) / 16


@functools.cache
def face(height: float) -> bytes:
    """A picture of a face with eyes of this height, whose points have the colours that the model knows."""
    pixels = numpy.random.default_rng(7).uniform(0, 20, (HEIGHT, WIDTH, 3))
    colours = iter(make.colours())
    for (x, y), (right, up) in itertools.product(CENTRES.values(), POINTS.values()):
        place = (x + right, y + up * height / 2)
        left, top = (int(each) - 6 for each in place)
        rows, columns = numpy.mgrid[top : top + 13, left : left + 13]
        # The edge of a disc of 4 px covers pixels in part, so that it can stand between them.
        covered = numpy.clip(4.5 - numpy.hypot(columns - place[0], rows - place[1]), 0, 1)[..., None]
        part = pixels[top : top + 13, left : left + 13]
        part[:] = covered * 255 * next(colours) + (1 - covered) * part
    return jpeg(numpy.clip(pixels + 0.5, 0, 255).astype(numpy.uint8))


@functools.cache
def types():
    return get_typestore(Stores.ROS2_JAZZY)


def stamped(content: bytes, at_ns: int) -> str:
    """A message with the time at which the picture was taken, as hexadecimal."""
    store = types()
    secs, nanos = divmod(at_ns, 1_000_000_000)
    header = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](secs, nanos), "camera")
    name = "sensor_msgs/msg/CompressedImage"
    message = store.types[name](header, "jpeg", numpy.frombuffer(content, numpy.uint8))
    return bytes(store.serialize_cdr(message, name)).hex()


def all_of(looked, begin: float, end: float) -> bool:
    """Whether hardly a picture between these times [s] was skipped."""
    within = numpy.concatenate([[begin], looked[(looked > begin) & (looked < end)], [end]])
    return numpy.diff(within).max() < 2.5 / HZ


def descriptor() -> str:
    eyes = [f"{eye}_{point}" for eye in CENTRES for point in POINTS]
    names = eyes + [f"other_{place}" for place in range(make.JOINTS - len(eyes))]
    joints = [f"j{joint}" for joint in range(make.JOINTS)]
    return OF_JOINTS.replace(str(joints), str(names))


def test_blinks_of_a_drawn_face_are_in_the_bag(started, tmp_path):
    # Little to look at, so that a busy machine skips few pictures.
    model = make.joints_between(80, 120).SerializeToString()
    found = placed(tmp_path, model, descriptor())
    monitor, camera, out = started(found, "[features]\nwindows_secs = [10]\n")
    random = numpy.random.default_rng(7)
    show = lambda t, at_ns, blinks: camera.say(stamped(face(opening(t, blinks)), at_ns))
    harness.eventually(lambda: show(0, time.time_ns(), []) or IS_SEEN in monitor.stderr, within_secs=60)
    begin_ns = time.time_ns()
    blinks = BEFORE + numpy.cumsum(random.uniform(1.0, 2.5, BLINKS))
    while (t := (time.time_ns() - begin_ns) / 1e9) < blinks[-1] + 2:
        show(t, begin_ns + int(t * 1e9), blinks)
        time.sleep(max(0.0, (int(t * HZ) + 1) / HZ - (time.time_ns() - begin_ns) / 1e9))
    assert monitor.interrupt() == 0, monitor.report()

    bag = harness.the_bag(out)
    assert described(bag)[FOUND].signal == "face"
    points = [numpy.array(each.content.values)[:36].reshape(2, 6, 3) for each in bags.messages(bag, FOUND)]
    corners = [[x + POINTS["outside"][0], y] for x, y in CENTRES.values()]
    assert max(numpy.hypot(*(each[:, 0, :2] - corners).T).max() for each in points) <= 0.5
    # A busy machine skips pictures: what nobody looked at can't be found.
    looked = numpy.array([stamp_ns(each) / 1e9 for each in bags.messages(bag, FOUND)])
    shuts = begin_ns / 1e9 + blinks
    seen = [all_of(looked, shut - 0.3, shut + 0.7) for shut in shuts]
    middles = shuts + CLOSES / 2 + (STAYS + CLOSES / 2 + OPENS / 2) / 2
    stated = [(stamp_ns(each) / 1e9, each.content) for each in bags.messages(bag, f"{FOUND}/blinks")]
    errors = numpy.array([min((abs(at - middle) for at, _ in stated), default=9.0) for middle in middles])
    right = [at for at, _ in stated if numpy.abs(middles - at).min() < 0.1]
    share = numpy.mean(errors[seen] < 0.1)
    print(
        f"blinks of a drawn face: {100 * share:.0f} % of {sum(seen)} found (95), {len(stated) - len(right)} others (1), at most "
        f"{1e3 * errors[errors < 0.1].max():.0f} ms off; {len(points)} pictures"
    )
    assert sum(seen) >= 5, "too few pictures were looked at"
    assert share >= 0.95 and len(stated) - len(right) <= 1
    windows = bags.messages(bag, f"{FOUND}/face/w10")
    assert windows, "no windows"
