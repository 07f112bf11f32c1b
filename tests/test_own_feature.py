"""A feature that a user wrote as a ROS node or as a program: recorded raw, as it was computed, and left as it is."""

import os
import sys
from statistics import fmean

import pytest

import bags
import harness
from tables import described, stamp_ns

EXAMPLES = harness.ROOT / "examples"
STUDY = harness.ROOT / "studies/one_operator.toml"
PERSON = "/humans/persons/p001"
INPUT = f"{PERSON}/simulated/eda_fingers"
OUTPUT = f"{PERSON}/own/skin_unrest"
RISE = f"{PERSON}/own/skin_rise"
RECORDED_SECS = 25
DOCS = (harness.ROOT / "docs/own_features.md").read_text()


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """The bag of a session that heard a simulated operator, and the example beside it."""
    stage = harness.Stage(tmp_path_factory.mktemp("own_feature"), 97)
    out = stage.folder / "sessions"
    study = stage.folder / "study.toml"
    study.write_text(STUDY.read_text() + in_docs("toml").replace("examples/", f"{EXAMPLES}/"))
    monitor = stage.teampulse("run", study, "--duration", RECORDED_SECS, "--out", out)
    stage.teampulse("simulate", STUDY)
    example = stage.start(sys.executable, EXAMPLES / "own_feature.py", env=without_ros())
    assert monitor.ended(within_secs=60) == 0, monitor.report()
    assert example.is_running(), example.report()
    yield harness.the_bag(out)
    stage.close()


def in_docs(language: str) -> str:
    """The last piece of code in a language that the docs show."""
    return DOCS.rpartition(f"```{language}\n")[2].partition("```")[0]


def without_ros() -> dict[str, str]:
    """Python finds the stand-in for `rclpy` first."""
    return {"PYTHONPATH": os.pathsep.join([str(EXAMPLES / "without_ros"), *sys.path])}


def test_it_is_recorded_raw_and_as_it_was_described(bag):
    assert bags.origins(bag)[OUTPUT] == "raw"
    stream = described(bag)[OUTPUT]
    assert (stream.id, stream.device, stream.signal) == ("p001", "own", "other")
    assert (stream.channels, stream.units, stream.rate_hz) == (["unrest"], ["uS"], 1.0)
    assert stream.inputs == [INPUT]


def test_its_values_are_those_of_the_signal_in_the_bag(bag):
    waves = bags.messages(bag, INPUT)
    place = {stamp_ns(wave): k for k, wave in enumerate(waves)}
    answers = [each for each in bags.messages(bag, OUTPUT) if place.get(stamp_ns(each), 0) >= 3]
    assert len(answers) > RECORDED_SECS / 2
    for each in answers:
        last = place[stamp_ns(each)]
        second = [value for wave in waves[last - 3 : last + 1] for value in wave.content.samples]
        mean = fmean(second)
        assert list(each.content.values) == [fmean(abs(value - mean) for value in second)]


def test_features_of_any_numbers_run_on_it(bag):
    topic = f"{OUTPUT}/statistics/w30"
    newest = bags.messages(bag, topic)[-1]
    end_ns = stamp_ns(newest)
    answers = [each for each in bags.messages(bag, OUTPUT) if end_ns - 30e9 <= stamp_ns(each) < end_ns]
    mean = newest.content.values[described(bag)[topic].channels.index("mean")]
    assert mean == pytest.approx(fmean(each.content.values[0] for each in answers), rel=1e-12)


def test_a_replay_leaves_both_as_they_were(bag, tmp_path):
    stage = harness.Stage(tmp_path, 96)
    answer = stage.ask("replay", bag, "--out", tmp_path / "replay")
    assert answer.returncode == 0, answer.stderr
    replayed, recorded = bags.raw(harness.the_bag(tmp_path / "replay")), bags.raw(bag)
    assert replayed[OUTPUT] == recorded[OUTPUT]
    assert replayed[RISE] == recorded[RISE]


def test_what_a_worker_answers_is_recorded_at_the_times_of_what_it_looked_at(bag):
    stream = described(bag)[RISE]
    assert (stream.id, stream.channels, stream.units, stream.inputs) == ("p001", ["rise"], ["uS"], [INPUT])
    assert bags.origins(bag)[RISE] == "raw"
    waves = {stamp_ns(wave): wave.content.samples for wave in bags.messages(bag, INPUT)}
    rises = bags.messages(bag, RISE)
    assert len(rises) > RECORDED_SECS
    for rise in rises:
        samples = waves[stamp_ns(rise)]
        assert list(rise.content.values) == [samples[-1] - samples[0]]


@pytest.mark.parametrize("example", ["own_feature.py", "own_worker.py"])
def test_the_docs_show_it_whole(example):
    shebang, _, code = (EXAMPLES / example).read_text().partition("\n")
    assert shebang.startswith("#!")
    assert f"```python\n{code}```" in DOCS
