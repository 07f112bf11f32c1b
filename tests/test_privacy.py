"""With the settings as they are, nothing of a person leaves the session: not one number, whoever
listens, and whatever he subscribes to."""

import os
import struct

import pytest

import bags
import harness
import wire
from conftest import leave_out

STUDY = harness.ROOT / "studies/one_operator.toml"
PERSON = "/humans/persons/"
RECORDED_SECS = 45


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
    heard = listener.answer("heard", within_secs=60)["heard"]
    of_monitor, of_simulator = wire.ports(monitor.pid), wire.ports(simulator.pid)
    assert monitor.ended(within_secs=60) == 0, monitor.report()
    sent = sniffer.stop()
    stage.close()
    # All participants share the ports on which they hear of each other; nobody sends from there.
    assert not {port for port in of_monitor & of_simulator if port in sent}
    datagrams = [[b"".join(sent.get(port, [])) for port in of] for of in (of_monitor, of_simulator)]
    return harness.the_bag(out), heard, *datagrams


def test_somebody_listens_to_all_that_there_is(overheard):
    _, heard, of_monitor, _ = overheard
    assert heard["rt/teampulse/status"] > 100
    assert heard[f"rt{PERSON}p001/simulated/ecg"] > 40
    assert any(b"teampulse/status" in sent for sent in of_monitor)


def test_every_sample_is_found_in_what_the_sensors_computer_sent(overheard):
    """So what is looked for would be found."""
    bag, _, _, of_simulator = overheard
    samples = numbers(bag, "/simulated/ecg")
    # The last are sent when nobody listens any more.
    assert len(samples & found(samples, of_simulator)) > 0.9 * len(samples)


def test_no_number_of_a_person_is_in_what_the_session_sent(overheard):
    bag, _, of_monitor, _ = overheard
    secret = numbers(bag, "")
    assert len(secret) > 10_000
    assert not found(secret, of_monitor)


def test_nor_is_there_a_word_of_what_was_computed_of_a_person(overheard):
    """A description tells how: of a state, from which heart rate in the baseline."""
    bag, _, of_monitor, _ = overheard
    computed = {topic for topic, origin in bags.origins(bag).items() if origin == "derived"}
    computed = {topic.encode() for topic in computed if topic.startswith(PERSON)}
    assert len(computed) > 20
    assert not {topic for topic in computed for sent in of_monitor if topic in sent}


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
