"""What is computed of a person live is what `extract --method causal` finds afterwards in the same samples,
bit for bit: also where a sensor failed, and where its computer went away and came back."""

from itertools import pairwise

import pytest

import bags
import harness
import tables
from windows import by_end, is_number, secs, windows

PERSON = "/humans/persons/p001"
WINDOWS_SECS = [10, 20]
RECORDED_SECS = 92
STUDY = f"""
[session]
name = "gaps"
[[sources]]
type = "people"
[features]
windows_secs = {WINDOWS_SECS}
[[sinks]]
type = "bag"
[simulate]
robots = 1
people = 1
[simulate.body]
script = [
  {{ sensor = "ecg",         from_secs = 8, to_secs = 11, what = "dead" }},
  {{ sensor = "eeg",         from_secs = 8, to_secs = 9,  what = "dead" }},
  {{ sensor = "eda_wrist",   from_secs = 3, to_secs = 9,  what = "dead" }},
  {{ sensor = "ppg",         from_secs = 9, to_secs = 12, what = "off_body" }},
  {{ sensor = "emg",         from_secs = 6, to_secs = 9,  what = "stuck" }},
  {{ sensor = "respiration", from_secs = 9, to_secs = 12, what = "stuck" }},
]
"""
# The events of an analysis, by the stream that has them.
HAPPENS = {
    "ecg": {"beat": "beats"},
    "ppg": {"pulse": "pulses"},
    "eda": {"response": "responses"},
    "emg": {"burst": "bursts"},
    "eeg": {"blink": "blinks"},
    "respiration": {"breath": "breaths"},
}
SENSORS = {
    "ecg": "heart",
    "ppg": "pulse",
    "eda_wrist": "skin",
    "eda_fingers": "skin",
    "emg": "muscle",
    "eeg": "brain",
    "respiration": "breath",
    "temperature": "skin_temperature",
    "acceleration": "movement",
}


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A session with sensors that fail, whose computer goes away for a moment, and for long."""
    stage = harness.Stage(tmp_path_factory.mktemp("gaps"), 95)
    out, study = stage.folder / "sessions", stage.study(STUDY)
    nobody = stage.study(STUDY.replace("people = 1", "people = 0"), "nobody.toml")
    monitor = stage.teampulse("run", study, "--out", out, "--duration", RECORDED_SECS)
    for simulated, running_secs in [(study, 25), (nobody, 3), (study, 14), (nobody, 21)]:
        simulator = stage.teampulse("simulate", simulated, "--duration", running_secs)
        assert simulator.ended(within_secs=60) == 0, simulator.report()
    stage.teampulse("simulate", study)
    assert monitor.ended(within_secs=120) == 0, monitor.report()
    yield harness.the_bag(out)
    stage.close()


def test_there_are_gaps_of_both_kinds(bag):
    begins = [secs(wave) for wave in bags.messages(bag, f"{PERSON}/simulated/ecg")]
    gaps_secs = sorted(after - before for before, after in pairwise(begins))[-2:]
    assert 1 < gaps_secs[0] < WINDOWS_SECS[0] < WINDOWS_SECS[-1] < gaps_secs[1]


@pytest.mark.parametrize("sensor", SENSORS)
def test_live_is_what_is_extracted_afterwards_bit_for_bit(bag, tmp_path, sensor):
    stage = harness.Stage(tmp_path, 94)
    topic = f"{PERSON}/simulated/{sensor}"
    stream = tables.described(bag)[topic]
    waves = heard(bag, topic)
    table = tables.write(waves, stream, tmp_path / "table.csv")
    # What ends behind the last sample is known at the end alone, by the rate of the stream or by that of the table.
    last_secs = max(at_ns for at_ns, _ in tables.rows(waves[-1])) / 1e9
    for window_secs in WINDOWS_SECS:
        extracted = tables.extracted(stage, table, stream, window_secs)
        live = windows(bag, f"{topic}/{SENSORS[sensor]}/w{window_secs}")
        afterwards = by_end(extracted["features"], window_secs)
        afterwards = {end: each for end, each in afterwards.items() if end <= last_secs}
        assert len(afterwards) > 20
        first_ns = min(afterwards)
        assert set(afterwards) == {end for end in live if first_ns <= end <= last_secs}
        for end, expected in afterwards.items():
            assert live[end] == expected, f"the window that ends at {end}"
    numbers = [value for window in afterwards.values() for value in window if is_number(value)]
    assert numbers
    for kind, leaf in HAPPENS.get(stream.signal, {}).items():
        happened = [secs(each) for each in bags.messages(bag, f"{topic}/{leaf}")]
        afterwards = [each["time_secs"] for each in extracted["events"] if each["kind"] == kind]
        assert sorted(happened) == afterwards


def heard(bag, topic) -> list:
    """The waves of a topic from the first one on that came after the description of its stream."""
    of_stream = (each for each in bags.messages(bag, "/teampulse/streams"))
    described = next(each for each in of_stream if each.content.name == topic and each.content.channels)
    waves = bags.messages(bag, topic)
    return [wave for wave in waves if wave.log_secs > described.log_secs]
