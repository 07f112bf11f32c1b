"""Recordings that others made are read as they are: what rosbag2 writes, through an independent writer."""

import json
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
BATTERY = STORE.types["sensor_msgs/msg/BatteryState"]
STRING = STORE.types["std_msgs/msg/String"]
HEADER, TIME = STORE.types["std_msgs/msg/Header"], STORE.types["builtin_interfaces/msg/Time"]
BEGIN_NS, COUNT = 1_700_000_000_000_000_000, 600


def battery(at_ns, k):
    import numpy

    header = HEADER(TIME(at_ns // 10**9, at_ns % 10**9), "base")
    none = numpy.zeros(0, dtype=numpy.float32)
    numbers = (12.0 - k / 1000, 25.0, -2.0, 5.0, 10.0, 10.0, 0.9 - k / 10000)
    return BATTERY(header, *numbers, 2, 1, 3, True, none, none, "slot", "1")


def record(path, version, storage, mode):
    recording = Writer(path, version=version, storage_plugin=storage)
    if mode != CompressionMode.NONE:
        recording.set_compression(mode, CompressionFormat.ZSTD)
    with recording as writer:
        batteries = writer.add_connection("/robot1/battery_state", BATTERY.__msgtype__, typestore=STORE)
        words = writer.add_connection("/chatter", STRING.__msgtype__, typestore=STORE)
        for k in range(COUNT):
            at_ns = BEGIN_NS + k * 100_000_000
            writer.write(batteries, at_ns, STORE.serialize_cdr(battery(at_ns, k), BATTERY.__msgtype__))
            writer.write(words, at_ns + 50_000_000, STORE.serialize_cdr(STRING(f"word {k}"), STRING.__msgtype__))
    return path


@pytest.mark.parametrize("version", [8, 9])
@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("mode", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_recording_of_others_is_read_and_replayed_with_the_defaults(stage, version, storage, mode):
    bag = record(stage.folder / "theirs", version, storage, mode)
    answer = stage.ask("info", bag, "--json")
    assert answer.returncode == 0, answer.stderr
    counts = {each["name"]: each["messages"] for each in json.loads(answer.stdout)["streams"]}
    assert counts == {"/robot1/battery_state": COUNT, "/chatter": COUNT}
    done = stage.ask("replay", bag, "--out", stage.folder)
    assert done.returncode == 0, done.stderr
    assert "contains no study" in done.stderr
    with AnyReader([next(stage.folder.glob("theirs_replay*"))]) as reader:
        counts = {each.topic: each.msgcount for each in reader.connections}
        assert counts["/robot1/battery_state"] == counts["/chatter"] == COUNT
        # What it is is known by its type: it is judged as a robot's battery.
        assert counts["/robot1/battery_state/use/w30"] > 10
        times = [at_ns for connection, at_ns, _ in reader.messages() if connection.topic == "/chatter"]
        assert times[:2] == [BEGIN_NS + 50_000_000, BEGIN_NS + 150_000_000]


def test_names_from_a_bag_command_no_terminal_and_leave_the_folder(stage):
    evil = "/evil\x1b[2J\u202e\n/../../x"
    with Writer(stage.folder / "evil", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        words = writer.add_connection(evil, STRING.__msgtype__, typestore=STORE)
        writer.write(words, BEGIN_NS, STORE.serialize_cdr(STRING("word"), STRING.__msgtype__))
    out = stage.folder / "tables"
    for arguments in (["info"], ["info", "--json"], ["export", "--out", out], ["replay", "--out", stage.folder / "again"]):
        done = stage.ask(arguments[0], stage.folder / "evil", *arguments[1:])
        for text in (done.stdout, done.stderr):
            assert not any(each in text for each in "\x1b\u202e\x07"), (arguments, done)
    names = [path.name for path in out.rglob("*")]
    assert names and all(name.isprintable() for name in names), names
    assert not (stage.folder.parent / "x").exists()


def test_a_recording_of_others_becomes_a_bag_with_a_report(stage):
    theirs = record(stage.folder / "theirs", 9, StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    out = stage.folder / "sessions"
    done = stage.ask("import", theirs, "--out", out)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].endswith(f"{2 * COUNT} messages on 2 topics, 60.0 s from 2023-11-14T22:13:20.000Z"), lines
    assert any("/robot1/battery_state" in line and "battery of robot1" in line for line in lines), lines
    assert len(lines) < 24
    bag = lines[-1]
    counts = {each["name"]: each for each in json.loads(stage.ask("info", bag, "--json").stdout)["streams"]}
    assert counts["/chatter"]["messages"] == COUNT
    assert counts["/robot1/battery_state/use/w30"]["origin"] == "derived"
    assert (Path(bag) / "summary.md").exists()
    again = stage.ask("import", bag, "--out", out)
    assert again.returncode == 1 and "is already a teampulse bag" in again.stderr


def test_what_is_missing_of_a_bag_is_in_the_exit_code(stage):
    theirs = record(stage.folder / "theirs", 9, StoragePlugin.MCAP, CompressionMode.NONE)
    assert stage.ask("info", theirs).returncode == 0
    [file] = theirs.glob("*.mcap")
    metadata = theirs / "metadata.yaml"
    known = metadata.read_text()
    metadata.write_text(known.replace(f"- {file.name}\n", f"- {file.name}\n  - other_1.mcap\n", 1))
    done = stage.ask("info", theirs)
    assert done.returncode == 3 and "other_1.mcap" in done.stdout, done
    with Writer(stage.folder / "short", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        words = writer.add_connection("/chatter", STRING.__msgtype__, typestore=STORE)
        for k, cdr in enumerate([STORE.serialize_cdr(STRING("word"), STRING.__msgtype__), b"\0\1\0\0\5"]):
            writer.write(words, BEGIN_NS + k, cdr)
    done = stage.ask("export", stage.folder / "short", "--out", stage.folder / "tables")
    assert done.returncode == 3 and "1 message has no values in its table" in done.stderr, done


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_of_a_torn_recording_in_sqlite_all_that_is_left_becomes_a_whole_bag(stage, share):
    theirs = record(stage.folder / "theirs", 9, StoragePlugin.SQLITE3, CompressionMode.NONE)
    [file] = theirs.glob("*.db3")
    torn = file.read_bytes()[: int(share * file.stat().st_size)]
    file.write_bytes(torn)
    (theirs / "metadata.yaml").unlink()
    done = stage.ask("recover", theirs)
    assert done.returncode == 1 and f"`teampulse import {theirs}`" in done.stderr, done
    assert file.read_bytes() == torn
    done = stage.ask("import", theirs, "--out", stage.folder / "sessions")
    assert done.returncode == 3 and "damaged:" in done.stdout, done
    bag = Path(done.stdout.splitlines()[-1])
    counts = {each["name"]: each["messages"] for each in json.loads(stage.ask("info", bag, "--json").stdout)["streams"]}
    kept = counts["/chatter"] + counts["/robot1/battery_state"]
    assert (share - 0.25) * 2 * COUNT < kept < 2 * COUNT
    assert stage.ask("info", bag, "--check").returncode == 0
    assert (bag / "summary.md").exists() and (bag / "events.tsv").exists()


def test_tables_of_a_wristband_become_one_bag_of_a_person(stage):
    folder = stage.folder / "E4"
    folder.mkdir()
    begin = BEGIN_NS // 10**9
    (folder / "EDA.csv").write_text(f"{begin}.0\n4.0\n" + "".join(f"{2 + k % 40 / 100}\n" for k in range(4 * 90)))
    cells = (f"{k % 3},{k % 5},64\n" for k in range(32 * 90))
    (folder / "ACC.csv").write_text(f"{begin}.0, {begin}.0, {begin}.0\n32.0, 32.0, 32.0\n" + "".join(cells))
    (folder / "IBI.csv").write_text(f"{begin}.0, IBI\n" + "".join(f"{0.8 * k + 0.8:.2f},0.8\n" for k in range(110)))
    (folder / "tags.csv").write_text(f"{begin + 3}.5\n")
    done = stage.ask("import", folder, "--person", "p007", "--device", "e4", "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    bag = done.stdout.splitlines()[-1]
    info = json.loads(stage.ask("info", bag, "--json").stdout)
    streams = {each["name"]: each for each in info["streams"]}
    below = "/humans/persons/p007/e4"
    raw = {name for name, each in streams.items() if each["origin"] == "raw" and name.startswith("/humans")}
    assert raw == {f"{below}/eda", f"{below}/acceleration", f"{below}/interval"}
    assert streams[f"{below}/interval"]["messages"] == 110
    assert abs(info["start_secs"] - begin) < 1 and abs(info["duration_secs"] - 90) < 1.5
    assert streams[f"{below}/eda/skin/w30"]["messages"] > 50
    # As `extract` has it: 64 is 1 g.
    table = stage.folder / "tables"
    assert stage.ask("export", bag, "--out", table).returncode == 0
    [acceleration] = table.glob("*e4__acceleration.csv")
    assert ",1" in acceleration.read_text().splitlines()[1]


def test_tables_of_polar_sensor_logger_become_one_bag_of_their_day(stage):
    folder = stage.folder / "psl"
    folder.mkdir()
    head = "Phone timestamp;sensor timestamp [ns];timestamp [ms];ecg [uV]\n"
    ecg = (f"2024-05-04T10:00:{k // 130:02}.{k % 130 // 36 * 250:03};{599616050941733632 + k * 7692308};{k * 7.692:.3f};{k % 97}\n" for k in range(130 * 20))
    (folder / "Polar_H10_B5_20240504_100000_ECG.txt").write_text(head + "".join(ecg))
    rr = (f"2024-05-04T10:00:{4 * k // 5:02}.{4 * k % 5 * 200:03};800\n" for k in range(1, 25))
    (folder / "Polar_H10_B5_20240504_100000_RR.txt").write_text("Phone timestamp;RR-interval [ms]\n" + "".join(rr))
    (folder / "Polar_H10_B5_20240504_100000_HR.txt").write_text("Phone timestamp;HR [bpm];HRV [ms];\n2024-05-04T10:00:01.000;75;;\n")
    done = stage.ask("import", folder, "--device", "polar_h10", "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    info = json.loads(stage.ask("info", done.stdout.splitlines()[-1], "--json").stdout)
    streams = {each["name"]: each["messages"] for each in info["streams"] if each["origin"] == "raw"}
    assert streams["/humans/persons/p001/polar_h10/interval"] == 24
    assert streams["/humans/persons/p001/polar_h10/ecg"] > 20
    assert abs(info["start_secs"] - 1714816800) < 1


def test_a_table_at_a_rate_keeps_its_day(stage):
    rows = "".join(f"04.05.2024 10:00:{k // 4:02};{2 + k % 40 / 100}\n" for k in range(4 * 50))
    table = stage.folder / "eda.csv"
    table.write_text("DateTime;EDA\n" + rows)
    done = stage.ask("import", table, "--out", stage.folder / "sessions")
    assert done.returncode == 0 and "spread evenly from that time on, at 4 Hz" in done.stderr, done
    done = stage.ask("import", table, "--rate", 4, "--out", stage.folder / "sessions")
    assert done.returncode == 0, done.stderr
    info = json.loads(stage.ask("info", done.stdout.splitlines()[-1], "--json").stdout)
    assert abs(info["start_secs"] - 1714816800) < 1 and abs(info["duration_secs"] - 50) < 1.5


def test_what_a_table_measures_has_to_be_known(stage):
    table = stage.folder / "data.csv"
    table.write_text("1\n2\n")
    done = stage.ask("import", table, "--out", stage.folder)
    assert done.returncode == 2 and "--signal" in done.stderr, done
