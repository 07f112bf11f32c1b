"""What the operator of a demo wears, and what is left of it."""

import os
import shutil
import signal
import tempfile
from pathlib import Path

import pytest

import bags
import harness

PERSON = "/humans/persons/p001"


@pytest.fixture
def temporary(monkeypatch):
    """The folder of temporary files, with a path that is short enough for a socket."""
    folder = Path(tempfile.mkdtemp())
    monkeypatch.setenv("TMPDIR", str(folder))
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


def processes_of(folder: Path) -> list[str]:
    """The processes with this folder in their command."""
    found = []
    for command in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            text = command.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except (FileNotFoundError, ProcessLookupError):
            continue
        if str(folder) in text and "pytest" not in text:
            found.append(text)
    return found


def test_each_sensor_of_the_operator_is_read_once(demo_bag):
    if not shutil.which("dbus-daemon"):
        pytest.skip("dbus-daemon is not installed")
    counts = {topic: len(samples) for topic, samples in bags.raw(demo_bag).items()}
    for topic, least in {
        "polar_h10/ecg": 20,
        "polar_h10/rr_interval": 10,
        "myo/emg": 1000,
        "shimmer3/eda": 1000,
        "simulated/eeg": 50,
        "simulated/ppg": 50,
        "simulated/respiration": 50,
    }.items():
        assert counts[f"{PERSON}/{topic}"] >= least, topic
    for twice in ["ecg", "emg", "eda_fingers"]:
        assert f"{PERSON}/simulated/{twice}" not in counts


def test_a_demo_has_no_faults_of_its_own(demo_bag):
    events = [each.content for each in bags.messages(demo_bag, "/session/events")]
    assert not [each.label for each in events if each.kind == "fault"]


def test_the_beats_of_the_operator_are_those_of_the_one_body(demo_bag, figure):
    if not shutil.which("dbus-daemon"):
        pytest.skip("dbus-daemon is not installed")
    truth = [stamp_secs(each) for each in bags.messages(demo_bag, f"{PERSON}/truth/beats")]
    found = [stamp_secs(each) for each in bags.messages(demo_bag, f"{PERSON}/polar_h10/ecg/beats")]
    # In the first seconds it is not yet known how late the strap is.
    found = [secs for secs in found if secs > truth[0] + 8]
    late_ms = [1e3 * min((secs - beat for beat in truth), key=abs) for secs in found]
    middle = sorted(late_ms)[len(late_ms) // 2]
    spread = max(abs(each - middle) for each in late_ms)
    figure(f"demo: {len(found)} beats of the H10 are {middle:.1f} ms from those of the body on ROS, within {spread:.1f} ms")
    assert len(found) > 5
    # The latency of a real H10, 50 ms, which the emulated one does not have, is taken off.
    assert abs(middle + 50) < 5 and spread < 30, late_ms


@pytest.mark.parametrize("how", ["by itself", "SIGTERM", "SIGKILL"])
def test_a_demo_leaves_no_folder_and_no_process_behind(stage, temporary, how):
    out = stage.folder / "sessions"
    duration = ["--duration", 4] if how == "by itself" else []
    demo = stage.teampulse("demo", "--out", out, *duration)
    demo.wait_for("shimmer3/eda|robot1 online")
    if how != "by itself":
        assert list(temporary.glob("teampulse-demo-*"))
        os.kill(demo.pid, getattr(signal, how))
    demo.ended()
    harness.eventually(lambda: not processes_of(temporary))
    harness.eventually(lambda: not list(temporary.glob("teampulse-*")))


def stamp_secs(message) -> float:
    stamp = message.content.header.stamp
    return stamp.sec + stamp.nanosec * 1e-9
