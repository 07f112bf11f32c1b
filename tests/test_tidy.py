"""The tidy files of a session: what most colleagues open, held against the bag that they stand beside."""

import csv
import json

import numpy as np
import pandas
import pytest

import bags
import harness
import tables

STUDY = harness.ROOT / "studies/one_operator.toml"
ECG = "/humans/persons/p001/simulated/ecg"
STATE = "/humans/persons/p001/state/w30"
RECORDED_SECS = 75
TABLES = {"events.tsv": "\t", "features.csv": ","}
IN_THE_END = {"phases.csv", "phases.json", "intervals.csv", "summary.md"}
FILES = {*TABLES, *IN_THE_END, "events.json", "features.json", "intervals.txt", "intervals.json"}
# What `features.csv` may take of a disk, of one operator with nine sensors and two robots [MB/h].
MOST_MB_AN_HOUR = 20


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """The bag of a session with a simulated operator, from its baseline into the first task."""
    stage = harness.Stage(tmp_path_factory.mktemp("tidy"), 97)
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", STUDY, "--duration", RECORDED_SECS, "--out", out)
    simulator = stage.teampulse("simulate", STUDY)
    assert monitor.ended(within_secs=120) == 0, monitor.report()
    assert simulator.interrupt() == 0, simulator.report()
    yield harness.the_bag(out)
    stage.close()


@pytest.fixture(scope="module")
def events(bag):
    # As BIDS says what is missing.
    return pandas.read_csv(bag / "events.tsv", sep="\t", na_values="n/a", keep_default_na=False)


@pytest.fixture(scope="module")
def features(bag):
    return pandas.read_csv(bag / "features.csv", float_precision="round_trip")


def test_the_bag_is_a_bag_to_everyone_with_the_files_in_its_folder(bag, stage):
    assert FILES < {each.name for each in bag.iterdir()}
    assert sum(bags.decoded_by_rosbags(bag).values()) > 1000
    for command in ("info", "recover"):
        answer = stage.ask(command, bag)
        assert answer.returncode == 0, answer.stderr


def test_events_are_those_of_the_bag_in_order(bag, events):
    assert list(events.columns[:3]) == ["onset", "duration", "trial_type"]
    assert events.onset.is_monotonic_increasing
    assert "beat" not in set(events.trial_type)
    reported = [each for each in bags.messages(bag) if is_event(each, "response")]
    rows = events[events.trial_type == "response"]
    assert len(rows) == len(reported) > 5
    onsets = np.sort([stamp_secs(each) for each in reported])
    assert np.allclose(np.diff(rows.onset), np.diff(onsets), atol=2e-3)


def test_phases_cover_the_session(events, features):
    phases = events[(events.trial_type == "phase") & (events.stream == "/session/events")]
    assert list(phases.label) == ["baseline", "1-back"]
    baseline, task = phases.onset
    assert baseline < 1 and abs(task - baseline - 60) < 0.5
    assert (events.trial_type == "phase").sum() == 2, "each stands there once"
    # As they were: the session ended long before the second one should have.
    assert phases.duration.iloc[0] == pytest.approx(60, abs=0.5)
    assert phases.duration.iloc[1] == pytest.approx(RECORDED_SECS - 60, abs=2)
    assert (events[events.trial_type == "phase"].duration <= RECORDED_SECS + 5).all()
    during = events[(events.subject == "robot1") & events.onset.between(1, 59)]
    assert set(during.phase) <= {"baseline"}
    covered = windows_of(features)
    spans = sorted(set(zip(covered.start_secs, covered.phase, strict=True)))
    assert [phase for _, phase in spans] == ["baseline", "baseline"]
    assert spans[1][0] - spans[0][0] == pytest.approx(30, abs=1)


def test_each_value_is_that_of_the_bag_with_its_unit(bag, features):
    assert features.unit.notna().all()
    assert (features.value.isna() == features.reason.notna()).all()
    assert (features.value.notna() | features.reason.notna()).all()
    name = f"{ECG}/heart/w30"
    begin_ms = pandas.Timestamp(pandas.read_csv(bag / "events.tsv", sep="\t").time[0]).value // 1_000_000
    begin_ms -= round(1000 * pandas.read_csv(bag / "events.tsv", sep="\t").onset[0])
    described = [each.content for each in bags.messages(bag, "/teampulse/streams")]
    stream = next(each for each in described if each.name == name)
    windows = {stamp_ms(each): each.content for each in bags.messages(bag, name)}
    rows = windows_of(features)
    assert len(rows) == 2 * (2 + len(stream.channels)), "with coverage and quality"
    for row in rows.itertuples():
        end_ms = begin_ms + round(1000 * (row.start_secs + row.window_secs))
        window = windows[min(windows, key=lambda each: abs(each - end_ms))]
        if row.measure in ("coverage", "quality"):
            assert row.value == pytest.approx(getattr(window, row.measure))
            continue
        place = stream.channels.index(row.measure)
        assert row.unit == stream.units[place]
        if window.reasons[place] == 0:
            assert row.value == window.values[place]
        else:
            assert np.isnan(row.value) and row.reason


def test_intervals_add_up_to_the_time_in_which_the_heart_was_heard(bag, figure):
    times_secs, intervals_secs = np.loadtxt(bag / "intervals.txt").T
    intervals_ms = 1e3 * intervals_secs
    beats = bags.messages(bag, f"{ECG}/beats")
    assert len(intervals_ms) == sum(np.isfinite(each.content.value) for each in beats)
    lasted_secs = stamp_secs(beats[-1]) - stamp_secs(beats[0])
    assert lasted_secs > RECORDED_SECS - 10
    off = intervals_ms.sum() / 1e3 / lasted_secs - 1
    figure(f"tidy: intervals add up to {off:+.3%} of the time from the first beat to the last")
    assert abs(off) < 0.02
    assert intervals_ms.min() > 300 and intervals_ms.max() < 2000
    # Each begins where the one before it ends, as no data are missing.
    assert np.allclose(np.diff(times_secs), intervals_secs[1:], atol=1e-3)
    table = pandas.read_csv(bag / "intervals.csv")
    assert list(table.columns) == ["time_secs", "rr_ms", "phase", "corrected"]
    assert np.allclose(table.rr_ms, intervals_ms, atol=1e-2)
    assert set(table.phase.dropna()) == {"baseline", "1-back"}
    assert set(table.corrected) <= {0, 1} and table.corrected.mean() < 0.2


@pytest.mark.parametrize("method", ["whole", "causal"])
def test_intervals_are_read_again_and_give_what_the_session_gave(stage, bag, features, tmp_path, method):
    table = pandas.read_csv(bag / "intervals.csv", dtype=str)
    of_phase = table[table.phase == "baseline"]
    tables = {"whole.txt": (bag / "intervals.txt").read_text()}
    tables["phase.csv"] = of_phase.to_csv(index=False)
    tables["phase.txt"] = "".join(f"{at}\t{float(rr) / 1e3:.6f}\n" for at, rr in of_phase[["time_secs", "rr_ms"]].values)
    extracted = {}
    for name, text in tables.items():
        (tmp_path / name).write_text(text)
        answer = stage.ask(
            *("extract", tmp_path / name, "--signal", "interval"),
            *("--artefacts", "corrected", "--method", method, "--json"),
        )
        assert answer.returncode == 0, answer.stderr
        extracted[name] = json.loads(answer.stdout)
    beats = [each["time_secs"] for each in extracted["whole.txt"]["events"]]
    assert np.allclose(beats, np.loadtxt(bag / "intervals.txt").T[0], atol=1e-4)
    session = features[(features.phase == "baseline") & (features.source == "simulated/ecg")]
    session = session[session.window_secs > 45].groupby("measure").value.last()
    for name in ("phase.csv", "phase.txt"):
        again = {each["name"]: each["value"] for each in extracted[name]["features"]}
        for measure in ("HRV_MeanNN", "HRV_SDNN", "HRV_RMSSD", "HRV_pNN20", "HRV_SD1"):
            assert again[measure] == pytest.approx(session[measure], rel=1e-3), (name, measure)


def test_phases_are_one_small_table(bag, features):
    phases = pandas.read_csv(bag / "phases.csv", float_precision="round_trip")
    person = phases[phases.subject == "p001"]
    assert list(person.phase) == ["baseline", "1-back"] and list(person.occurrence) == [1, 1]
    described = json.loads((bag / "phases.json").read_text())
    assert set(described) == set(phases.columns)
    assert all(each["Description"] for each in described.values())
    long = features[(features.subject == "p001") & (features.phase == "baseline")]
    long = long[(long.source == "simulated/ecg") & (long.measure == "ECG_Rate_Mean")]
    baseline = long[long.window_secs > 45].value.iloc[-1]
    assert person["ECG_Rate_Mean"].iloc[0] == baseline


def test_each_measure_has_a_description_and_a_method(bag, features):
    described = json.loads((bag / "features.json").read_text())["measure"]["Levels"]
    assert set(features.measure) <= set(described)
    assert all(each["Description"] and each["Method"] for each in described.values())
    assert "Welch" in str(described["HRV_LF"]["Method"])
    assert not [name for name, each in described.items() if "specific to this study" in each["Description"]]


def test_features_take_little_room(bag, figure):
    an_hour = (bag / "features.csv").stat().st_size * 3600 / RECORDED_SECS / 1e6
    figure(f"tidy: features.csv takes {an_hour:.1f} MB an hour")
    assert an_hour < MOST_MB_AN_HOUR


def test_files_are_their_owner_s_alone(bag):
    assert {name: (bag / name).stat().st_mode & 0o777 for name in FILES} == dict.fromkeys(FILES, 0o600)


def test_the_summary_is_a_page_with_everyone_on_it(bag):
    text = (bag / "summary.md").read_text()
    for word in ("# one_operator", "### p001", "### robot2", f"| {ECG} ", "baseline", "intervals.txt", "phases.csv"):
        assert word in text, word
    assert len(text.splitlines()) < 100


def test_a_replay_writes_the_same_files(bag, stage):
    answer = stage.ask("replay", bag, "--out", stage.folder / "replay")
    assert answer.returncode == 0, answer.stderr
    again = harness.the_bag(stage.folder / "replay")
    for name in FILES - {"summary.md"}:
        assert (again / name).read_bytes() == (bag / name).read_bytes(), name


def test_each_column_is_described_in_the_file_beside_its_table(bag, events, features):
    for table, name in ((events, "events.json"), (features, "features.json")):
        described = json.loads((bag / name).read_text())
        assert set(described) == set(table.columns)
        assert all(column["Description"] for column in described.values())
    assert set(events.trial_type) <= set(json.loads((bag / "events.json").read_text())["trial_type"]["Levels"])
    reasons = json.loads((bag / "features.json").read_text())["reason"]["Levels"]
    assert set(features.reason.dropna()) <= set(reasons)


def test_bursts_have_the_channel_of_the_muscle(bag, events):
    # A stream may be described again when more of it is known.
    described = tables.described(bag).values()
    [muscle] = [each for each in described if each.signal == "emg" and each.origin == 0]
    bursts = events[events.trial_type == "burst"]
    assert len(bursts) and set(bursts.channel) <= set(muscle.channels)
    assert events[events.trial_type != "burst"].channel.isna().all()


def test_units_have_one_spelling(features):
    assert all(unit.isascii() for unit in set(features.unit))
    assert {"uS", "degC", "1/min"} <= set(features.unit)
    assert "bpm" not in set(features.unit)


def test_against_a_baseline_of_a_minute_there_are_differences_and_no_z(bag):
    stream = tables.described(bag)[STATE]
    assert "too short for z" in stream.method
    windows = [each.content for each in bags.messages(bag, STATE)]
    assert len(windows) > 5
    for kind, reason in (("difference", 0), ("z", 8), ("robust_z", 8)):
        place = stream.channels.index(f"heart_rate_{kind}")
        assert {each.reasons[place] for each in windows} == {reason}, kind


def test_a_killed_monitor_leaves_files_that_are_whole_up_to_their_last_line(stage):
    out = stage.folder / "killed"
    monitor = stage.teampulse("run", STUDY, "--out", out)
    stage.teampulse("simulate", STUDY)
    folder = harness.eventually(lambda: next(out.glob("*/"), None))
    tables = [folder / name for name in TABLES]
    # Beats are found after some seconds, windows of a few seconds are short.
    intervals = folder / "intervals.txt"
    harness.eventually(lambda: all(each.exists() and each.stat().st_size > 500 for each in tables), 60)
    harness.eventually(lambda: intervals.exists() and intervals.stat().st_size > 50, 60)
    monitor.kill()
    for table in tables:
        head, *rows = csv.reader(whole_lines(table), delimiter=TABLES[table.name])
        assert rows and all(len(row) == len(head) for row in rows), table.name
    assert all(0.3 < float(line.split("\t")[1]) < 2 for line in whole_lines(intervals))
    assert not (folder / "summary.md").exists()

    answer = stage.ask("replay", folder, "--out", stage.folder / "again")
    assert answer.returncode == 3 and "damaged" in answer.stderr, answer.stderr
    again = harness.the_bag(stage.folder / "again")
    names = {each.name for each in again.glob("intervals*.txt")}
    assert names == {each.name for each in folder.glob("intervals*.txt")}
    assert "cut off" in (again / "summary.md").read_text()


def whole_lines(path) -> list[str]:
    """The lines of a file up to the last that has its end."""
    return path.read_text().split("\n")[:-1]


def test_a_study_can_do_without_them(stage):
    study = stage.study(
        '[session]\nname = "test"\n[[sources]]\ntype = "topics"\nnames = ["/tf"]\n'
        '[[sinks]]\ntype = "bag"\ntidy = false\n'
    )
    program = stage.teampulse("run", study, "--duration", 1, "--out", stage.folder / "out")
    assert program.ended() == 0, program.report()
    assert not FILES & {each.name for each in harness.the_bag(stage.folder / "out").iterdir()}


def test_without_a_bag_there_is_no_folder_for_them(stage):
    study = stage.study('[[sources]]\ntype = "topics"\nnames = ["/tf"]\n[[sinks]]\ntype = "tidy"\n')
    answer = stage.ask("run", study, "--duration", 1)
    assert answer.returncode == 4
    assert "no bag" in answer.stderr


def test_the_demo_has_an_operator_and_five_robots_in_one_bag(demo_bag):
    subjects = {"p001", *(f"robot{number}" for number in range(1, 6))}
    text = (demo_bag / "summary.md").read_text()
    assert all(f"### {subject}\n" in text for subject in subjects)
    # Of the H10, by its ECG and by its own intervals, and of the pulse.
    tables = list(demo_bag.glob("intervals*.txt"))
    assert tables and all(table.read_text().count("\n") > 10 for table in tables), tables


def windows_of(features):
    """The windows of 30 s of the heart, which are no phases."""
    of_heart = features[(features.source == "simulated/ecg") & (features.window_secs == 30)]
    return of_heart[of_heart.subject == "p001"]


def is_event(message, kind: str) -> bool:
    return getattr(message.content, "kind", None) == kind


def stamp_ms(message) -> int:
    """The time of a message to the millisecond that it lies in, as texts have it."""
    stamp = message.content.header.stamp
    return stamp.sec * 1000 + stamp.nanosec // 1_000_000


def stamp_secs(message) -> float:
    stamp = message.content.header.stamp
    return stamp.sec + stamp.nanosec * 1e-9
