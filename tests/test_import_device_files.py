"""Files that devices and recorders left join a session afterwards; most are written by programs of others."""

import io
import math
import random
import re
import struct
import zipfile
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path

import bags
import edfio
import fastavro
import harness
import numpy as np
import pytest
import pyxdf
import recorded
import tables
from mcap.writer import Writer

BEGIN_SECS = 1_700_000_000
BEGIN_NS = BEGIN_SECS * 1_000_000_000
SECS = 300
# By how much the wristband's clock is behind, and how long a pulse takes to the wrist [s].
BEHIND_SECS = 37.5
ARRIVAL_SECS = 0.25


def beats() -> list[float]:
    """Heartbeats with breathing and chance in them [s]."""
    chance = random.Random(3)
    at, found = 0.7, []
    while at < SECS - 1:
        found.append(at)
        at += 0.86 + 0.05 * math.sin(1.5 * at) + 0.03 * math.sin(0.55 * at) + chance.gauss(0, 0.01)
    return found


def bumps(rate_hz: float, at_secs: list[float], width_secs: float) -> np.ndarray:
    """A wave with its peaks at these times."""
    times = np.arange(int(SECS * rate_hz)) / rate_hz
    wave = np.zeros(len(times))
    for at in at_secs:
        near = slice(max(0, int((at - 1) * rate_hz)), int((at + 1) * rate_hz))
        wave[near] += np.exp(-0.5 * ((times[near] - at) / width_secs) ** 2)
    return wave


@pytest.fixture(scope="module")
def heart():
    return beats()


@pytest.fixture
def session(stage, heart):
    """A session with an ECG of p001 and its beats."""
    ecg = bumps(130, heart, 0.012)
    lines = [f"{BEGIN_SECS + k / 130:.6f},{value:.4f}" for k, value in enumerate(ecg)]
    table = stage.folder / "ecg.csv"
    table.write_text("\n".join(["time [s],ecg [mV]", *lines]))
    answer = stage.ask("import", table, "--person", "p001", "--out", stage.folder / "session")
    assert answer.returncode == 0, answer.stderr
    return Path(answer.stdout.splitlines()[-1])


def e4_zip(path, heart, **more) -> None:
    """The zip of a wristband that was worn meanwhile, by its own clock."""
    start = BEGIN_SECS - BEHIND_SECS
    # The tangent of the rise reaches the level before it, the foot, two widths before the peak.
    pulse = bumps(64, [beat + ARRIVAL_SECS + 2 * 0.055 for beat in heart], 0.055)
    skin = 2 + 0.1 * np.sin(np.arange(SECS * 4) / 40)
    files = {
        "BVP.csv": [f"{start:.2f}", "64.000000", *(f"{50 * value:.2f}" for value in pulse)],
        "EDA.csv": [f"{start:.2f}", "4.000000", *(f"{value:.6f}" for value in skin)],
        "ACC.csv": [", ".join([f"{start:.2f}"] * 3), ", ".join(["32.000000"] * 3), *(["0,0,64"] * SECS * 32)],
        "tags.csv": [f"{start + 100:.2f}", f"{start + 103.2:.2f}", f"{start + 111.9:.2f}"],
        "info.txt": ["about the files"],
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, lines in (files | more).items():
            archive.writestr(name, "\n".join(lines))


def joined(stage, file, session, *arguments):
    return stage.ask("import", file, "--into", session, "--out", stage.folder / "joined", *arguments)


def first_secs(bag, topic: str) -> float:
    """When the first sample of a stream was measured, after the start [s]."""
    return (tables.stamp_ns(bags.messages(bag, topic)[0]) - BEGIN_NS) / 1e9


def test_a_wristband_is_joined_by_heart_beats(stage, session, heart, figure):
    e4_zip(stage.folder / "e4.zip", heart)
    before = bags.counts(session)
    answer = joined(stage, "e4.zip", session)
    assert answer.returncode == 0, answer.stderr
    assert bags.counts(session) == before
    bag = Path(answer.stdout.splitlines()[-1])
    off_ms = 1e3 * first_secs(bag, "/empatica_e4/bvp")
    [within] = re.findall(r"times are within (\d+) ms \(95 %\)", answer.stdout)
    figure(f"import: an E4 joined by heartbeats, {off_ms:+.1f} ms off, stated ± {within} ms")
    assert abs(off_ms) <= 20 <= int(within) <= 80
    assert "its clock was 37." in answer.stdout and "behind" in answer.stdout
    assert f"within {within} ms" in tables.described(bag)["/humans/persons/p001/empatica_e4/eda"].doc
    origins = bags.origins(bag)
    assert origins["/humans/persons/p001/empatica_e4/acc"] == "raw"
    assert any(name.endswith("/bvp/pulse/w30") for name in origins), sorted(origins)


def test_a_wristband_is_joined_to_what_came_live_of_it(stage, heart, figure):
    """Though the session has an ECG, by which nobody knows how late the pulse of this person is."""
    wearables = [f'[[simulate.wearables]]\ntype = "{kind}"\nperson = "p001"' for kind in ("polar_h10", "empatica_e4")]
    devices = stage.teampulse("emulate", stage.study('[session]\nname = "emulated"\n' + "\n".join(wearables), "e.toml"))
    bus = devices.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=(\S+)", pipe="stdout")[1]
    devices.wait_for("emulating wearables")
    study = stage.study(f'[session]\nname = "live"\n{devices.sources(2)}\n[[sinks]]\ntype = "bag"\n')
    out = stage.folder / "sessions"
    run = stage.teampulse("run", study, "--out", out, "--duration", "90", env={"DBUS_SYSTEM_BUS_ADDRESS": bus})
    assert run.ended(within_secs=150) == 0, run.report()
    session = harness.the_bag(out)
    assert any(name.endswith("/ecg/beats") for name in bags.counts(session))
    live = bags.messages(session, "/empatica_e4/ppg")
    start = tables.stamp_ns(live[0]) / 1e9 - BEHIND_SECS
    rows = [f"{start:.6f}", "64.000000", *(f"{each.content.values[0]:.4f}" for each in live)]
    e4_zip(stage.folder / "e4.zip", heart, **{"BVP.csv": rows})
    answer = joined(stage, "e4.zip", session)
    assert answer.returncode == 0, answer.stderr
    assert "/empatica_e4/ppg/pulses" in answer.stdout and "same kind of device" in answer.stdout, answer.stdout
    off_ms, place = [], 0
    for wave in bags.messages(Path(answer.stdout.splitlines()[-1]), "/empatica_e4/bvp"):
        off_ms.append((tables.stamp_ns(wave) - tables.stamp_ns(live[place])) / 1e6)
        place += len(wave.content.samples)
    # While the clock of what came live is found, its first samples are placed less well.
    settled_ms = np.abs(off_ms[len(off_ms) // 4 :])
    [within] = re.findall(r"times are within (\d+) ms \(95 %\)", answer.stdout)
    p95_ms = np.percentile(settled_ms, 95)
    figure(f"import: an E4 joined to what came live of it, p95 {p95_ms:.1f} ms off, stated ± {within} ms")
    assert p95_ms <= 20 and p95_ms <= int(within), off_ms


def test_a_wristband_is_joined_by_presses_of_its_button(stage, heart, figure):
    types = recorded.our_types()
    session = stage.folder / "markers.mcap"
    with session.open("wb") as file:
        bag = recorded.Bag(Writer(file), types)
        bag.writer.start(profile="ros2")
        for secs in [100.001, 103.199, 111.902]:
            at_ns = BEGIN_NS + round(secs * 1e9)
            content = dict(device_time=recorded.NO_TIME, kind="marker", label="tap", value=math.nan, duration_secs=0.0)
            bag.add("/session/events", "teampulse_msgs/msg/Event", at_ns, at_ns, content)
        bag.writer.finish()
    e4_zip(stage.folder / "e4.zip", heart)
    answer = joined(stage, "e4.zip", session, "--at", "tap")
    assert answer.returncode == 0, answer.stderr
    off_ms = 1e3 * first_secs(Path(answer.stdout.splitlines()[-1]), "/empatica_e4/bvp")
    figure(f"import: an E4 joined by three presses, {off_ms:+.1f} ms off")
    assert abs(off_ms) <= 5
    other = joined(stage, "e4.zip", session, "--at", "clap")
    assert other.returncode != 0 and 'the session has no marker "clap"' in other.stderr, other.stderr
    assert 'its markers are `tap`: give --at "tap"' in other.stderr, other.stderr
    other = joined(stage, "e4.zip", session, "--at", "tap=nope")
    assert other.returncode != 0 and 'its markers are `tag`: give --at "tap=tag"' in other.stderr, other.stderr
    other = joined(stage, "e4.zip", session, "--at", "=")
    assert other.returncode != 0 and "expected the label of markers in the session" in other.stderr, other.stderr


def movements() -> list[tuple[float, float, float]]:
    """Movements of a body: when each begins, for how long it lasts [s], and how strong it is [g]."""
    chance = random.Random(5)
    at, found = 1.0, []
    while at < SECS - 4:
        found.append((at, chance.uniform(0.6, 2.0), chance.uniform(0.1, 0.3)))
        at += chance.expovariate(1 / 5)
    return found


def acceleration(start: float) -> list[str]:
    """The file of a wristband's acceleration in steps of 1/64 g."""
    times = np.arange(SECS * 32) / 32
    felt = np.zeros(len(times))
    for at, lasts, strength in movements():
        after = times - at
        swell = np.sin(np.pi * np.clip(after / lasts, 0, 1)) ** 2
        felt += strength * swell * np.sin(2 * np.pi * 1.7 * after)
    steps = np.round(64 * (1 + felt)).astype(int)
    return [", ".join([f"{start:.2f}"] * 3), ", ".join(["32.000000"] * 3), *(f"0,0,{step}" for step in steps)]


def test_a_device_that_sees_no_heart_is_joined_by_movement(stage, heart, figure):
    e4_zip(stage.folder / "left.zip", heart, **{"ACC.csv": acceleration(BEGIN_SECS)})
    answer = stage.ask("import", "left.zip", "--person", "p001", "--out", stage.folder / "session")
    assert answer.returncode == 0, answer.stderr
    session = Path(answer.stdout.splitlines()[-1])
    with zipfile.ZipFile(stage.folder / "right.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("ACC.csv", "\n".join(acceleration(BEGIN_SECS - BEHIND_SECS)))
        archive.writestr("info.txt", "about the files")
    answer = joined(stage, "right.zip", session)
    assert answer.returncode == 0, answer.stderr
    off_ms = 1e3 * first_secs(Path(answer.stdout.splitlines()[-1]), "/empatica_e4/acc")
    [within] = re.findall(r"times are within (\d+) ms \(95 %\)", answer.stdout)
    figure(f"import: an E4 joined by movement, {off_ms:+.1f} ms off, stated ± {within} ms")
    assert abs(off_ms) <= int(within) <= 50
    assert "stretches of 30 s with the same movement in common with /humans/persons/p001/empatica_e4/acc" in answer.stdout
    named = joined(stage, "left.zip", session, "--against", "/humans/persons/p001/empatica_e4/acc")
    assert named.returncode == 0 and "with the same movement" in named.stdout, named.stderr


@pytest.mark.parametrize(("unit", "secs", "form"), [("ms", 1e-3, "{:.0f}"), ("s", 1, "{:.3f}")], ids=["ms", "s"])
def test_a_list_of_intervals_without_a_date_is_joined(stage, session, heart, unit, secs, form):
    worn = [beat for beat in heart if 60 < beat < 240]
    intervals = [(after - before) / secs for before, after in zip(worn, worn[1:])]
    (stage.folder / "rr.txt").write_text("\n".join(form.format(interval) for interval in intervals))
    in_secs = [] if unit == "ms" else ["--unit", unit]
    answer = joined(stage, "rr.txt", session, "--signal", "interval", *in_secs)
    assert answer.returncode == 0, answer.stderr
    assert "its clock has no date" in answer.stdout
    bag = Path(answer.stdout.splitlines()[-1])
    assert abs(first_secs(bag, "/table/interval") - worn[1]) < 0.02


def consensys(heart) -> str:
    """A Shimmer3 GSR+ with its PPG at a finger, as Consensys exports it: units below names, times with an exponent."""
    names = ["Timestamp_Unix_CAL", "GSR_Skin_Conductance_CAL", "PPG_A13_CAL"]
    head = ['"sep=\t"', "\t".join(f"Shimmer_40AC_{name}" for name in names), "ms\tuS\tmV"]
    start_ms = 1e3 * (BEGIN_SECS - BEHIND_SECS)
    pulse = bumps(128, [beat + ARRIVAL_SECS + 2 * 0.055 for beat in heart], 0.055)
    rows = [
        f"{start_ms + k * 7.8125:.15E}".replace("E+", "E") + f"\t{2 + k % 128 / 1000}\t{1500 + 100 * value:.6f}"
        for k, value in enumerate(pulse)
    ]
    return "\n".join(head + rows)


def sensor_logger(heart) -> str:
    """An H10 as Polar Sensor Logger writes it: samples of a packet have the phone's time of its arrival."""
    start = datetime.fromtimestamp(BEGIN_SECS - BEHIND_SECS, UTC)
    rows = ["Phone timestamp;sensor timestamp [ns];timestamp [ms];ecg [uV]"]
    for k, value in enumerate(bumps(130, heart, 0.012)):
        sensor_ns = 599_616_050_941_733_632 + k * 1_000_000_000 // 130
        phone = (start + timedelta(seconds=k // 73 * 73 / 130)).isoformat(timespec="milliseconds")[:-6]
        rows.append(f"{phone};{sensor_ns};{k / 0.13:.1f};{1000 * value:.0f}")
    return "\n".join(rows)


@pytest.mark.parametrize(
    ("name", "table", "signal", "topic", "within_ms"),
    [
        ("2023-11-14_Session1_Shimmer_40AC_Calibrated_SD.csv", consensys, "ppg", "/table/ppg", 20),
        ("Polar_H10_12345678_20231114_221320_ECG.txt", sensor_logger, None, "/table/ecg", 5),
    ],
    ids=["consensys", "polar sensor logger"],
)
def test_a_table_of_a_device_s_program_is_joined(stage, session, heart, figure, name, table, signal, topic, within_ms):
    (stage.folder / name).write_text(table(heart))
    answer = joined(stage, name, session, *(["--signal", signal] if signal else []))
    assert answer.returncode == 0, answer.stderr
    assert "its clock was 37." in answer.stdout and "behind" in answer.stdout
    off_ms = 1e3 * first_secs(Path(answer.stdout.splitlines()[-1]), topic)
    figure(f"import: {table.__name__}, joined by heartbeats, {off_ms:+.1f} ms off")
    assert abs(off_ms) <= within_ms


def test_a_heart_that_beats_like_a_clock_is_refused(stage, session, heart):
    regular = [0.5 + 0.9 * k for k in range(300)]
    e4_zip(stage.folder / "e4.zip", regular)
    answer = joined(stage, "e4.zip", session)
    assert answer.returncode == 1
    assert "failed to place e4.zip in the session" in answer.stderr and "hint" in answer.stderr


def test_files_of_others_are_read_as_they_were_written(stage):
    rng = np.random.default_rng(2)
    ecg, eeg = rng.normal(size=2560), rng.normal(scale=20, size=(2, 2560))
    edf = edfio.Edf(
        [
            edfio.EdfSignal(ecg, 256, label="ECG", physical_dimension="mV"),
            edfio.EdfSignal(eeg[0], 256, label="EEG Fp1", physical_dimension="uV"),
            edfio.EdfSignal(eeg[1], 256, label="EEG Fp2", physical_dimension="uV"),
            edfio.EdfSignal(30 + rng.random(40), 4, label="Temp", physical_dimension="degC"),
        ],
        annotations=[edfio.EdfAnnotation(2.5, None, "tap")],
        starttime=time(22, 15),
        recording=edfio.Recording(startdate=date(2026, 1, 5)),
    )
    edf.write(stage.folder / "night.edf")
    bag = imported(stage, "night.edf")
    values = [value for wave in bags.messages(bag, "/file/ecg") for value in wave.content.samples]
    assert np.allclose(values, ecg, atol=2e-4)
    described = tables.described(bag)
    assert described["/humans/persons/p001/file/eeg_fp1"].channels == ["EEG Fp1", "EEG Fp2"]
    assert described["/humans/persons/p001/file/temp"].rate_hz == 4
    [tap] = bags.messages(bag, "/file/annotations")
    assert tap.content.label == "tap"
    start_ns = tables.stamp_ns(bags.messages(bag, "/file/ecg")[0])
    assert tables.stamp_ns(tap) - start_ns == 2_500_000_000
    assert start_ns == datetime(2026, 1, 5, 22, 15, tzinfo=UTC).timestamp() * 10**9


def imported(stage, file) -> Path:
    answer = stage.ask("import", file, "--out", stage.folder / "imported")
    assert answer.returncode == 0, answer.stderr
    return Path(answer.stdout.splitlines()[-1])


@pytest.mark.parametrize("codec", ["null", "deflate"])
def test_an_embrace_plus_is_read_as_fastavro_wrote_it(stage, codec):
    number = {"type": "array", "items": "float"}
    start = {"name": "timestampStart", "type": "long"}, {"name": "samplingFrequency", "type": "float"}
    sampled = {"type": "record", "name": "Sampled", "fields": [*start, {"name": "values", "type": number}]}
    peaks = {"name": "peaksTimeNanos", "type": {"type": "array", "items": "long"}}
    schema = {
        "type": "record",
        "name": "empatica",
        "namespace": "com.empatica",
        "fields": [
            {"name": "participantID", "type": ["null", "string"]},
            {
                "name": "rawData",
                "type": {
                    "type": "record",
                    "name": "RawData",
                    "fields": [
                        {"name": "eda", "type": sampled},
                        {"name": "bvp", "type": "Sampled"},
                        {"name": "systolicPeaks", "type": {"type": "record", "name": "Peaks", "fields": [peaks]}},
                    ],
                },
            },
        ],
    }
    skin = {"timestampStart": BEGIN_SECS * 10**6, "samplingFrequency": 4.0, "values": [0.25, 0.5, 0.75, 1.0]}
    none = {"timestampStart": 0, "samplingFrequency": 0.0, "values": []}
    peaks_ns = [BEGIN_NS + k * 800_000_000 for k in range(4)]
    raw = {"eda": skin, "bvp": none, "systolicPeaks": {"peaksTimeNanos": peaks_ns}}
    record = {"participantID": "a name", "rawData": raw}
    with (stage.folder / "day.avro").open("wb") as file:
        fastavro.writer(file, schema, [record], codec=codec)
    bag = imported(stage, "day.avro")
    values = [value for wave in bags.messages(bag, "/embrace_plus/eda") for value in wave.content.samples]
    assert values == [0.25, 0.5, 0.75, 1.0] and first_secs(bag, "/embrace_plus/eda") == 0
    intervals = [each.content.values[0] for each in bags.messages(bag, "/embrace_plus/systolic_peaks")]
    assert intervals == [800.0] * 3
    assert b"a name" not in b"".join(part.read_bytes() for part in bags.parts(bag))


def chunk(tag: int, content: bytes) -> bytes:
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def xdf() -> bytes:
    """A jittered stream by a clock that is behind and drifts, and a string."""
    chance = random.Random(4)
    file = b"XDF:" + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>')
    for number, (name, form, rate) in enumerate([("EEG", "float32", 100), ("Markers", "string", 0)], 1):
        header = (
            f'<?xml version="1.0"?><info><name>{name}</name><type>{name}</type><channel_count>1</channel_count>'
            f"<nominal_srate>{rate}</nominal_srate><channel_format>{form}</channel_format>"
            "<created_at>0</created_at></info>"
        )
        file += chunk(2, struct.pack("<I", number) + header.encode())
        for probe in range(6):
            at = 50 + 5 * probe
            file += chunk(4, struct.pack("<Idd", number, at, 1000 + 1e-5 * at))
    samples = b"".join(
        b"\x08" + struct.pack("<df", 50 + k / 100 + chance.gauss(0, 0.002), k) for k in range(2500)
    )
    file += chunk(3, struct.pack("<IBI", 1, 4, 2500) + samples)
    file += chunk(3, struct.pack("<IBBBd", 2, 1, 1, 8, 60.0) + b"\x01\x03tap")
    for number in (1, 2):
        footer = b'<?xml version="1.0"?><info><first_timestamp>0</first_timestamp></info>'
        file += chunk(6, struct.pack("<I", number) + footer)
    return file


def test_xdf_has_the_times_that_pyxdf_finds(stage):
    path = stage.folder / "lab.xdf"
    path.write_bytes(xdf())
    streams, _ = pyxdf.load_xdf(str(path))
    theirs = {stream["info"]["name"][0]: stream for stream in streams}
    bag = imported(stage, path)
    rows = [row for wave in bags.messages(bag, "/file/eeg") for row in tables.rows(wave)]
    assert [row[1][0] for row in rows] == list(theirs["EEG"]["time_series"][:, 0])
    [tap] = bags.messages(bag, "/file/markers")
    # Both count from the marker: the recorder's clock has no date.
    ours = np.array([(at_ns - tables.stamp_ns(tap)) / 1e9 for at_ns, _ in rows])
    expected = theirs["EEG"]["time_stamps"] - theirs["Markers"]["time_stamps"][0]
    assert np.abs(ours - expected).max() < 1e-4
    refused = stage.ask("import", path, "--signal", "eeg")
    assert refused.returncode == 2 and "omit --signal" in refused.stderr, refused.stderr


def test_bad_files_are_refused_with_a_hint(stage):
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("ACC.csv", b"0" * (300 << 20))
    files = {
        "bomb.zip": (bomb.getvalue(), "unpacks to more than"),
        "other.zip": (b"PK\x03\x04" + bytes(50), "the archive can't be unpacked"),
        "short.xdf": (b"XDF:\x04", "it contains no stream with samples"),
        "short.edf": (b"0       ", "it ends within its header"),
        "bad.avro": (b"Obj\x01\x00" + bytes(16), "its schema"),
    }
    for name, (content, reason) in files.items():
        (stage.folder / name).write_bytes(content)
        answer = stage.ask("import", name, "--out", stage.folder / "refused")
        assert answer.returncode == 1, (name, answer.stderr)
        assert reason in answer.stderr and "hint" in answer.stderr, (name, answer.stderr)
    assert not (stage.folder / "refused").exists()


@pytest.mark.parametrize("samples", [5999, 6000])
def test_a_window_that_ends_with_a_table_is_computed_and_a_shorter_one_is_not(stage, samples):
    chance = np.random.default_rng(3)
    rows = (f"{k / 100:.2f},{value:.5f}" for k, value in enumerate(chance.normal(size=samples)))
    (stage.folder / "emg.csv").write_text("time,emg_mV\n" + "\n".join(rows) + "\n")
    bag = imported(stage, "emg.csv")
    lines = [line.split(",") for line in (bag / "features.csv").read_text().splitlines()[1:]]
    starts = {start for start, length, *_ in lines if length == "30"}
    assert starts == ({"0.000", "30.000"} if samples == 6000 else {"0.000"})
    again = stage.ask("replay", bag, "--out", stage.folder / "again")
    assert again.returncode == 0, again.stderr
    [replayed] = (stage.folder / "again").iterdir()
    assert (replayed / "features.csv").read_text() == (bag / "features.csv").read_text()


def test_a_table_that_is_refused_leaves_no_bag(stage):
    rows = [f"{k / 4:.2f},{2 + k % 9 / 10}" for k in range(400)]
    lasts = {"far.csv": ("1000000,2", "after the one before it"), "back.csv": ("2,2", "before an earlier line")}
    for name, (last, reason) in lasts.items():
        (stage.folder / name).write_text("\n".join(["time [s],eda [uS]", *rows, last]))
        answer = stage.ask("import", name, "--signal", "eda", "--out", stage.folder / "refused")
        assert answer.returncode == 1 and "hint" in answer.stderr, answer.stderr
        assert "failed to follow the times: line 402 is" in answer.stderr and reason in answer.stderr
    assert not (stage.folder / "refused").exists()


def test_a_file_that_is_given_twice_counts_once(stage):
    e4_zip(stage.folder / "e4.zip", beats())
    answer = stage.ask("import", "e4.zip", "e4.zip", "--out", stage.folder / "imported")
    assert answer.returncode == 0, answer.stderr
    assert f"left out {SECS * 4} samples of eda with times that other samples already have" in answer.stderr
    bag = Path(answer.stdout.splitlines()[-1])
    values = [value for wave in bags.messages(bag, "/empatica_e4/eda") for value in wave.content.samples]
    assert len(values) == SECS * 4
