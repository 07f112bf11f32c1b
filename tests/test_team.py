"""Robots and people in one view: who commands which robot, which robot needs someone, who answers."""

import math

import pytest

import bags
import harness

RECORDED_SECS = 50
OFFLINE_AFTER_SECS = 5
# Commands closer together than this are one intervention.
PAUSE_SECS = 2
# A robot that drives at a metre a second is there after so long without another command.
CALM_SECS = 9.5
# Of the operator of this seed four commands go to the robot that is out of reach, and two to the other.
STUDY = """
[session]
name = "team"

[[sources]]
type      = "robots"
namespace = "/robot*"
commands  = ["goal_pose"]

[[sources]]
type = "people"

[[sinks]]
type = "bag"

[simulate]
robots        = 2
people        = 1
seed          = 3
boxes         = 0
obstacles     = 0
top_speed_mps = 1

[simulate.task]
baseline_secs    = 2
level_secs       = 300
commands_per_min = 10

[[simulate.script]]
robot     = "robot1"
from_secs = 20
to_secs   = 40
what      = "outage"
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """The bag of a session that joins when the operator and the robots are at work already."""
    stage = harness.Stage(tmp_path_factory.mktemp("team"), 97)
    study, out = stage.study(STUDY), stage.folder / "sessions"
    simulator = stage.teampulse("simulate", study)
    seen = stage.ask("scan", "--seconds", 4)
    assert "/robot1/goal_pose" in seen.stdout, "a topic is there before its first message"
    monitor = stage.teampulse("run", study, "--duration", RECORDED_SECS, "--out", out)
    assert monitor.ended(within_secs=100) == 0, monitor.report()
    assert simulator.interrupt() == 0, simulator.report()
    yield harness.the_bag(out)
    stage.close()


def test_whoever_joins_late_gets_the_phases_that_were_with_their_times(bag):
    phases = bags.messages(bag, "/task/phases")
    past = [(each.content.label, each.content.duration_secs) for each in phases]
    assert past == [("baseline", 2.0), ("1-back", 300.0)]
    begun_secs = [stamp_secs(each) for each in phases]
    assert begun_secs[1] - begun_secs[0] == pytest.approx(2.0, abs=1e-6)
    assert begun_secs[1] < phases[1].log_secs - 1, "it began before it was heard of"


def test_every_command_is_in_the_bag_as_what_a_person_put_in(bag):
    streams = {each.content.name: each.content for each in bags.messages(bag, "/teampulse/streams")}
    for robot in ("robot1", "robot2"):
        topic = f"/{robot}/goal_pose"
        assert bags.origins(bag)[topic] == "raw"
        assert (streams[topic].signal, streams[topic].id) == ("input", robot)
        given_secs = [at for at, to in commands(bag) if to == robot]
        sent_secs = [stamp_secs(each) for each in bags.messages(bag, topic)]
        assert sent_secs == pytest.approx(given_secs, abs=0.1)


def test_interventions_are_the_commands_that_were_truly_given(bag):
    expected = []
    for robot in ("robot1", "robot2"):
        run: list[float] = []
        for at, _ in [each for each in commands(bag) if each[1] == robot] + [(math.inf, robot)]:
            if run and at - run[-1] > PAUSE_SECS:
                expected.append((run[0], f"{robot} goal_pose", len(run), run[-1] - run[0]))
                run = []
            run.append(at)
    events = sorted(bags.messages(bag, "/team/interventions"), key=stamp_secs)
    assert len(events) >= 5
    assert {each.content.kind for each in events} == {"intervention"}
    for event, (began, label, count, lasted) in zip(events, sorted(expected), strict=True):
        assert (event.content.label, event.content.value) == (label, count)
        assert stamp_secs(event) == pytest.approx(began, abs=0.1)
        assert event.content.duration_secs == pytest.approx(lasted, abs=0.1)


def test_a_robot_drives_where_it_is_sent(bag):
    path = [
        (stamp_secs(each), each.content.pose.pose.position)
        for each in bags.messages(bag, "/robot2/odom")
    ]
    goals = [
        (stamp_secs(each), each.content.pose.position)
        for each in bags.messages(bag, "/robot2/goal_pose")
    ]
    ends = [at for at, _ in goals[1:]] + [path[-1][0]]
    calm = [(goal, end) for goal, end in zip(goals, ends) if end - goal[0] > CALM_SECS]
    assert len(calm) >= 2
    for (sent, goal), _ in calm:
        way_m = [distance_m(at, goal) for secs, at in path if sent <= secs < sent + CALM_SECS]
        assert min(way_m) < max(0.4, 0.2 * way_m[0]), way_m[::40]


def test_an_alert_is_raised_answered_and_over_as_scripted(bag, figure):
    heard_secs = [each.log_secs for each in bags.messages(bag, "/robot1/odom")]
    silence = max(range(len(heard_secs) - 1), key=lambda k: heard_secs[k + 1] - heard_secs[k])
    gone, back = heard_secs[silence], heard_secs[silence + 1]
    assert back - gone > 15
    raised = gone + OFFLINE_AFTER_SECS
    answered = min(at for at, robot in commands(bag) if robot == "robot1" and at > raised)
    alerts = bags.messages(bag, "/team/alerts")
    reported = [(each.content.kind, each.content.label) for each in alerts]
    assert reported == [
        ("fault", "robot1 needs someone: offline"),
        ("marker", "robot1 was answered: offline"),
        ("marker", "robot1 no longer needs someone: offline"),
    ]
    # Its other topics fall silent and come back up to a second before and after.
    assert stamp_secs(alerts[0]) == pytest.approx(raised, abs=1)
    assert stamp_secs(alerts[1]) == pytest.approx(answered, abs=0.1)
    assert stamp_secs(alerts[2]) == pytest.approx(back, abs=1)
    answered_secs, lasted_secs = alerts[1].content.value, alerts[2].content.duration_secs
    assert answered_secs == pytest.approx(stamp_secs(alerts[1]) - stamp_secs(alerts[0]), abs=1e-6)
    assert lasted_secs == pytest.approx(stamp_secs(alerts[2]) - stamp_secs(alerts[0]), abs=1e-6)
    figure(f"team: an alert of {lasted_secs:.1f} s was answered after {answered_secs:.1f} s")


def test_the_state_of_the_team_is_that_of_its_people_and_robots(bag):
    [stream] = [
        each.content
        for each in bags.messages(bag, "/teampulse/streams")
        if each.content.name == "/team/state"
    ][-1:]
    alerts = [stamp_secs(each) for each in bags.messages(bag, "/team/alerts")]

    def state(at_secs: float) -> dict:
        states = bags.messages(bag, "/team/state")
        nearest = min(states, key=lambda each: abs(stamp_secs(each) - at_secs))
        return dict(zip(stream.channels, nearest.content.values))

    before, waiting, answered = (state(at) for at in (alerts[0] - 3, alerts[1] - 1, alerts[1] + 2))
    assert (before["people"], before["robots_online"], before["robots_per_person"]) == (1, 2, 2)
    assert (before["robots_in_need"], math.isnan(before["unanswered_secs"])) == (0, True)
    assert (waiting["robots_online"], waiting["robots_in_need"]) == (1, 1)
    assert 0 < waiting["unanswered_secs"] < alerts[1] - alerts[0] + 1
    assert (answered["robots_online"], answered["robots_in_need"]) == (1, 0)


def test_a_replay_computes_the_same_of_the_team_byte_for_byte(bag, tmp_path):
    stage = harness.Stage(tmp_path, 96)
    answer = stage.ask("replay", bag, "--out", tmp_path / "replay")
    assert answer.returncode == 0, answer.stderr
    origins, expected = bags.origins(bag), bags.raw(bag)
    again = bags.raw(harness.the_bag(tmp_path / "replay"))
    derived = {topic for topic, origin in origins.items() if origin == "derived"}
    assert {"/team/state", "/team/alerts", "/team/interventions"} <= derived
    for topic in derived:
        assert again[topic] == expected[topic], f"{topic} differs"


def commands(bag) -> list[tuple[float, str]]:
    """What the operator truly sent to which robot, and when [s]."""
    commands = bags.messages(bag, "/task/commands")
    return [(stamp_secs(each), f"robot{each.content.value:.0f}") for each in commands]


def distance_m(one, other) -> float:
    return math.hypot(one.x - other.x, one.y - other.y)


def stamp_secs(message) -> float:
    stamp = message.content.header.stamp
    return stamp.sec + stamp.nanosec * 1e-9
