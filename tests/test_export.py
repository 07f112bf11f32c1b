"""Tables of a bag: what is asked for, each sample a row, events as rows."""

import csv
import json

import pytest

import bags

ECG = "/humans/persons/p001/polar_h10/ecg"


def head_and_rows(path):
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    return head, rows


def one_table(stage, bag, *arguments):
    out = stage.folder / f"table_{len(list(stage.folder.iterdir()))}"
    answer = stage.ask("export", bag, "--out", out, *arguments)
    assert answer.returncode == 0, answer.stderr
    return head_and_rows(out / "aligned.csv")


def test_a_wave_has_a_row_for_each_sample_and_extract_reads_it(demo_bag, stage):
    answer = stage.ask("export", demo_bag, "--out", stage.folder / "tables")
    assert answer.returncode == 0, answer.stderr
    path = stage.folder / "tables" / (ECG.strip("/").replace("/", "__") + ".csv")
    head, rows = head_and_rows(path)
    assert head[:3] == ["measured_secs", "log_time_secs", "index"]
    waves = bags.messages(demo_bag, ECG)
    assert len(rows) == sum(len(each.content.samples) for each in waves)
    times = [float(row[0]) for row in rows]
    assert all(0.005 < later - earlier < 0.02 for earlier, later in zip(times, times[1:]))
    of = ("--signal", "ecg", "--time", "measured_secs", "--column", head[3], "--json")
    answer = stage.ask("extract", path, *of)
    assert answer.returncode == 0, answer.stderr
    found = json.loads(answer.stdout)["events"]
    lasted_secs = times[-1] - times[0]
    assert len(found) == pytest.approx(1.15 * lasted_secs, rel=0.3)


def test_a_grid_has_what_was_recorded_unless_more_is_asked_for(demo_bag, stage):
    head, rows = one_table(stage, demo_bag, "--grid", 1)
    assert rows and any(each.startswith(f"{ECG}:") for each in head)
    assert not [each for each in head if "/heart/" in each or "/statistics/" in each]
    assert len(head) < 600
    asked = f"{ECG}/heart/w30"
    head, _ = one_table(stage, demo_bag, "--grid", 1, "--stream", asked)
    assert all(each.startswith(f"{asked}:") for each in head[1:])


def test_each_event_can_be_a_row(demo_bag, stage):
    only = ("--stream", "/robot1/odom")
    head, rows = one_table(stage, demo_bag, "--pivot", f"{ECG}/beats", *only)
    beats = bags.messages(demo_bag, f"{ECG}/beats")
    assert len(rows) == len(beats)
    named = [f"{ECG}/beats:{word}" for word in ("kind", "label", "value", "duration_secs")]
    assert head[: 1 + len(named)] == ["unix_secs", *named]
    assert {row[1] for row in rows} == {"beat"}
    stamps = [each.content.header.stamp for each in beats]
    expected = sorted(stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps)
    assert [float(row[0]) for row in rows] == pytest.approx(expected, abs=1e-6)
    assert sum(bool(row[head.index("/robot1/odom:age_secs")]) for row in rows) > len(rows) / 2
