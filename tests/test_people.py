"""A simulated operator on ROS: heard, recorded raw, understood, replayed, and kept private."""

import numpy as np
import pytest

import bags
import harness

STUDY = harness.ROOT / "studies/one_operator.toml"
PERSON = "/humans/persons/p001"
ECG = f"{PERSON}/simulated/ecg"
SENSORS = {"ecg", "ppg", "eda_wrist", "eda_fingers", "emg", "eeg", "respiration", "temperature"} | {
    "acceleration"
}
RECORDED_SECS = 42
WINDOW_SECS = 30
RATE = "ECG_Rate_Mean"


@pytest.fixture(scope="module")
def operator(tmp_path_factory):
    """The bag of a session with a simulated operator, and what a peer saw of it on ROS meanwhile."""
    stage = harness.Stage(tmp_path_factory.mktemp("people"), 99)
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", STUDY, "--duration", RECORDED_SECS, "--out", out)
    simulator = stage.teampulse("simulate", STUDY)
    watcher = stage.cyclone("graph", "--seconds", RECORDED_SECS - 4)
    assert monitor.ended(within_secs=90) == 0, monitor.report()
    graph = watcher.answer("nodes")
    assert simulator.interrupt() == 0, simulator.report()
    yield harness.the_bag(out), graph
    stage.close()


@pytest.fixture(scope="module")
def bag(operator):
    return operator[0]


def test_every_signal_is_in_the_bag_raw_and_whole(bag):
    origins = bags.origins(bag)
    streams = described(bag)
    for sensor in SENSORS:
        topic = f"{PERSON}/simulated/{sensor}"
        assert origins[topic] == "raw"
        stream, waves = streams[topic], bags.messages(bag, f"/simulated/{sensor}")
        samples = sum(len(each.content.samples) for each in waves) / len(stream.channels)
        lasted_secs = stamp_secs(waves[-1]) - stamp_secs(waves[0])
        expected = stream.rate_hz * lasted_secs
        assert lasted_secs > RECORDED_SECS - 10
        assert abs(samples - expected) <= 0.25 * stream.rate_hz + 1, sensor


def test_every_signal_is_told_to_be_fine(bag):
    status = bags.messages(bag, "/teampulse/status")
    newest = {each.content.name: each.content for each in status}
    for sensor in SENSORS:
        health = newest[f"{PERSON}/simulated/{sensor}"]
        assert (health.state, health.reason) == (1, ""), sensor


def test_what_is_felt_follows_what_truly_is(bag, figure):
    truth = np.array([stamp_secs(each) for each in bags.messages(bag, "/truth/beats")])
    assert len(truth) > RECORDED_SECS / 2
    heard = np.array([stamp_secs(each) for each in bags.messages(bag, "/ecg/beats")])
    inside = truth[(truth > heard[0] - 0.1) & (truth < heard[-1] + 0.1)]
    off_secs = np.array([np.abs(heard - at).min() for at in inside])
    assert np.mean(off_secs < 0.05) > 0.98
    windows = bags.messages(bag, f"/ecg/heart/w{WINDOW_SECS}")
    place = described(bag)[f"{ECG}/heart/w{WINDOW_SECS}"].channels.index(RATE)
    errors = [relative_error(each, place, truth) for each in windows if usable(each, place, truth)]
    assert len(errors) >= 3
    beats_ms = 1e3 * np.median(off_secs)
    figure(f"people: heart rate off by {max(errors):.2%} at most, beats by {beats_ms:.1f} ms")
    assert max(errors) < 0.02


def test_a_replay_is_the_same_byte_for_byte(bag, tmp_path):
    stage = harness.Stage(tmp_path, 98)
    answer = stage.ask("replay", bag, "--out", tmp_path / "replay")
    assert answer.returncode == 0, answer.stderr
    expected, again = derived(bag), derived(harness.the_bag(tmp_path / "replay"))
    assert any(topic.startswith(ECG) for topic in expected)
    assert again.keys() == expected.keys()
    for topic, samples in expected.items():
        assert again[topic] == samples, f"{topic} differs"


def test_nothing_of_a_person_leaves_the_session(operator):
    _, graph = operator
    of_simulator = published(graph, "/teampulse_simulator")
    assert f"rt{ECG}" in of_simulator, of_simulator
    of_session = published(graph, "/teampulse")
    assert "rt/teampulse/status" in of_session, of_session
    assert not {topic for topic in of_session if PERSON in topic}


def test_what_a_study_names_is_published_and_nothing_else_of_a_person(stage):
    study = stage.study(f'publish = ["{ECG}/beats"]\n' + STUDY.read_text())
    stage.teampulse("run", study, "--out", stage.folder / "sessions")
    stage.teampulse("simulate", STUDY)
    watcher = stage.cyclone("graph", "--seconds", 60, "--until", f"{ECG}/beats")
    of_session = published(watcher.answer("nodes", within_secs=70), "/teampulse")
    assert {topic for topic in of_session if PERSON in topic} == {f"rt{ECG}/beats"}


def published(graph: dict, name: str) -> set[str]:
    """The topics on which a node publishes, as they are called on the wire."""
    [node] = [each for each in graph["nodes"] if each["name"] == name]
    participant = node["participant"][:24]
    return {
        each["topic"]
        for each in graph["endpoints"]
        if each["kind"] == "publisher" and each["gid"].startswith(participant)
    }


def described(bag) -> dict:
    """The newest description of each stream."""
    return {each.content.name: each.content for each in bags.messages(bag, "/teampulse/streams")}


def usable(window, place: int, truth) -> bool:
    """Whether a window has a rate and lies where the truth is known."""
    ends = stamp_secs(window)
    is_known = truth[0] < ends - WINDOW_SECS and ends < truth[-1] + 1
    return bool(is_known and window.content.reasons[place] == 0)


def relative_error(window, place: int, truth) -> float:
    """How far a window's heart rate is off the true one, as a share of it."""
    ends = stamp_secs(window)
    beats = truth[(truth >= ends - WINDOW_SECS) & (truth < ends)]
    true_bpm = 60.0 / np.mean(np.diff(beats))
    return abs(window.content.values[place] / true_bpm - 1.0)


def derived(bag) -> dict[str, list[tuple[int, bytes]]]:
    """All that was computed: log times and bytes, by topic."""
    origins = bags.origins(bag)
    return {topic: all_of for topic, all_of in bags.raw(bag).items() if origins[topic] == "derived"}


def stamp_secs(message) -> float:
    stamp = message.content.header.stamp
    return stamp.sec + stamp.nanosec * 1e-9
