"""A disk that stands still, or refuses: said wherever one looks, and nothing is lost that is not counted."""

import errno
import json
import re
import signal
import time
from pathlib import Path

import bags
import disks
import harness
import pytest

# It begins in the first bag of a recording and goes on in all that follow.
PHASE = '[[phases]]\nname = "task"\nfrom_secs = 0\nto_secs = 3600\n'
# Longer than any flush of a disk that saves power.
STANDS_STILL_SECS = 12


@pytest.fixture(scope="session")
def trouble(tmp_path_factory):
    return disks.built(tmp_path_factory.mktemp("trouble"))


@pytest.fixture
def disk(stage, trouble):
    """A disk that can be given trouble."""
    return disks.Disk(trouble, stage.folder / "disk", stage.folder / "flags")


def recording(stage, disk, *publish):
    """A recorder onto that disk, and who publishes."""
    recorder, out = stage.record("/bench*", settings=PHASE, out=disk.below, env=disk.env)
    publisher = stage.cyclone("publish", "/bench", *publish)
    publisher.answer("begun")
    recorder.wait_for("/bench")
    return recorder, publisher


def faults(bag: Path) -> str:
    """What is said of faults in a bag's own events."""
    events = bags.messages(bag, "/session/events")
    return "\n".join(each.content.label for each in events if each.content.kind == "fault")


def test_a_disk_that_stands_still_for_a_while_loses_nothing_and_is_said(stage, disk):
    recorder, _ = recording(stage, disk, "--size", 1024, "--rate", 200)
    disk.stall()
    began = time.monotonic()
    recorder.wait_for("bag: stalled; .* waiting in memory")
    # The disk is what is slow here.
    time.sleep(max(0, STANDS_STILL_SECS - (time.monotonic() - began)))
    disk.work()
    recorder.wait_for("bag: no longer stalled; nothing was lost")
    assert recorder.interrupt() == 0, recorder.report()

    bag = harness.the_bag(disk.below)
    tally = bags.tallies(bag)["/bench"].summary()
    assert (tally["first"], tally["missing"], tally["corrupt"]) == (0, 0, 0)
    assert "bag: stalled" in faults(bag)
    assert "bag: stalled" in (bag / "summary.md").read_text()


def test_a_disk_that_stands_still_for_too_long_is_counted_and_the_recording_goes_on(stage, disk):
    """What waits for it is bounded: 256 MiB."""
    recorder, _ = recording(stage, disk, "--size", 200_000, "--rate", 300)
    disk.stall()
    recorder.wait_for("bag: failed to keep up", within_secs=60)
    disk.work()
    went_on(stage, disk, recorder)
    assert "The bag ended before the session did" in (first(disk) / "summary.md").read_text()
    assert "failed to keep up" in faults(first(disk))
    assert "keep up" in stage.ask("info", first(disk)).stdout


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EIO])
def test_a_disk_that_refuses_for_a_while_is_counted_and_the_recording_goes_on(stage, disk, error):
    recorder, _ = recording(stage, disk, "--size", 1024, "--rate", 200)
    disk.refuse(error)
    recorder.wait_for("bag: failed to .*(full|error)")
    disk.work()
    went_on(stage, disk, recorder)
    # A disk that refuses all has not taken the end of the bag either.
    assert f"`teampulse recover {first(disk)}` repairs it" in recorder.stderr, recorder.report()


def test_a_second_ctrl_c_does_not_wait_for_a_disk_that_stands_still(stage, disk):
    recorder, _ = recording(stage, disk, "--size", 1024, "--rate", 200)
    disk.stall()
    recorder.wait_for("bag: stalled")
    recorder.signal(signal.SIGINT)
    # Two at once would be one.
    time.sleep(0.5)
    recorder.signal(signal.SIGINT)
    assert recorder.ended() == 3, recorder.report()
    assert "still writing, and was abandoned" in recorder.stderr, recorder.report()
    disk.work()

    bag = harness.the_bag(disk.below)
    assert stage.ask("recover", bag).returncode == 0
    tally = bags.tallies(bag)["/bench"].summary()
    assert (tally["first"], tally["missing"], tally["corrupt"]) == (0, 0, 0)
    assert "cut off" in (bag / "summary.md").read_text()


def first(disk) -> Path:
    """The bag with which a recording began: its name has no number behind it."""
    return min((path.parent for path in disk.below.glob("*/metadata.yaml")), key=lambda bag: bag.name)


def went_on(stage, disk, recorder) -> None:
    """A recording has gone on in a second bag; what is in neither is counted."""
    recorder.wait_for(r"recording continues in .*; \d+ messages are in no bag")
    [second] = disk.below.glob("*_2")
    harness.eventually(lambda: grows(second))
    assert recorder.interrupt() == 3, recorder.report()
    assert "error: bag: failed to" in recorder.stderr
    said = re.search(r"(\d+) messages are in no bag", recorder.stderr)
    labels = faults(second)
    assert "recording continues in" in labels and f"{said[1]} messages are in no bag" in labels
    assert "recording continues in" in (second / "summary.md").read_text()

    stage.ask("recover", first(disk))
    [begun], [going_on] = (phases(bag) for bag in (first(disk), second))
    assert begun.content.label == going_on.content.label == "task"
    assert going_on.log_secs > begun.log_secs
    ends = [each.log_secs + each.content.duration_secs for each in (begun, going_on)]
    assert ends[1] == pytest.approx(ends[0], abs=0.1)
    assert stage.ask("replay", second, "--out", stage.folder / "again").returncode == 0
    assert [each.content.label for each in phases(harness.the_bag(stage.folder / "again"))] == ["task"]

    before, after = (bags.tallies(bag)["/bench"].summary() for bag in (first(disk), second))
    assert (before["first"], before["corrupt"], after["corrupt"]) == (0, 0, 0)
    between = after["first"] - before["last"] - 1
    assert between >= 0, "nothing is in both"
    missing = between + before["missing"] + after["missing"]
    counted = int(said[1]) + lost(stage, second)
    assert missing <= counted, f"{missing} are in no bag, {counted} are said to be"


def phases(bag: Path) -> list:
    return [each for each in bags.messages(bag, "/session/events") if each.content.kind == "phase"]


def grows(bag: Path) -> bool:
    files = list(bag.glob("*.mcap"))
    return bool(files) and files[-1].stat().st_size > 10_000


def lost(stage, bag: Path) -> int:
    """What was lost of the topic in front of the recording, as the bag says."""
    streams = json.loads(stage.ask("info", bag, "--json").stdout)["streams"]
    return next(stream["lost"] for stream in streams if stream["name"] == "/bench")
