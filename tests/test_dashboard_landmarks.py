"""Landmarks on the dashboard's cameras: each picture is shown with the points that were found in it, live and in a recording."""

import contextlib
import hashlib
import json

import harness
import numpy
import pytest
from test_dashboard_pages import AXE, SHOTS, address_of, chromium, screens, serious  # noqa: F401
from test_dashboard_video import compressed
from test_models import CAMERA, MADE, OF_JOINTS, drawn

# The names of COCO, in its order; the model finds a disc of its own colour for each.
JOINTS = ["nose", "left_eye", "right_eye", "left_ear", "right_ear"] + [
    f"{side}_{part}" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in ("left", "right")
]
HZ = 10
# Of the picture that is shown and of what is drawn over it: of which of some sets of places it has discs and points.
SEEN = """(figure, sets) => {
  const [picture, over] = ["picture", "points"].map((name) => figure.querySelector(`canvas.${name}`));
  const size = [picture.width, picture.height];
  const box = [picture.clientWidth, picture.clientHeight];
  const scale = Math.min(box[0] / size[0], box[1] / size[1]);
  const pixel = (canvas, x, y) => canvas.getContext("2d").getImageData(Math.round(x), Math.round(y), 1, 1).data;
  const isDisc = ([x, y]) => Math.max(...pixel(picture, x, y).slice(0, 3)) > 40;
  const isPoint = ([x, y]) => {
    const [left, top] = [0, 1].map((k) => (box[k] - scale * size[k]) / 2);
    const ratio = over.width / over.clientWidth;
    return pixel(over, (left + scale * (x + 0.5)) * ratio, (top + scale * (y + 0.5)) * ratio)[3] > 200;
  };
  const most = (is) => sets.map((places) => places.filter(is).length);
  return {picture: most(isDisc), points: over ? most(isPoint) : null, label: picture.getAttribute("aria-label")};
}"""


@pytest.fixture(scope="module")
def poses():
    """Two pictures with their joints, far from each other."""
    random = numpy.random.default_rng(5)
    first = drawn(random)
    while True:
        second = drawn(random)
        apart = numpy.hypot(*(first[1][:, None] - second[1][None]).transpose(2, 0, 1))
        if apart.min() > 9:
            return first, second


def study(stage, folder) -> str:
    model = (MADE / "joints.onnx").read_bytes()
    (folder / "joints.onnx").write_bytes(model)
    head = f'name = "pose"\nfile = "joints.onnx"\nlicence = "MIT"\nsha256 = "{hashlib.sha256(model).hexdigest()}"\n'
    names = OF_JOINTS.split("names = ")[0] + f"names = {json.dumps(JOINTS)}\n"
    (folder / "pose.toml").write_text(head + names)
    return stage.study(f"""
[session]
name = "landmarks"
[[sources]]
type = "robots"
namespace = "/robot*"
images = ["front/compressed"]
[[workers]]
type = "model"
streams = ["{CAMERA}"]
descriptors = ["{folder / 'pose.toml'}"]
person = "p001"
[[sinks]]
type = "bag"
tidy = false
""")


def consistent(seen: dict) -> int | None:
    """Which pose is shown with its points; `None` without points. Points of the other pose fail."""
    shown = max(range(len(seen["picture"])), key=seen["picture"].__getitem__)
    if seen["points"] is None or max(seen["points"]) == 0:
        return None
    if seen["points"][shown] < 15:
        raise ValueError(f"points of another picture: {seen}")
    return shown


def test_each_picture_is_shown_with_its_own_landmarks_and_a_key_hides_them(stage, screens, poses):  # noqa: F811
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", study(stage, stage.folder), "--out", out)
    camera = stage.cyclone("send", CAMERA, "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
    camera.answer("matched")
    page = screens(address_of(monitor)).page
    messages = [compressed(picture, "jpeg") for picture, _ in poses]
    sets = [places.tolist() for _, places in poses]
    figure = page.locator(f".videos figure:has(b[title='{CAMERA}'])").first
    turn = 0

    def look(count: int, page=page, figure=figure) -> list[int | None]:
        """Goes on showing one pose after the other, each a few times, and looks at the page."""
        nonlocal turn
        found = []
        for _ in range(count):
            camera.say(messages[turn // 3 % 2])
            turn += 1
            page.wait_for_timeout(1000 / HZ)
            if figure.count() and figure.locator("canvas.picture").evaluate("(canvas) => canvas.width > 4"):
                found.append(consistent(figure.evaluate(SEEN, sets)))
        return found

    harness.eventually(lambda: any(pose is not None for pose in look(2)), within_secs=60)
    seen = look(60)
    assert {0, 1} <= set(seen), seen
    # Pictures wait for their points: few are shown without them while points come.
    assert seen.count(None) <= 20, seen
    assert "landmarks of a body" in figure.evaluate(SEEN, sets)["label"]
    page.keyboard.press("Shift+L")
    figure.locator("canvas.points").wait_for(state="detached")
    assert set(look(5)) == {None}
    page.keyboard.press("Shift+L")
    figure.locator("canvas.points").wait_for()
    harness.eventually(lambda: look(2)[-1] is not None)

    SHOTS.mkdir(parents=True, exist_ok=True)
    page.get_by_role("button", name="Landmarks").first.wait_for()
    page.screenshot(path=SHOTS / "landmarks-team.png")
    figure.click()
    large = page.locator("dialog figure")
    harness.eventually(lambda: look(2, figure=large)[-1] is not None)
    page.screenshot(path=SHOTS / "landmarks-large.png")
    if AXE.exists():
        assert serious(page) == []
    page.keyboard.press("Escape")
    page.goto(page.url.split("#")[0] + "#/signals")
    figure.wait_for()
    assert any(pose is not None for pose in look(20))
    page.screenshot(path=SHOTS / "landmarks-signals.png")
    assert monitor.interrupt() == 0, monitor.report()

    player = stage.teampulse("play", harness.the_bag(out), "--no-ros")
    page = screens(player.wait_for(r"the dashboard is at (http://\S+)/")[1] + "/", linked="connected").page
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-label=Play]")
    figure = page.locator(f".videos figure:has(b[title='{CAMERA}'])").first

    def position() -> float:
        minutes, secs = page.locator("[data-testid=position] b").inner_text().split(":")
        return 60 * int(minutes) + float(secs)

    page.keyboard.press("Home")
    harness.eventually(lambda: position() == 0)
    page.keyboard.press("End")
    harness.eventually(lambda: position() > 5)
    end_secs = position()
    # Quick steps add up, also before the first is answered.
    for key in ("Home", "End", "ArrowLeft", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
    harness.eventually(lambda: abs(position() - (end_secs - 3)) <= 1)
    picture = figure.locator("canvas.picture")
    picture.wait_for()

    def seen_now() -> int | None:
        is_there = picture.evaluate("(canvas) => canvas.width > 4")
        return consistent(figure.evaluate(SEEN, sets)) if is_there else None

    # A second back each time, until both poses were seen; never with the points of the other. There are moments without
    # pictures.
    poses_seen = set()
    for _ in range(25):
        page.keyboard.press("ArrowLeft")
        with contextlib.suppress(AssertionError):
            harness.eventually(lambda: seen_now() is not None, 2)
        poses_seen.add(seen_now())
        if {0, 1} <= poses_seen:
            break
    assert {0, 1} <= poses_seen
    page.screenshot(path=SHOTS / "landmarks-replay.png")
