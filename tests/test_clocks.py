"""Other computers' clocks: stamps that are off are recognised, and by how much is known."""

import os
import signal
import struct
import sys
import time
from pathlib import Path

import bags
import harness

CLOCK_PEER = [sys.executable, harness.TESTS / "peers/clock_peer.py"]

TEAM = """
[session]
name = "team"
[[sources]]
type = "robots"
namespace = "/robot*"
[[sinks]]
type = "bag"
[simulate]
robots = 2
"""

OFFSET_SECS, SKEW_PPM = 1.5, 40
TWO_WAY, REMOTE = 2, 4
PERSON = "/humans/persons/p001"


def off(stage, study: Path) -> float:
    """Simulates a team whose clock is off; gives the time at which it began."""
    began_secs = time.time()
    clock = ("--clock-offset", OFFSET_SECS, "--clock-skew-ppm", SKEW_PPM)
    stage.teampulse("simulate", study, *clock).wait_for("simulating")
    return began_secs


def last_statuses(bag: Path, topics: str) -> dict[str, bags.Message]:
    """The last status of each stream."""
    statuses = bags.messages(bag, "/teampulse/status")
    return {each.content.name: each for each in statuses if each.content.name.startswith(topics)}


def test_probes_find_a_robots_offset_to_two_milliseconds(stage, figure):
    study, out = stage.study(TEAM), stage.folder / "sessions"
    began_secs = off(stage, study)
    monitor = stage.teampulse("run", study, "--duration", 20, "--out", out)
    assert monitor.ended(within_secs=60) in (0, 3), monitor.report()
    statuses = last_statuses(harness.the_bag(out), "/robot")
    assert len(statuses) >= 6
    worst_ms = 0.0
    for status in statuses.values():
        ran_secs = status.log_secs - began_secs
        truth_secs = OFFSET_SECS + ran_secs * SKEW_PPM * 1e-6
        assert status.content.clock == TWO_WAY, status
        assert "off" in status.content.reason, status
        worst_ms = max(worst_ms, abs(status.content.offset_secs - truth_secs) * 1e3)
    figure(f"offset of a simulated team by probes: wrong by {worst_ms:.3f} ms (bar 2)")
    assert worst_ms < 2


PERSON_AND_ROBOT = """
[session]
name = "two_laptops"
[[sources]]
type = "people"
[[sources]]
type = "robots"
namespace = "/robot*"
[[sinks]]
type = "bag"
tidy = false
[simulate]
robots = 1
"""


def test_a_person_on_a_laptop_that_is_off_is_aligned_with_a_robot(stage, figure):
    """Two computers: a person's is 0.6 s and 40 ppm fast, and a robot's is in step."""
    offset_secs, ecg = 0.6, "/humans/persons/p001/simulated/ecg"
    person = stage.study(PERSON_AND_ROBOT + 'people = 1\nprefix = "other"\n', "person.toml")
    robot = stage.study(PERSON_AND_ROBOT, "robot.toml")
    out = stage.folder / "sessions"
    began_secs = time.time()
    clock = ("--clock-offset", offset_secs, "--clock-skew-ppm", SKEW_PPM)
    stage.teampulse("simulate", person, *clock).wait_for("simulating")
    stage.teampulse("simulate", robot).wait_for("simulating")
    checked = stage.teampulse("check", robot, "--out", stage.folder, "--seconds", 6)
    monitor = stage.teampulse("run", robot, "--duration", 11, "--out", out)
    assert monitor.ended(within_secs=60) in (0, 3), monitor.report()
    bag = harness.the_bag(out)

    waves = bags.messages(bag, ecg)
    sent_secs = bags.sent_secs(bag, ecg)
    assert len(waves) == len(sent_secs) > 20
    worst_secs = 0.0
    for wave, stamp_secs in list(zip(waves, sent_secs))[len(waves) // 2 :]:
        truth_secs = stamp_secs - offset_secs - (wave.log_secs - began_secs) * SKEW_PPM * 1e-6
        header = wave.content.header.stamp
        placed_secs = header.sec + header.nanosec * 1e-9
        worst_secs = max(worst_secs, abs(placed_secs - truth_secs))
    statuses = last_statuses(bag, "/")
    odometry = statuses["/robot1/odom"].content
    assert odometry.clock == TWO_WAY and abs(odometry.offset_secs) < 0.002, odometry
    of_person = statuses[ecg].content
    assert of_person.clock == TWO_WAY and abs(of_person.offset_secs - offset_secs) < 0.002
    # What is in step keeps its stamps, so it is as far from the truth as its clock is said to be.
    apart_ms = (worst_secs + abs(odometry.offset_secs)) * 1e3
    figure(f"a person's ECG and a robot's odometry, 0.6 s apart: {apart_ms:.2f} ms (bar 5)")
    assert apart_ms < 5

    assert checked.ended() == 0, checked.report()
    clocks = [line for line in checked.stdout.splitlines() if line.startswith("clock ")]
    assert len(clocks) == 3 and not any("NaN" in line for line in clocks), clocks
    assert [line for line in clocks if line.split()[1] == "off" and "+600." in line], clocks


def test_stamps_alone_find_an_offset_to_twenty_milliseconds(stage, figure):
    recorder, out = stage.record("/r9/*")
    peer = stage.cyclone("send", "/r9/position", "--type", "geometry_msgs/msg/PointStamped")
    peer.answer("matched")
    for _ in range(400):
        peer.say(point_stamped(time.time() + OFFSET_SECS).hex())
        time.sleep(0.02)
    assert recorder.interrupt() in (0, 3), recorder.report()
    [status] = last_statuses(harness.the_bag(out), "/r9").values()
    wrong_ms = abs(status.content.offset_secs - OFFSET_SECS) * 1e3
    figure(f"offset of a peer by its stamps: wrong by {wrong_ms:.3f} ms (bar 20)")
    assert status.content.clock == REMOTE
    assert "off" in status.content.reason
    assert wrong_ms < 20


def test_samples_that_arrive_after_a_standstill_keep_their_times(stage, figure):
    people = '[[sources]]\ntype = "people"\nnamespace = "/humans/persons/*"\n[simulate]\npeople = 1\n'
    study, out = stage.study(TEAM.replace("[simulate]\n", people)), stage.folder / "sessions"
    stage.teampulse("simulate", study).wait_for("simulating")
    monitor = stage.teampulse("run", study, "--duration", 32, "--out", out)
    harness.eventually(lambda: out.exists() and list(out.glob("*/*.mcap")))
    time.sleep(10)
    # For longer than DDS waits for a participant that is silent.
    os.kill(monitor.pid, signal.SIGSTOP)
    time.sleep(13)
    os.kill(monitor.pid, signal.SIGCONT)
    assert monitor.ended(within_secs=60) in (0, 3), monitor.report()
    bag, late, worst_secs = harness.the_bag(out), 0, 0.0
    for topic in (f"{PERSON}/simulated/ecg", f"{PERSON}/simulated/emg", "/robot1/odom", "/robot2/odom"):
        stamps = [stamp_secs(each.content.header) for each in bags.messages(bag, topic)]
        sent = bags.sent_secs(bag, topic)
        late += sum(log_secs - stamp > 1 for log_secs, stamp in zip(logged_secs(bag, topic), stamps, strict=True))
        worst_secs = max(worst_secs, *(abs(stamp - each) for stamp, each in zip(stamps, sent, strict=True)))
    figure(f"{late} samples after a standstill of 13 s: at most {1e3 * worst_secs:.1f} ms off (bar 50)")
    assert late and worst_secs < 0.05


def stamp_secs(header) -> float:
    return header.stamp.sec + header.stamp.nanosec * 1e-9


def logged_secs(bag: Path, topic: str) -> list[float]:
    return [each.log_secs for each in bags.messages(bag, topic)]


def test_any_node_may_ask_a_computer_for_its_clock(stage, figure):
    off(stage, stage.study(TEAM))
    client = stage.start(*CLOCK_PEER, "--domain", stage.domain, "/teampulse_simulator/probe_clock")
    answer = client.answer("offset_secs")
    wrong_ms = abs(answer["offset_secs"] - OFFSET_SECS) * 1e3
    figure(f"offset as an independent client reckons it: wrong by {wrong_ms:.3f} ms (bar 2)")
    assert wrong_ms < 2 + answer["round_trip_secs"] * 500


def test_check_prints_the_offset_of_each_computer_and_of_this_one(stage):
    study = stage.study(TEAM)
    off(stage, study)
    answer = stage.ask("check", study, "--out", stage.folder)
    clocks = [line for line in answer.stdout.splitlines() if line.startswith("clock ")]
    [ours, theirs] = clocks
    assert ours.split()[1] in ("ok", "free", "?"), ours
    assert theirs.split()[1] == "off" and "by probes" in theirs, theirs
    assert "+1.50" in theirs, theirs


def test_a_clock_is_not_off_in_simulated_time(stage):
    study = stage.study(TEAM + "speed = 2.0\n")
    answer = stage.ask("simulate", study, "--clock-offset", 1.5)
    assert answer.returncode == 2
    assert "simulated time" in answer.stderr


def point_stamped(stamp_secs: float) -> bytes:
    """A `geometry_msgs/msg/PointStamped`."""
    secs = int(stamp_secs)
    nanos = int((stamp_secs - secs) * 1e9)
    header = struct.pack("<iII4x", secs, nanos, 1)
    return b"\0\1\0\0" + header + struct.pack("<ddd", 1.0, 2.0, 3.0)
