"""What a bag still holds after the worst moments."""

import json
import os
import random
import shutil
import subprocess
import time

import pytest

import bags
import harness
import payload

# `make bench-crash` asks for twenty.
CRASHES = int(os.environ.get("CRASHES", "4"))
RATE_HZ = 500


@pytest.mark.parametrize("seed", range(CRASHES))
def test_a_killed_recorder_leaves_all_that_is_older_than_a_second(stage, figure, seed):
    recorder, out = stage.record("/bench*")
    publisher = stage.cyclone("publish", "/bench", "--size", 1024, "--rate", RATE_HZ)
    publisher.answer("matched")
    time.sleep(random.Random(seed).uniform(2.5, 6))  # the moment of the crash
    killed_ns = time.monotonic_ns()
    recorder.kill()

    bag = harness.the_bag(out)
    opened(stage, bag)
    kept = mended(stage, bag)
    assert [number for number, _ in kept] == list(range(len(kept)))
    _, newest_written_ns = kept[-1]
    newest_age_secs = (killed_ns - newest_written_ns) / 1e9
    figure(f"kill -9: {len(kept)} messages kept, the last {newest_age_secs:.3f} s are lost (bar 1)")
    assert newest_age_secs < 1 + 2 / RATE_HZ


def test_a_bag_cut_anywhere_opens(stage):
    recorder, out = stage.record("/bench*")
    publisher = stage.cyclone("publish", "/bench", "--size", 1024, "--rate", 500, "--count", 2000)
    publisher.answer("sent")
    recorder.kill()
    bag = harness.the_bag(out)
    [part] = bags.parts(bag)
    size = part.stat().st_size
    for cut in sorted(random.Random(1).sample(range(64, size), 12)):
        copy = stage.folder / f"cut_{cut}" / bag.name
        shutil.copytree(bag, copy)
        os.truncate(copy / part.name, cut)
        opened(stage, copy)
        numbers = [number for number, _ in mended(stage, copy)]
        assert numbers == list(range(len(numbers)))


def test_a_full_disk_ends_the_recording_and_not_the_monitoring(stage):
    if os.environ.get("TEST_ISOLATED") != "yes":
        pytest.skip("no mount table of our own: a small disk can't be had")
    disk = stage.folder / "disk"
    disk.mkdir()
    # 64 MiB are kept free for others, so that it begins with room for 20.
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=124m", "none", disk], check=True)
    other = disk / "other"
    other.write_bytes(bytes(40 << 20))

    recorder, out = stage.record("/bench*", settings='compression = "none"', out=disk)
    publisher = stage.cyclone("publish", "/bench", "--size", 4096, "--rate", 2000)
    publisher.answer("matched")
    recorder.wait_for(r"(?i)disk|space|room", within_secs=60)
    status = ("/teampulse/status", "--type", "teampulse_msgs/msg/StreamStatus")
    watcher = stage.cyclone("subscribe", *status, "--count", 3, "--seconds", 15)
    assert watcher.answer("messages")["messages"] >= 3, "the monitoring has ended, too"
    assert recorder.is_running()
    recorder.wait_for("once 72 MiB are free")
    other.unlink()
    recorder.wait_for("recording continues in")
    [second] = harness.eventually(lambda: list(out.glob("*_2")))
    harness.eventually(lambda: any(part.stat().st_size > 100_000 for part in bags.parts(second)))
    assert recorder.interrupt() == 3
    assert "error:" in recorder.stderr
    assert bags.decoded_by_rosbags(second).total() > 0

    bag = second.with_name(second.name.removesuffix("_2"))
    assert bags.decoded_by_rosbags(bag).total() > 1000
    assert recorder.stderr.count("error:") == 1, "one message for the bag and what stands beside it"
    assert "The bag ended before the session did" in (bag / "summary.md").read_text()
    tally = bags.tallies(bag)["/bench"].summary()
    assert (tally["first"], tally["missing"], tally["corrupt"]) == (0, 0, 0)


def opened(stage, bag) -> None:
    """Opens a damaged bag as a user would: without a word of how."""
    answer = stage.ask("info", bag, "--json")
    assert answer.returncode == 0, answer.stderr
    json.loads(answer.stdout)


def mended(stage, bag) -> list[tuple[int, int]]:
    """Number and time of writing of every message, as others read them from the mended bag."""
    answer = stage.ask("recover", bag)
    assert answer.returncode == 0, answer.stderr
    bags.decoded_by_rosbags(bag)
    found = [payload.read(payload.content(cdr)) for _, cdr in bags.raw(bag).get("/bench", [])]
    assert None not in found, "a message is not as it was written"
    return found
