"""With the settings as they are, nothing of a person leaves the session: not one number, whoever
listens, and whatever he subscribes to."""

import os
import struct
from pathlib import Path
from typing import NamedTuple

import pytest

import bags
import harness
import wire
from conftest import leave_out

STUDY = harness.ROOT / "studies/one_operator.toml"
PERSON = "/humans/persons/"
RECORDED_SECS = 45
# Where the health of streams is published.
HEALTH = {
    "/teampulse/status": "teampulse_msgs/msg/StreamStatus",
    "/teampulse/clocks": "teampulse_msgs/msg/Event",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}


@pytest.fixture(scope="module")
def overheard(tmp_path_factory):
    """The bag of a session with an operator, and what it and the simulator sent meanwhile, while
    somebody subscribed to everything."""
    if not os.environ.get("TEST_ISOLATED"):
        leave_out("without a network of its own no test can hear all that is sent")
    stage = harness.Stage(tmp_path_factory.mktemp("privacy"), 92)
    out, sniffer = stage.folder / "sessions", wire.Sniffer()
    monitor = stage.teampulse("run", STUDY, "--duration", RECORDED_SECS, "--out", out)
    simulator = stage.teampulse("simulate", STUDY)
    listener = stage.cyclone("eavesdrop", "--best-effort", "--seconds", RECORDED_SECS - 15)
    health = {topic: stage.cyclone(*subscription(topic, kind)) for topic, kind in HEALTH.items()}
    heard = listener.answer("heard", within_secs=60)["heard"]
    health = {
        topic: [bytes.fromhex(each) for each in listener.answer("samples")["samples"]]
        for topic, listener in health.items()
    }
    graph = stage.cyclone("graph", "--until", "/teampulse/status").answer("nodes")
    of_monitor, of_simulator = wire.ports(monitor.pid), wire.ports(simulator.pid)
    assert monitor.ended(within_secs=60) == 0, monitor.report()
    sent = sniffer.stop()
    stage.close()
    # All participants share the ports on which they hear of each other; nobody sends from there.
    assert not {port for port in of_monitor & of_simulator if port in sent}
    datagrams = [[b"".join(sent.get(port, [])) for port in of] for of in (of_monitor, of_simulator)]
    return Overheard(harness.the_bag(out), heard, *datagrams, health, graph)


class Overheard(NamedTuple):
    """What was recorded, and what of it somebody could know."""

    bag: Path
    heard: dict[str, int]
    of_monitor: list[bytes]
    of_simulator: list[bytes]
    health: dict[str, list[bytes]]
    graph: dict


def subscription(topic: str, kind: str) -> list:
    """To the messages of a topic, of which the first are kept."""
    seconds = ("--seconds", RECORDED_SECS - 15)
    return ["subscribe", topic, "--type", kind, "--best-effort", *seconds, "--keep", 1000]


def test_somebody_listens_to_all_that_there_is(overheard):
    heard, of_monitor = overheard.heard, overheard.of_monitor
    assert heard["rt/teampulse/status"] > 100
    assert heard[f"rt{PERSON}p001/simulated/ecg"] > 40
    assert any(b"teampulse/status" in sent for sent in of_monitor)


def test_every_sample_is_found_in_what_the_sensors_computer_sent(overheard):
    """So what is looked for would be found."""
    bag, of_simulator = overheard.bag, overheard.of_simulator
    samples = numbers(bag, "/simulated/ecg")
    # The last are sent when nobody listens any more.
    assert len(samples & found(samples, of_simulator)) > 0.9 * len(samples)


def test_no_number_of_a_person_is_in_what_the_session_sent(overheard):
    bag, of_monitor = overheard.bag, overheard.of_monitor
    secret = numbers(bag, "")
    assert len(secret) > 10_000
    assert not found(secret, of_monitor)


def test_nor_is_there_a_word_of_what_was_computed_of_a_person(overheard):
    """A description has the method: of a state, from which heart rate in the baseline."""
    bag, of_monitor = overheard.bag, overheard.of_monitor
    computed = {topic for topic, origin in bags.origins(bag).items() if origin == "derived"}
    computed = {topic.encode() for topic in computed if topic.startswith(PERSON)}
    assert len(computed) > 20
    assert not {topic for topic in computed for sent in of_monitor if topic in sent}


def test_nor_who_it_is_or_how_the_sensors_are(overheard):
    """The id stands in the names of the sensors' own topics, and of our readers of these, alone."""
    health = overheard.health
    assert len(health["/teampulse/status"]) > 50 and len(health["/diagnostics"]) > 5
    assert not [each for messages in health.values() for each in messages if b"p001" in each]
    [node] = [each for each in overheard.graph["nodes"] if each["name"] == "/teampulse"]
    published = [
        each["topic"] for each in overheard.graph["endpoints"] if each["gid"] in node["writers"]
    ]
    assert published and not [topic for topic in published if "p001" in topic]
    assert not [each for each in overheard.graph["nodes"] if "p001" in each["name"]]


def numbers(bag, topic_ends: str) -> set[bytes]:
    """The bytes of all numbers about people that have so many digits that no other is the same."""
    about_people = (each for each in bags.messages(bag, topic_ends) if PERSON in each.topic)
    all_of = (value for message in about_people for value in values(message.content))
    return {struct.pack("<d", value) for value in all_of if len(repr(float(value))) > 14}


def values(content) -> list[float]:
    for field in ("samples", "values"):
        if hasattr(content, field):
            return list(getattr(content, field))
    return [content.value]


def found(wanted: set[bytes], datagrams: list[bytes]) -> set[bytes]:
    """Which of these numbers stand anywhere in what was sent."""
    return {
        sent[at : at + 8]
        for sent in datagrams
        for at in range(len(sent) - 7)
        if sent[at : at + 8] in wanted
    }
