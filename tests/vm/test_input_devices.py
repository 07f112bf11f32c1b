"""teampulse reads a keyboard and a mouse of Linux' own (uinput), in a virtual machine: what is not ours is everything below
`/dev/input`."""

import os
import subprocess
from pathlib import Path

import bags
import harness
import numpy
import pytest
from tables import described, stamp_ns
from typist import PASSWORD, code

HERE = Path(__file__).parent
KERNEL = harness.ROOT / "target/vm/kernel"
BOOT_SECS = 600
KEYBOARD = "/humans/persons/p001/keyboard/activity"
MOUSE = "/humans/persons/p001/mouse/activity"


class Results:
    """What a session in the virtual machine left."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.bag = harness.the_bag(folder / "recorded")

    def text(self, name: str) -> str:
        return (self.folder / name).read_text()

    def numbers(self, topic: str) -> dict[str, numpy.ndarray]:
        """The values of each channel, and the time of each second [s]."""
        messages = bags.messages(self.bag, topic)
        values = numpy.array([each.content.values for each in messages])
        secs = numpy.array([stamp_ns(each) / 1e9 for each in messages])
        return {**dict(zip(described(self.bag)[topic].channels, values.T)), "secs": secs}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    command = [HERE / "boot", KERNEL, folder, HERE / "inputs"]
    env = {**os.environ, "TEAMPULSE": str(harness.TEAMPULSE)}
    ran = subprocess.run(list(map(str, command)), env=env, capture_output=True, text=True, timeout=BOOT_SECS)
    logs = "\n".join(f"--- {each.name}\n{each.read_text()}" for each in sorted(folder.glob("*.*")))
    assert (folder / "recorded").is_dir(), ran.stdout + ran.stderr + logs
    return Results(folder)


def test_scan_lists_the_keyboard_and_the_mouse(results):
    listed = results.text("scan.txt")
    assert "Test keyboard" in listed and "Test mouse" in listed


def test_presses_and_corrections_are_those_of_the_keyboard_before_and_after_it_was_unplugged(results):
    assert results.text("run.code").strip() == "0", results.text("run.err")
    keys = results.numbers(KEYBOARD)
    again = keys["secs"] > float(results.text("back"))
    for part in (again, ~again):
        presses, corrections = keys["presses"][part].sum(), keys["corrections"][part].sum()
        print(f"{presses:.0f} presses ({len(PASSWORD) + 3}), {corrections:.0f} corrections (3)")
        assert (presses, corrections) == (len(PASSWORD) + 3, 3)


def test_path_clicks_and_wheel_are_those_of_the_mouse(results):
    mouse = results.numbers(MOUSE)
    assert mouse["path"].sum() == pytest.approx(50 + 100)
    assert (mouse["clicks"].sum(), mouse["wheel"].sum()) == (1, 3)


def test_the_password_leaves_no_trace(results):
    files = [path for path in results.folder.rglob("*") if path.is_file() and path.name != "typist.err"]
    left = [path.read_bytes() for path in files] + [cdr for _, _, cdr in bags.stored(results.bag)]
    codes = [code(letter) for letter in PASSWORD[:5]]
    rows = [numpy.array(codes, dtype).tobytes() for dtype in ("u1", "<u2", "<u4", "<u8", "<f4", "<f8")]
    texts = [separator.join(map(str, codes)).encode() for separator in (" ", ",", ", ")]
    for trace in (PASSWORD[:5].encode(), *rows, *texts):
        assert not any(trace in each for each in left), trace
