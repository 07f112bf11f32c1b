"""Two publishers of one topic, a driver that restarts, and a simulation whose time a session follows."""

import bags
import harness

STUDY = """
[session]
name = "twice"
[[sources]]
type = "people"
[[sources]]
type = "robots"
namespace = "/robot*"
[[sources]]
type = "topics"
names = ["/**"]
[[sinks]]
type = "bag"
tidy = false
[simulate]
robots = 1
people = 1
"""
ECG = "/humans/persons/p001/simulated/ecg"


def test_two_publishers_of_a_person_are_no_go_and_kept_apart(stage):
    study, out = stage.study(STUDY), stage.folder / "sessions"
    stage.teampulse("simulate", study).wait_for("simulating")
    stage.teampulse("simulate", study, "--seed", 5).wait_for("simulating")
    checked = stage.teampulse("check", study, "--out", stage.folder, "--seconds", 4)
    recorded = stage.teampulse("run", study, "--out", out, "--duration", 4)
    assert checked.ended() == 5
    lines = checked.stdout.splitlines()
    assert lines[-1] == "no-go"
    assert any(f"a single publisher of {ECG}" in line for line in lines), checked.stdout
    assert recorded.ended() == 0, recorded.report()

    bag = harness.the_bag(out)
    publishers = {
        topic: metadata["teampulse_publisher"]
        for topic, metadata in bags.channel_metadata(bag).items()
        if topic.startswith(ECG) and "teampulse_publisher" in metadata
    }
    assert set(publishers) == {f"{ECG}/publisher_2"}
    faults = [each.content.label for each in bags.messages(bag, "/session/events")]
    assert any(label.startswith(f"{ECG}: a second publisher") for label in faults), faults
    features = [topic for topic in bags.origins(bag) if topic.startswith(f"{ECG}/publisher_2/")]
    assert features == []
    again = stage.ask("replay", bag, "--out", stage.folder / "again")
    assert again.returncode == 0, again.stderr
    assert derived(harness.the_bag(stage.folder / "again")) == derived(bag)
    last = [
        each.content for each in bags.messages(bag, "/teampulse/status") if each.content.name == ECG
    ][-1]
    assert last.reason.startswith("2 publishers: "), last


def derived(bag) -> dict[str, list[tuple[int, bytes]]]:
    origins = bags.origins(bag)
    return {topic: all_of for topic, all_of in bags.raw(bag).items() if origins[topic] == "derived"}


def test_a_driver_that_restarts_is_the_same_stream(stage):
    study, out = stage.study(STUDY), stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out)
    for _ in range(2):
        simulator = stage.teampulse("simulate", study)
        simulator.wait_for("simulating")
        stage.cyclone("graph", "--node", "/teampulse_simulator", "--until", ECG).answer("nodes")
        assert simulator.interrupt() == 0
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    assert not [topic for topic in bags.origins(bag) if "/publisher_" in topic]
    labels = [each.content.label for each in bags.messages(bag, "/session/events")]
    assert not [label for label in labels if "publisher" in label]


def test_a_session_and_a_simulation_started_together_find_each_other_s_clock(stage):
    study = stage.study(STUDY.replace('name = "twice"', 'name = "twice"\nclock = "/clock"'))
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out, "--duration", 2)
    stage.teampulse("simulate", study)
    assert monitor.ended() == 0, monitor.report()
    odometry = [each.log_secs for each in bags.messages(harness.the_bag(out), "/robot1/odom")]
    assert len(odometry) > 5
    assert odometry[-1] < 1e6, "in simulated time, which begins at zero"
