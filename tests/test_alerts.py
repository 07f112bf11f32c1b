"""Alerts that a study asks for, from the study to the bag, and again in a replay."""

import pytest

import bags
import harness

RECORDED_SECS = 45
STUDY = """
[session]
name = "alerts"

[[sources]]
type      = "robots"
namespace = "/robot*"

[[sources]]
type = "people"

[features]
windows_secs = [10]

[[alerts]]
stream  = "/robot1/*"
channel = "signal_level"
below   = 0
tier    = "act"
text    = "robot1 has a link"
silent_secs = 4

[[alerts]]
stream   = "/humans/persons/*/*/ecg/heart/w10"
channel  = "ECG_Rate_Mean"
above    = 20
for_secs = 2
tier     = "note"

[[alerts]]
stream = "/robot9/odom"
above  = 1

[[sinks]]
type = "bag"

[simulate]
robots = 1
people = 1
seed   = 3

[[simulate.script]]
robot     = "robot1"
from_secs = 15
to_secs   = 30
what      = "outage"
"""
LINK = "robot1 has a link (signal_level below 0 dBm)"


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    stage = harness.Stage(tmp_path_factory.mktemp("alerts"), 91)
    study, out = stage.study(STUDY), stage.folder / "sessions"
    simulator = stage.teampulse("simulate", study)
    checked = stage.ask("check", study, "--seconds", 5)
    monitor = stage.teampulse("run", study, "--duration", RECORDED_SECS, "--out", out)
    assert monitor.ended(within_secs=100) == 0, monitor.report()
    simulator.interrupt()
    bag = harness.the_bag(out)
    again = stage.ask("replay", bag, "--out", stage.folder / "replay")
    assert again.returncode == 0, again.stderr
    yield checked, monitor, bag, harness.the_bag(stage.folder / "replay")
    stage.close()


def labels(bag, topic):
    return [(each.content.kind, each.content.label) for each in bags.messages(bag, topic)]


def test_check_names_an_alert_that_watches_nothing(session):
    checked, *_ = session
    assert "the pattern `/robot9/odom` of an alert matches no received stream" in checked.stdout


def test_an_alert_on_a_robot_is_unknown_while_the_robot_is_silent(session):
    _, _, bag, _ = session
    own = [each for each in labels(bag, "/team/alerts") if LINK in each[1]]
    raised = ("fault", f"robot1 needs someone now: {LINK}")
    lost = ("marker", f"robot1 may still need someone, no value comes: {LINK}")
    assert own[:3] == [raised, lost, raised]
    first = next(each.content for each in bags.messages(bag, "/team/alerts") if each.content.label == raised[1])
    assert -100 < first.value < 0, "the number that was beyond the limit"


def test_an_alert_on_a_person_is_on_a_stream_of_the_person(session):
    _, _, bag, _ = session
    topics = [each for each in bags.origins(bag) if each.startswith("/humans/persons/") and each.endswith("/alerts")]
    assert len(topics) == 1
    kind, label = labels(bag, topics[0])[0]
    person = topics[0].split("/")[3]
    assert kind == "fault"
    assert label.startswith(f"{person} is worth a look: ECG_Rate_Mean of "), label
    assert label.endswith("/ecg/heart above 20 1/min for 2 s"), label
    assert all(person not in label for _, label in labels(bag, "/team/alerts"))


def test_the_terminal_says_the_same(session):
    _, monitor, bag, _ = session
    assert f"robot1 needs someone now: {LINK}" in monitor.stdout + monitor.stderr
    assert "is worth a look: ECG_Rate_Mean" in monitor.stdout + monitor.stderr
    assert "alert 3 of the study watches nothing" in monitor.stdout + monitor.stderr


def test_a_replay_has_the_same_alerts(session):
    _, _, bag, again = session
    topics = [each for each in bags.origins(bag) if each.endswith("/alerts")]
    assert len(topics) == 2
    for topic in topics:
        assert bags.raw(again)[topic] == bags.raw(bag)[topic]
