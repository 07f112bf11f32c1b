"""teampulse reads straps through Linux' own Bluetooth stack and BlueZ, in a virtual machine: what is not ours is
everything from D-Bus down to the straps."""

import json
import os
import subprocess
from pathlib import Path

import bags
import harness
import pytest
from heart import FRAME_SAMPLES, H10, OTHER, ecg_uv

HERE = Path(__file__).parent
KERNEL = harness.ROOT / "target/vm/kernel"
BOOT_SECS = 600
TOPICS = {"h10": "/humans/persons/p001/polar_h10", "other": "/humans/persons/p002/heart_rate_strap"}


class Results:
    """What a session in the virtual machine left."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.straps = json.loads((folder / "straps.json").read_text())
        self.bag = harness.the_bag(folder / "sessions")

    def text(self, name: str) -> str:
        return (self.folder / name).read_text()


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    command = [HERE / "boot", KERNEL, folder, HERE / "bluetooth"]
    env = {**os.environ, "TEAMPULSE": str(harness.TEAMPULSE)}
    ran = subprocess.run(
        list(map(str, command)), env=env, capture_output=True, text=True, timeout=BOOT_SECS
    )
    logs = "\n".join(f"--- {each.name}\n{each.read_text()}" for each in sorted(folder.glob("*.*")))
    assert (folder / "sessions").is_dir(), ran.stdout + ran.stderr + logs
    print(logs)
    return Results(folder)


def test_scan_lists_the_straps_with_the_lines_to_paste(results):
    listed = results.text("scan.txt")
    assert "Polar H10 1A000001" in listed and "Strap 7" in listed
    assert f'type    = "polar"\nperson  = "p001"\naddress = "{H10}"' in listed
    assert f'type    = "heart_rate"\nperson  = "p002"\naddress = "{OTHER}"' in listed


def test_the_session_ends_well_and_leaves_no_strap_connected_or_measuring(results):
    assert results.text("run.code").strip() == "0", results.text("run.err")
    assert results.text("connected_afterwards.txt") == ""
    assert results.straps["h10"]["commands"][-1] == "0300"  # stop, ECG


def test_every_sample_of_the_ecg_is_exact_and_a_lost_link_costs_no_frame_that_was_sent(results):
    recorded = bags.messages(results.bag, f"{TOPICS['h10']}/ecg")
    got = [message.content.samples.view("<f8").tolist() for message in recorded]
    sent = [first for _, first in results.straps["h10"]["frames"]]
    expected = [[ecg_uv(n) for n in range(first, first + FRAME_SAMPLES)] for first in sent]
    print(f"{len(got)} of {len(sent)} frames")
    # The last ones may have been sent while it was asked to stop.
    assert len(got) >= len(sent) - 2 and got == expected[: len(got)]


@pytest.mark.parametrize("strap", TOPICS)
def test_every_interval_arrives_once_and_in_order(results, strap):
    recorded = bags.messages(results.bag, f"{TOPICS[strap]}/rr_interval")
    got = [round(value) for message in recorded for value in message.content.values]
    sent = [steps for _, found in results.straps[strap]["intervals"] for steps in found]
    print(f"{len(got)} of {len(sent)} intervals")
    rest = iter(sent)
    assert all(steps in rest for steps in got), (sent, got)
    # Those of the seconds between connecting and subscribing, and of the end, are nobody's.
    assert len(got) >= len(sent) - 12


def test_a_lost_link_is_back_within_30_seconds(results):
    log = results.straps["h10"]
    gaps_secs = [b - a for (a, _), (b, _) in zip(log["frames"], log["frames"][1:])]
    print(f"back after {max(gaps_secs):.1f} s")
    assert len(log["connected_secs"]) == 2 and max(gaps_secs) < 30
