"""What a person does at a keyboard and a mouse, read from an X11 display: how much and when, never what.

The keys are those of another program (xdotool, at a display of Xvfb)."""

import contextlib
import os
import shutil
import subprocess
from pathlib import Path

import bags
import harness
import numpy
import pytest
from conftest import leave_out
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
from tables import described, stamp_ns

KEYBOARD = "/humans/persons/p001/keyboard/activity"
MOUSE = "/humans/persons/p001/mouse/activity"
PASSWORD = "xylophonewaltzquick"
# The rows of keys, each with the code of its first one, by Linux; X11 counts eight more.
ROWS = {"qwertyuiop": 16, "asdfghjkl": 30, "zxcvbnm": 44}
STUDY = """
[[sources]]
type = "inputs"
person = "p001"
via = "x11"
[[sinks]]
type = "bag"
tidy = true
[features]
windows_secs = [5]
"""


class Display:
    """An X11 display without a screen, and somebody at it."""

    def __init__(self, folder: Path):
        if not (shutil.which("Xvfb") and shutil.which("xdotool")):
            leave_out("this system has no Xvfb or no xdotool")
        read, write = os.pipe()
        command = ["Xvfb", "-displayfd", str(write), "-nolisten", "tcp", "-noreset"]
        with (folder.parent / "xvfb.log").open("w") as log:
            self.server = subprocess.Popen(command, pass_fds=[write], stdout=log, stderr=log)
        os.close(write)
        with os.fdopen(read) as answer:
            self.name = f":{answer.readline().strip()}"

    def do(self, *words) -> None:
        env = {**os.environ, "DISPLAY": self.name}
        subprocess.run(["xdotool", *map(str, words)], env=env, check=True, timeout=60)

    def close(self) -> None:
        self.server.terminate()
        self.server.wait()


@pytest.fixture(scope="module")
def used(tmp_path_factory):
    """A session in which somebody typed a password, mended it, and moved, clicked and turned the mouse."""
    folder = tmp_path_factory.mktemp("inputs")
    stage = harness.Stage(folder, 93)
    display = Display(folder)
    out = stage.folder / "sessions"
    study = stage.study(STUDY.replace('"x11"', f'"x11"\ndisplay = "{display.name}"'))
    env = {"RUST_LOG": "debug"}
    monitor = stage.teampulse("run", study, "--out", out, env=env)
    try:
        harness.eventually(lambda: any(out.glob("*/*.mcap")))
        harness.eventually(lambda: seconds(out) >= 2)
        display.do("type", "--delay", 60, PASSWORD)
        display.do("key", "--delay", 60, "BackSpace", "BackSpace", "Delete")
        display.do("mousemove_relative", "--", 30, 40)
        display.do("mousemove_relative", "--", -60, 80)
        display.do("click", "--repeat", 2, "--delay", 100, 1)
        display.do("click", "--repeat", 3, "--delay", 50, 4)
        before = seconds(out)
        harness.eventually(lambda: seconds(out) >= before + 8)
        limits = Path(f"/proc/{monitor.pid}/limits").read_text()
    finally:
        code = monitor.interrupt()
        display.close()
    yield Used(monitor, code, harness.the_bag(out), limits, folder)
    stage.close()


def seconds(out: Path) -> int:
    """How many summaries of the keyboard are in the bag so far."""
    found = 0
    with next(out.glob("*/*.mcap")).open("rb") as file, contextlib.suppress(EndOfFile):
        # The bag has no index yet.
        for _, channel, _ in NonSeekingReader(file).iter_messages(log_time_order=False):
            found += channel.topic == KEYBOARD
    return found


class Used:
    """What the session left."""

    def __init__(self, monitor, code, bag, limits, folder):
        self.monitor, self.code, self.bag, self.limits, self.folder = monitor, code, bag, limits, folder

    def numbers(self, topic: str) -> dict[str, numpy.ndarray]:
        """The values of each channel."""
        channels = described(self.bag)[topic].channels
        values = numpy.array([each.content.values for each in bags.messages(self.bag, topic)])
        return dict(zip(channels, values.T))


def test_each_second_has_a_summary(used):
    assert used.code == 0, used.monitor.report()
    for topic in (KEYBOARD, MOUSE):
        stamps = [stamp_ns(each) for each in bags.messages(used.bag, topic)]
        assert all(stamp % 1_000_000_000 == 500_000_000 for stamp in stamps)
        assert set(numpy.diff(stamps)) == {1_000_000_000}


def test_presses_corrections_and_their_times_are_those_of_the_keyboard(used):
    keys = used.numbers(KEYBOARD)
    assert keys["presses"].sum() == len(PASSWORD) + 3
    assert keys["corrections"].sum() == 3
    # The last ones that are fewer than five are not given.
    assert keys["holds"].sum() >= len(PASSWORD) + 3 - 4
    assert 0 < mean_ms(keys, "hold") < mean_ms(keys, "interval")
    assert set(keys["idle"][keys["presses"] > 0]) == {0.0} and keys["idle"][-1] >= 5


def mean_ms(keys: dict, times: str) -> float:
    """The mean of all times of which means were given."""
    counts, means_ms = keys[f"{times}s"], keys[f"{times}_mean"]
    return numpy.average(means_ms[counts > 0], weights=counts[counts > 0])


def test_path_clicks_and_wheel_are_those_of_the_mouse(used):
    mouse = used.numbers(MOUSE)
    assert mouse["path"].sum() == pytest.approx(50 + 100)
    assert (mouse["clicks"].sum(), mouse["double_clicks"].sum(), mouse["wheel"].sum()) == (2, 1, 3)


def test_no_mean_is_of_fewer_than_five_times_and_no_idle_time_has_a_fraction(used):
    keys = used.numbers(KEYBOARD)
    for count in ("holds", "intervals"):
        assert all(each == 0 or each >= 5 for each in keys[count])
    assert (keys["idle"] % 1 == 0).all()


def test_neither_the_text_nor_the_codes_of_its_keys_are_anywhere(used):
    files = [path for path in used.folder.rglob("*") if path.is_file()]
    assert any(path.suffix == ".mcap" for path in files)
    left = [path.read_bytes() for path in files]
    left += [cdr for _, _, cdr in bags.stored(used.bag)]
    left += [used.monitor.stdout.encode(), used.monitor.stderr.encode()]
    codes = [code + row.index(key) for key in PASSWORD[:5] for row, code in ROWS.items() if key in row]
    for trace in [PASSWORD[:5].encode(), *packed(codes), *packed([code + 8 for code in codes])]:
        assert not any(trace in each for each in left), trace


def packed(codes: list[int]) -> list[bytes]:
    """Numbers in a row, as bytes of any width, and as text."""
    rows = [numpy.array(codes, dtype).tobytes() for dtype in ("u1", "<u2", "<u4", "<u8", "<f4", "<f8")]
    texts = [separator.join(map(str, codes)).encode() for separator in (" ", ",", ", ")]
    return rows + texts


def test_the_memory_of_the_reader_of_keys_does_not_end_in_a_file(used):
    line = next(line for line in used.limits.splitlines() if line.startswith("Max core file size"))
    assert line.split()[4] == "0", line


def test_a_display_that_is_not_there_is_reported_with_what_to_do(stage):
    study = stage.study(STUDY.replace('"x11"', '"x11"\ndisplay = ":4711"'))
    monitor = stage.teampulse("run", study, "--out", stage.folder / "sessions")
    monitor.wait_for("failed to open the X11 display :4711")
    assert monitor.interrupt() in (0, 1)
