"""Foxglove's own client sees the session: channels, an ECG that it decodes, numbers to plot, and a marker from there."""

import json
import shutil
import urllib.error
import urllib.request

import bags
import harness
import pytest
from conftest import leave_out

ROOT = harness.ROOT
CLIENT = ROOT / "tests/peers/foxglove_client.mjs"
ECG = "/humans/persons/p001/simulated/ecg"
STUDY = """
[session]
name = "viewed"
[commands]
foxglove = {commands}
[[sources]]
type = "people"
namespace = "/humans/persons/*"
[[sources]]
type = "robots"
namespace = "/robot*"
[[sinks]]
type = "foxglove"
port = {port}
[[sinks]]
type = "bag"
tidy = false
[simulate]
robots = 1
people = 1
"""


@pytest.fixture
def viewed(stage):
    """A session that viewers can open: gives what starts one."""
    if shutil.which("node") is None or not (ROOT / "web/node_modules/@foxglove/ws-protocol").exists():
        leave_out("Foxglove's client is not installed: `npm ci` in web/")

    def start(commands: str, port: int = 8765):
        study, out = stage.study(STUDY.format(commands=commands, port=port)), stage.folder / "sessions"
        monitor = stage.teampulse("run", study, "--out", out, "--no-dashboard")
        stage.teampulse("simulate", study)
        harness.eventually(lambda: answers(port))
        monitor.wait_for(f"open ws://localhost:{port}")
        return monitor, out

    return start


def answers(port: int) -> bool:
    """Whether the sink listens; anything but a viewer is told what to do."""
    try:
        urllib.request.urlopen(f"http://127.0.0.1:{port}/")
    except urllib.error.HTTPError as refused:
        return refused.code == 426 and b"Foxglove WebSocket" in refused.read()
    except OSError:
        return False
    return False


def heard(stage, port: int, count: int, marker: str, *topics: str) -> list[dict]:
    """What Foxglove's client prints until it has this many messages."""
    viewer = stage.start("node", CLIENT, f"ws://127.0.0.1:{port}", count, marker, *topics)
    assert viewer.ended() == 0, viewer.report()
    return [json.loads(line) for line in viewer.stdout.splitlines()]


def test_foxglove_s_client_decodes_an_ecg_and_sets_a_marker(stage, viewed):
    monitor, out = viewed('["mark"]')
    viewer = lambda marker, count, *topics: heard(stage, 8765, count, marker, *topics)
    # The person's streams are there once the simulation was found.
    harness.eventually(lambda: any(line.get("channel") == ECG for line in viewer("", 1, "/teampulse/status")))
    lines = viewer("robot lost", 60, ECG, f"{ECG}/ecg", "/robot1/battery_state", "/session/events")
    channels = {line["channel"]: line for line in lines if "channel" in line}
    assert channels[ECG]["schemaName"] == "teampulse_msgs/msg/Wave"
    assert channels["/robot1/battery_state"]["schemaName"] == "sensor_msgs/msg/BatteryState"
    assert {(each["encoding"], each["schemaEncoding"]) for each in channels.values()} == {("cdr", "ros2msg")}
    messages = lambda topic: [line["message"] for line in lines if line.get("topic") == topic]
    waves = messages(ECG)
    samples = [sample for wave in waves for sample in wave["samples"]]
    assert waves and len(samples) > 100 and max(samples) - min(samples) > 0.3, (len(samples), waves[:1])
    numbers = [line for line in lines if line.get("topic") == f"{ECG}/ecg"]
    times = [int(line["timestamp"]) if isinstance(line["timestamp"], str) else line["timestamp"] for line in numbers]
    assert len(numbers) > 5 and times == sorted(times)
    assert all(min(samples) - 1 <= line["message"]["data"] <= max(samples) + 1 for line in numbers)
    assert not [line for line in lines if "error" in line or line.get("level") == 2], lines
    assert monitor.interrupt() == 0
    marks = [each.content for each in bags.messages(harness.the_bag(out), "/session/events") if each.content.kind == "marker"]
    assert [mark.label for mark in marks] == ["robot lost"]


def test_what_the_study_does_not_allow_is_refused_with_the_setting(stage, viewed):
    viewed("[]", port=8766)
    lines = harness.eventually(lambda: heard(stage, 8766, 1, "robot lost", "/teampulse/status"))
    refused = [line["status"] for line in lines if line.get("level") == 2]
    assert refused and "add `mark` to `foxglove` below [commands]" in refused[0], lines
