"""Features of any table of samples: `teampulse extract`."""

import json
import math
import random
import subprocess

import pytest

import harness

BEAT_SECS = [0.4 + 0.8 * k + 0.03 * math.sin(k) for k in range(150)]
RATE_HZ = 130
# Intervals between heartbeats [ms].
BEATS_MS = [round(800 + 40 * math.sin(k / 3) + 25 * math.sin(k / 7.3), 3) for k in range(140)]


def ecg(rate_hz=RATE_HZ, secs=120, noise=0.02) -> list[float]:
    """Narrow bumps at the beats and broad ones after them [mV]."""
    chance, samples = random.Random(1), [0.0] * int(secs * rate_hz)
    for beat in BEAT_SECS:
        for at, height, width in ((beat, 1.0, 0.01), (beat + 0.28, 0.2, 0.04)):
            begin, end = int((at - 0.2) * rate_hz), int((at + 0.2) * rate_hz)
            for k in range(max(begin, 0), min(end, len(samples))):
                samples[k] += height * math.exp(-(((k / rate_hz - at) / width) ** 2) / 2)
    return [each + chance.gauss(0, noise) for each in samples]


def table(path, rows, head=None):
    lines = [] if head is None else [head]
    path.write_text("\n".join(lines + [str(row) for row in rows]) + "\n")
    return path


def extract(stage, *arguments) -> dict:
    """What was printed as JSON."""
    done = stage.ask("extract", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def recording(stage):
    return table(stage.folder / "ecg.csv", [f"{each:.4f}" for each in ecg()], "ecg_mv")


@pytest.mark.parametrize("method", ["whole", "causal"])
def test_an_even_table_whose_clock_was_set_back_is_refused(stage, method):
    secs = [k / 100 - (20 if k >= 3000 else 0) for k in range(6000)]
    rows = [f"{at:.2f},{math.sin(at):.4f}" for at in secs]
    path = table(stage.folder / "eda.csv", rows, "time_s,eda_us")
    done = stage.ask("extract", path, "--signal", "eda", "--method", method, "--json")
    assert done.returncode != 0 and "line 3002 is 20.0 s before an earlier line" in done.stderr, done.stderr


@pytest.mark.parametrize("method", ["whole", "causal"])
def test_beats_are_found_where_they_are(stage, recording, method):
    truth = [round(beat * RATE_HZ) for beat in BEAT_SECS]
    truth = table(stage.folder / "truth.csv", [f"{sample},N" for sample in truth], "sample,symbol")
    arguments = ("--signal", "ecg", "--rate", RATE_HZ, "--method", method, "--truth", truth)
    extracted = extract(stage, recording, *arguments)
    assert (extracted["signal"], extracted["rate_hz"], extracted["method"]) == ("ecg", RATE_HZ, method)
    assert [score["tolerance_ms"] for score in extracted["score"]] == [150, 50]
    # A causal analysis reports a beat some time after it: the last may be missing.
    for score in extracted["score"]:
        assert score["tp"] >= 148 and score["fp"] == 0 and score["f1"] > 0.99
    beats = [event for event in extracted["events"] if event["kind"] == "beat"]
    assert all(abs(beat["sample"] / RATE_HZ - beat["time_secs"]) < 1e-6 for beat in beats)
    offsets = [beat["time_secs"] - true for beat, true in zip(beats, BEAT_SECS)]
    assert max(map(abs, offsets)) < 0.008


def test_a_table_of_events_has_its_header_also_without_events(stage):
    path = table(stage.folder / "flat.csv", ["5"] * 400, "eda_us")
    done = stage.ask("extract", path, "--signal", "eda", "--rate", 4, "--events")
    assert (done.returncode, done.stdout) == (0, "kind,sample,time_secs"), done
    path = table(stage.folder / "warm.csv", ["33.0"] * 400, "temp_c")
    done = stage.ask("extract", path, "--signal", "temperature", "--rate", 4, "--events")
    assert done.returncode == 2 and "temperature has no events" in done.stderr, done


def test_artefacts_that_are_kept_are_noted(stage):
    missed = BEATS_MS[:70] + [BEATS_MS[70] + BEATS_MS[71]] + BEATS_MS[72:]
    path = table(stage.folder / "missed.csv", missed, "rr_ms")
    for options, are_noted in (((), True), (("--artefacts", "kept"), False), (("--artefacts", "corrected"), False)):
        notes = extract(stage, path, "--signal", "interval", *options)["notes"]
        assert any("give --artefacts corrected to correct them" in note for note in notes) == are_noted, (options, notes)
    path = table(stage.folder / "whole.csv", BEATS_MS, "rr_ms")
    assert not any("--artefacts" in note for note in extract(stage, path, "--signal", "interval")["notes"])


@pytest.mark.parametrize("method", ["whole", "causal"])
def test_every_window_has_each_value_or_why_there_is_none(stage, recording, method):
    arguments = ("--signal", "ecg", "--rate", RATE_HZ, "--window", 30, "--method", method)
    extracted = extract(stage, recording, *arguments)
    windows = sorted({(row["start_secs"], row["end_secs"]) for row in extracted["features"]})
    assert windows == [(0, 30), (30, 60), (60, 90), (90, 120)]
    for row in extracted["features"]:
        assert (row["value"] is None) == (row["reason"] is not None), row
        assert row["unit"] and row["method"], row
        assert 0 <= row["coverage"] <= 1 and 0 <= row["quality"] <= 1
    rows = {row["name"]: row for row in extracted["features"] if row["start_secs"] == 60}
    assert abs(rows["ECG_Rate_Mean"]["value"] - 75) < 0.5
    assert 5 < rows["HRV_RMSSD"]["value"] < 40
    assert rows["HRV_LF"]["reason"] == "window too short"


def test_people_read_a_table_and_how_it_was_computed(stage, recording):
    done = stage.ask("extract", recording, "--signal", "ecg", "--rate", RATE_HZ)
    assert done.returncode == 0, done.stderr
    assert "0 to 120 s" in done.stdout and "150 beats" in done.stdout
    assert "HRV_RMSSD" in done.stdout and "how, whole:" in done.stdout
    events = stage.ask("extract", recording, "--signal", "ecg", "--rate", RATE_HZ, "--events")
    head, *rows = events.stdout.splitlines()
    assert head.startswith("kind,sample,time_secs") and len(rows) == 150


def test_a_table_may_state_its_rate(stage):
    samples = [f"{each:.4f}" for each in ecg()]
    tables = {
        "comment.txt": ["# Simple Text Format", "# Sampling Rate (Hz):= 130.00", *samples],
        "times.csv": ["time_secs,ecg"] + [f"{k / RATE_HZ:.6f},{v}" for k, v in enumerate(samples)],
        "spaces.txt": [f"% Sample Rate = {RATE_HZ} Hz"] + [f"  {v}  " for v in samples],
    }
    for name, rows in tables.items():
        extracted = extract(stage, table(stage.folder / name, rows), "--signal", "ecg")
        assert extracted["rate_hz"] == RATE_HZ, name
        assert len(extracted["events"]) == 150, name


def test_a_file_of_an_e4_is_known(stage):
    path = table(stage.folder / "TEMP.csv", ["1551453301.00", "4.000000"] + ["33.21"] * 480)
    extracted = extract(stage, path, "--signal", "temperature")
    assert extracted["rate_hz"] == 4
    rows = {row["name"]: row["value"] for row in extracted["features"]}
    assert any(abs((value or 0) - 33.21) < 1e-6 for value in rows.values()), rows


def test_missing_rows_are_gaps_and_reported(stage):
    rows = [f"{k / RATE_HZ:.6f},{v:.4f}" for k, v in enumerate(ecg()) if not 30 < k / RATE_HZ < 40]
    path = table(stage.folder / "gap.csv", rows, "time_secs,ecg")
    done = stage.ask("extract", path, "--signal", "ecg", "--window", 20, "--json")
    assert "1299 rows are missing" in done.stderr
    extracted = json.loads(done.stdout)
    assert not [e for e in extracted["events"] if 30.2 < e["time_secs"] < 39.8]
    coverage = {row["start_secs"]: row["coverage"] for row in extracted["features"]}
    assert coverage[0] == 1 and abs(coverage[20] - 0.5) < 0.01 and coverage[40] == 1


def test_the_column_is_named_or_must_be(stage):
    path = table(stage.folder / "two.csv", [f"{v:.4f},{v:.4f}" for v in ecg()], "left,right")
    done = stage.ask("extract", path, "--signal", "ecg", "--rate", RATE_HZ)
    assert done.returncode == 2 and "left, right" in done.stderr and "--column" in done.stderr
    for column in ("right", "RIGHT", "2"):
        extracted = extract(stage, path, "--signal", "ecg", "--rate", RATE_HZ, "--column", column)
        assert len(extracted["events"]) == 150
    done = stage.ask("extract", path, "--signal", "ecg", "--rate", RATE_HZ, "--column", "middle")
    assert done.returncode == 2 and "middle" in done.stderr and "left, right" in done.stderr


def test_what_is_no_table_of_numbers_is_refused_with_a_hint(stage):
    cases = {
        "text.csv": ("ecg\nabc\ndef\n", 2, "text"),
        "later.csv": ("ecg\n1\n2\nabc\n3\n", 1, "line 4"),
        "empty.csv": ("", 1, "empty"),
        "names.csv": ("ecg,eda\n", 1, "has none"),
        "bytes.csv": ("\x00\x01\x02" * 100, 1, "not a text table"),
        "voice.wav": ("RIFF\x24\x00\x00\x00WAVEfmt ", 1, "a WAV file"),
    }
    for name, (text, code, words) in cases.items():
        path = stage.folder / name
        path.write_text(text)
        done = stage.ask("extract", path, "--signal", "ecg", "--rate", 130)
        assert done.returncode == code, (name, done)
        assert words in done.stderr and "hint:" in done.stderr, (name, done.stderr)
    done = stage.ask("extract", stage.folder / "none.csv", "--signal", "ecg", "--rate", 130)
    assert done.returncode == 1 and "none.csv" in done.stderr


SIGNALS = ["ecg", "ppg", "eda", "emg", "eeg", "respiration", "temperature", "acceleration", "interval", "other"]


@pytest.mark.parametrize("signal", SIGNALS)
@pytest.mark.parametrize("method", ["whole", "causal"])
def test_no_bad_signal_makes_a_panic_or_a_nonsense_number(stage, signal, method):
    chance = random.Random(2)
    columns = 3 if signal == "acceleration" else 1
    signals = {
        "flat": [1.0] * 3000,
        "saturated": [max(-0.1, min(0.1, v)) for v in ecg(100, 30)],
        "one": [1.0],
        "two": [1.0, 2.0],
        "missing": ["nan"] * 3000,
        "infinite": ["inf", "-inf"] * 1500,
        "huge": [chance.choice([1e300, -1e300, 0.0]) for _ in range(3000)],
        "noise": [chance.gauss(0, 1) for _ in range(3000)],
        "holes": [chance.choice(["nan", 1.0, 2.0]) for _ in range(3000)],
    }
    for name, samples in signals.items():
        path = table(stage.folder / f"{name}.csv", [",".join([str(v)] * columns) for v in samples])
        arguments = (path, "--signal", signal, "--rate", 100, "--method", method, "--window", 10)
        done = stage.ask("extract", *arguments, "--json")
        assert "panicked" not in done.stderr, (name, done.stderr)
        assert done.returncode in (0, 1, 2), (name, done.returncode, done.stderr)
        if done.returncode:
            assert done.stderr.startswith("error:"), (name, done.stderr)
            continue
        for row in json.loads(done.stdout)["features"]:
            assert (row["value"] is None) == (row["reason"] is not None), (name, row)
            assert row["value"] is None or math.isfinite(row["value"]), (name, row)


@pytest.mark.parametrize("rate_hz", ["0", "-1", "nan", "inf", "1e9", "abc", "0.001", "1000000"])
def test_an_absurd_rate_is_refused(stage, recording, rate_hz):
    done = stage.ask("extract", recording, "--signal", "ecg", "--rate", rate_hz)
    assert done.returncode == 2, done
    assert "rate" in done.stderr and "panicked" not in done.stderr


def test_intervals_give_their_variability(stage):
    chance = random.Random(3)
    intervals = [round(chance.gauss(800, 30)) for _ in range(400)]
    path = table(stage.folder / "rr.txt", intervals)
    extracted = extract(stage, path, "--signal", "interval")
    rows = {row["name"]: row["value"] for row in extracted["features"]}
    mean = sum(intervals) / len(intervals)
    assert abs(rows["HRV_MeanNN"] / mean - 1) < 0.01
    assert extracted["rate_hz"] is None


def test_samples_come_from_standard_input_too(stage, recording):
    done = subprocess.run(
        [harness.TEAMPULSE, "extract", "-", "--signal", "ecg", "--rate", str(RATE_HZ), "--json"],
        stdin=recording.open(),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["events"]) == 150


def test_a_wrong_time_is_named_and_costs_nothing(stage):
    rows = [f"{k / 10 if k != 500 else 1e9},{k % 7}" for k in range(1000)]
    path = table(stage.folder / "wild.csv", rows, "t,v")
    for method in ("causal", "whole"):
        arguments = ("--signal", "other", "--column", "v", "--time", "t", "--window", 10)
        done = stage.ask("extract", path, *arguments, "--method", method)
        assert done.returncode == 1 and "line 502" in done.stderr, done.stderr


@pytest.mark.parametrize("hop", [4, 7, 10, 25])
def test_causal_and_whole_windows_are_the_same_spans(stage, recording, hop):
    spans = []
    for method in ("causal", "whole"):
        arguments = ("--signal", "ecg", "--rate", RATE_HZ, "--window", 10, "--hop", hop)
        extracted = extract(stage, recording, *arguments, "--method", method)
        spans.append(sorted({(row["start_secs"], row["end_secs"]) for row in extracted["features"]}))
        quality = {row["start_secs"]: row["quality"] for row in extracted["features"]}
        assert min(quality.values()) > 0.5, quality
    assert spans[0] == spans[1]


def test_a_decimal_comma_in_the_only_column_is_one(stage):
    path = table(stage.folder / "comma.csv", [f"33,{40 + k % 30}" for k in range(200)], "Temp")
    extracted = extract(stage, path, "--signal", "temperature", "--rate", 4)
    rows = {row["name"]: row["value"] for row in extracted["features"]}
    assert 33.5 < rows["TEMP_Mean"] < 33.6


def test_intervals_of_an_e4_are_in_seconds_and_others_must_be_plausible(stage):
    rows = ["1551453301.000000, IBI"] + [f"{k * 0.8},{0.8 + k % 5 / 100:.2f}" for k in range(200)]
    extracted = extract(stage, table(stage.folder / "IBI.csv", rows), "--signal", "interval")
    rows = {row["name"]: row["value"] for row in extracted["features"]}
    assert abs(rows["HRV_MeanNN"] - 820) < 1
    path = table(stage.folder / "secs.txt", [0.8] * 100)
    done = stage.ask("extract", path, "--signal", "interval")
    assert done.returncode == 2 and "--scale 1000" in done.stderr


@pytest.mark.parametrize("method", ["whole", "causal"])
def test_intervals_lie_where_their_times_say(stage, method):
    """An E4 sends intervals only while the hand is still: gaps stay gaps, in every window."""
    rows = ["1551453301.000000, IBI"]
    for begin_secs in (10, 110):
        ends = [begin_secs + 0.8 * (k + 1) for k in range(75)]
        rows += [f"{end:.6f},0.800000" for end in ends]
    path = table(stage.folder / "gaps.csv", rows)
    extracted = extract(stage, path, "--signal", "interval", "--window", 60, "--method", method)
    beats = [event["time_secs"] - 1551453301 for event in extracted["events"]]
    assert len(beats) == 150 and abs(beats[0] - 10.8) < 1e-3 and abs(beats[75] - 110.8) < 1e-3
    coverage = {row["start_secs"] - 1551453301: row["coverage"] for row in extracted["features"]}
    expected = {0: 50 / 60, 60: 20 / 60, 120: 50 / 50}
    assert coverage.keys() == expected.keys()
    for begin, share in expected.items():
        assert abs(coverage[begin] - share) < 0.03, coverage


def spans(extracted) -> dict:
    return {row["name"]: row["value"] for row in extracted["features"]}


@pytest.mark.parametrize("method", ["whole", "causal"])
def test_a_single_lost_beat_is_a_gap_where_times_are_those_of_beats(stage, method):
    ends = [sum(BEATS_MS[: k + 1]) for k in range(len(BEATS_MS))]
    kept = [k for k in range(len(ends)) if k not in (40, 41, 90)]
    rows = [f"{ends[k] / 1e3:.6f},{BEATS_MS[k]:.3f}" for k in kept]
    path = table(stage.folder / "lost.csv", rows, "time_secs,rr_ms")
    extracted = extract(stage, path, "--signal", "interval", "--method", method)
    beats = [event["time_secs"] for event in extracted["events"]]
    assert beats == pytest.approx([ends[k] / 1e3 for k in kept], abs=1e-4)
    assert spans(extracted)["HRV_N"] == len(kept)
    assert extracted["features"][0]["coverage"] == pytest.approx(1 - sum(BEATS_MS[k] for k in (40, 41, 90)) / ends[-1], abs=1e-4)


@pytest.mark.parametrize("method", ["whole", "causal"])
@pytest.mark.parametrize("late_secs", [-0.4, 0.4])
def test_the_last_interval_counts_whatever_its_time(stage, method, late_secs):
    """A strap sends its intervals when it gets to it: their times are not those of the beats."""
    ends = [sum(BEATS_MS[: k + 1]) / 1e3 + (0, 0.3, late_secs)[k % 3] for k in range(len(BEATS_MS))]
    path = table(stage.folder / "strap.csv", [f"{e:.3f},{rr:.0f}" for e, rr in zip(ends, BEATS_MS)], "time_secs,rr_ms")
    extracted = extract(stage, path, "--signal", "interval", "--method", method)
    assert spans(extracted)["HRV_N"] == len(BEATS_MS)


def test_what_is_chosen_or_left_out_is_printed_for_machines_too(stage):
    rows = [f"{k / RATE_HZ:.6f},{v:.4f}" for k, v in enumerate(ecg())]
    rows.insert(1000, rows[999])
    rows[2000] = rows[2000].split(",")[0]
    path = table(stage.folder / "odd.csv", rows, "t,ecg")
    followed = stage.ask("extract", path, "--signal", "ecg", "--json")
    notes = json.loads(followed.stdout)["notes"]
    for words in ("column t", "fewer cells than the others, in line 2002", "in line 1002: skipped"):
        assert any(words in note for note in notes), (words, notes)
    assert all(f"note: {note}" in followed.stderr for note in notes)
    overruled = stage.ask("extract", path, "--signal", "ecg", "--rate", 100, "--json")
    assert any("--rate (100 Hz) is used, not the times in column t (130 Hz)" in n for n in json.loads(overruled.stdout)["notes"])
    assert "--rate (100 Hz) is used" in overruled.stderr


def test_samples_that_do_not_last_as_long_as_their_times_are_reported(stage):
    half = 60 * RATE_HZ
    times = [min(k, half) / RATE_HZ + max(k - half, 0) / RATE_HZ / 2 for k in range(len(ecg()))]
    path = table(stage.folder / "faster.csv", [f"{at:.6f},{v:.4f}" for at, v in zip(times, ecg())], "t,ecg")
    at_130_hz = ("--signal", "ecg", "--time", "t", "--rate", RATE_HZ)
    notes = extract(stage, path, *at_130_hz)["notes"]
    assert any("the samples last 120.0 s at 130 Hz, but 90.0 s by their times" in note for note in notes), notes
    assert extract(stage, path, *at_130_hz, "--method", "causal")["notes"] == []
    # Without a rate, the slower half lacks every second sample.
    by_times = extract(stage, path, "--signal", "ecg")
    assert by_times["rate_hz"] == 260 and any("rows are missing" in note for note in by_times["notes"]), by_times["notes"]


@pytest.mark.parametrize("rate_hz", [400, 512])
def test_times_in_whole_milliseconds_give_the_rate(stage, rate_hz):
    rows = [f"{k / rate_hz:.3f},{v:.4f}" for k, v in enumerate(ecg(rate_hz=rate_hz))]
    extracted = extract(stage, table(stage.folder / "ms.csv", rows, "time,ecg"), "--signal", "ecg")
    assert extracted["rate_hz"] == rate_hz
    assert not any("missing" in note for note in extracted["notes"]), extracted["notes"]
    beats = [event["time_secs"] for event in extracted["events"]]
    assert beats == pytest.approx(BEAT_SECS, abs=0.02)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_a_table_in_utf_16_is_read(stage, encoding):
    path = stage.folder / "wide.txt"
    path.write_text("time [s]\tskin temp [°C]\r\n" + "".join(f"{k / 4}\t33,4\r\n" for k in range(400)), encoding=encoding)
    extracted = extract(stage, path, "--signal", "temperature")
    assert extracted["rate_hz"] == 4 and spans(extracted)["TEMP_Mean"] == pytest.approx(33.4)


def test_units_are_converted_or_refused(stage):
    eda = [2.0 + 0.2 * math.sin(k / 40) for k in range(480)]
    tables = {
        "own": ("eda", eda, []),
        "in_name": ("eda [nS]", [1000 * each for each in eda], []),
        "resistance": ("gsr_kohm", [1000 / each for each in eda], []),
        "said": ("eda", [1000 / each for each in eda], ["--unit", "kohm"]),
        "scaled": ("eda [counts]", [100 * each for each in eda], ["--scale", 0.01]),
    }
    means = {}
    for name, (head, rows, options) in tables.items():
        path = table(stage.folder / f"{name}.csv", rows, head)
        extracted = extract(stage, path, "--signal", "eda", "--rate", 4, *options)
        means[name] = next(row["value"] for row in extracted["features"] if "Mean" in row["name"])
    assert all(abs(mean / means["own"] - 1) < 1e-9 for mean in means.values()), means
    for head, rows, options, words in (
        ("eda [counts]", eda, [], "eda in counts can't be converted to uS"),
        ("eda", eda, ["--unit", "mV"], "--unit nS, uS, mS, S, ohm, kohm, Mohm"),
        ("eda", [1800 + k % 50 for k in range(480)], [], "raw counts"),
    ):
        path = table(stage.folder / "refused.csv", rows, head)
        done = stage.ask("extract", path, "--signal", "eda", "--rate", 4, *options)
        assert done.returncode == 2 and words in done.stderr, (words, done.stderr)


EVIL = "\x1b[2J\x1b]0;evil\x07\u202eecg\u009b31m"


def harmless(*texts) -> bool:
    """Whether nothing in texts commands a terminal or turns the direction of writing."""
    unwanted = [*map(chr, range(32)), *map(chr, range(127, 160)), *map(chr, range(0x202A, 0x202F))]
    return not any(each in text for text in texts for each in unwanted if each not in "\n\t")


def test_names_and_cells_command_no_terminal(stage):
    rows = [f"{value:.4f},{value:.4f}" for value in ecg()]
    path = table(stage.folder / "evil.csv", rows, f"{EVIL},{EVIL}2")
    options = ("--signal", "emg", "--rate", RATE_HZ)
    for more in ([], ["--json"], ["--events"], ["--column", f"{EVIL}3"], ["--time", f"{EVIL}"]):
        done = stage.ask("extract", path, *options, *more)
        assert "evil" in done.stdout + done.stderr or more == ["--events"], more
        assert harmless(done.stdout, done.stderr), (more, done)
    path = table(stage.folder / "cell.csv", ["1", "2", EVIL], "ecg")
    done = stage.ask("extract", path, "--signal", "ecg", "--rate", RATE_HZ)
    assert done.returncode == 1 and "line 4" in done.stderr and harmless(done.stderr), done.stderr


def test_options_that_mean_nothing_for_a_signal_are_refused(stage, recording):
    for options in (
        ["--signal", "ecg", "--phasic", "cvxeda"],
        ["--signal", "eda", "--phasic", "cvxeda", "--method", "causal"],
        ["--signal", "ecg", "--artefacts", "kept"],
        ["--signal", "temperature", "--truth", recording],
        ["--signal", "acceleration"],
    ):
        done = stage.ask("extract", recording, "--rate", RATE_HZ, *options)
        assert done.returncode == 2 and "hint:" in done.stderr, (options, done.stderr)


def test_a_full_disk_is_a_failure(stage, recording):
    arguments = ["extract", str(recording), "--signal", "ecg", "--rate", str(RATE_HZ), "--json"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [harness.TEAMPULSE, *arguments], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 1 and "No space left" in done.stderr


@pytest.mark.parametrize("events", [[], ["--events"]])
def test_what_comes_in_live_is_printed_as_it_becomes_known(stage, events):
    arguments = ["extract", "-", "--signal", "ecg", "--rate", RATE_HZ, "--method", "causal"]
    program = stage.teampulse(*arguments, "--window", 10, *events)
    for voltage in ecg()[: 30 * RATE_HZ]:
        program.say(f"{voltage:.4f}")
    # Standard input is still open.
    program.wait_for("0 to 10 s" if not events else "beat,", pipe="stdout")
    assert program.is_running()
    program.say_no_more()
    assert program.ended() == 0


def around(extracted) -> dict[float, dict]:
    """The values around each event, by name."""
    events = {}
    for row in extracted["around"]:
        assert (row["value"] is None) == (row["reason"] is not None) and row["method"], row
        events.setdefault(row["event_secs"], {})[row["name"]] = row
    return events


def test_the_heart_rate_around_events_is_that_of_the_beats(stage, recording):
    # 60 a minute; from 30 s on, 75.
    intervals = [1000] * 30 + [800] * 50
    path = table(stage.folder / "rr.txt", intervals)
    events = table(stage.folder / "events.csv", ["20,a", "30,b", "500,c"], "time_secs,name")
    found = around(extract(stage, path, "--signal", "interval", "--around", events))
    value = lambda event, name: found[event][name]["value"]
    assert value(20, "Rate_Change_Mean") == pytest.approx(0, abs=1e-6)
    assert value(30, "Rate_Baseline") == pytest.approx(60) and value(30, "Rate_Change_6") == pytest.approx(15)
    assert found[500]["Rate_Baseline"]["reason"] == "data missing in the window"
    # Of an ECG, by the number of a sample; a baseline and a time after the event of other lengths.
    samples = table(stage.folder / "samples.csv", [60 * RATE_HZ], "sample")
    options = ("--signal", "ecg", "--rate", RATE_HZ, "--around", samples, "--baseline", 10, "--after", 3)
    [(event, values)] = around(extract(stage, recording, *options)).items()
    assert event == 60 and values["ECG_Rate_Baseline"]["value"] == pytest.approx(75, abs=1)
    assert [name for name in values if name[-1].isdigit()] == [f"ECG_Rate_Change_{k}" for k in (1, 2, 3)]
    printed = stage.ask("extract", recording, *options).stdout
    assert "event at 60 s" in printed and "Graham 1978" in printed
    # As in events.tsv.
    onsets = table(stage.folder / "events.tsv", [60], "onset")
    options = ("--signal", "ecg", "--rate", RATE_HZ, "--around", onsets, "--baseline", 10, "--after", 3)
    assert around(extract(stage, recording, *options)) == {event: values}


def test_responses_of_the_skin_belong_to_the_events_before_them(stage):
    rate_hz, onsets = 8, [22.0, 62.0]

    def skin(at: float) -> float:
        rises = [at - onset for onset in onsets if at > onset]
        return 5 + sum(0.8 * (math.exp(-rise / 3) - math.exp(-rise / 0.75)) / 0.47 for rise in rises)

    path = table(stage.folder / "eda.csv", [f"{skin(k / rate_hz):.5f}" for k in range(100 * rate_hz)], "eda_us")
    events = table(stage.folder / "events.csv", [20, 40, 60, 99], "time_secs")
    found = around(extract(stage, path, "--signal", "eda", "--rate", rate_hz, "--around", events))
    for event, responds in ((20, 1), (40, 0), (60, 1)):
        assert found[event]["SCR_Event"]["value"] == responds, event
    assert found[20]["SCR_Event_Latency"]["value"] == pytest.approx(2, abs=0.5)
    assert found[20]["SCR_Event_Amplitude"]["value"] == pytest.approx(0.8, rel=0.25)
    assert found[40]["SCR_Event_Amplitude"]["value"] == 0 and found[40]["SCR_Event_Latency"]["reason"]
    assert found[99]["SCR_Event"]["reason"] == "data missing in the window"


@pytest.mark.parametrize(
    "options,message",
    [
        (["--signal", "eeg"], "eeg has no values around events"),
        (["--signal", "ecg", "--method", "causal"], "--around needs the signal after each event"),
        (["--signal", "ecg", "--after", "500"], "between 1 and 120 s"),
        (["--signal", "ecg"], "time_secs"),
    ],
)
def test_values_around_events_that_can_not_be_are_refused(stage, recording, options, message):
    events = table(stage.folder / "events.csv", [20], "shown_at")
    done = stage.ask("extract", recording, "--rate", RATE_HZ, *options, "--around", events)
    assert done.returncode == 2 and message in done.stderr, done.stderr


@pytest.mark.parametrize("kind", ["pulses", "upside down", "noise"])
def test_pulses_that_are_upside_down_are_named(stage, kind):
    chance, rate_hz = random.Random(5), 64

    def pulse(at: float) -> float:
        phase = at * 75 / 60 % 1
        return math.exp(-(((phase - 0.2) / 0.09) ** 2)) + 0.4 * math.exp(-(((phase - 0.45) / 0.12) ** 2))

    sign = {"pulses": 1, "upside down": -1, "noise": 0}[kind]
    samples = [sign * pulse(k / rate_hz) + chance.gauss(0, 0.04) for k in range(60 * rate_hz)]
    path = table(stage.folder / "ppg.csv", [f"{each:.4f}" for each in samples], "ppg")
    extracted = extract(stage, path, "--signal", "ppg", "--rate", rate_hz)
    rate = next(row for row in extracted["features"] if row["name"] == "PPG_Rate_Mean")
    assert any("upside down" in note for note in extracted["notes"]) == (kind == "upside down")
    assert (rate["value"] is None) == (kind != "pulses"), rate
    if kind == "upside down":
        turned = extract(stage, path, "--signal", "ppg", "--rate", rate_hz, "--scale", -1)
        rate = next(row for row in turned["features"] if row["name"] == "PPG_Rate_Mean")
        assert rate["value"] == pytest.approx(75, abs=1) and turned["notes"] == []
