"""Nothing that a reliable publisher in another process sends is lost on its way into the bag."""

import bags
import harness


def test_fifty_topics_of_a_thousand_messages_a_second(stage):
    load = ("--topics", 50, "--rate", 1000, "--size", 64, "--count", 5000)
    assert recorded(stage, stage.cyclone, load) == {f"/bench{k}": 5000 for k in range(50)}


def test_ten_topics_of_five_thousand_kilobytes_a_second(stage):
    load = ("--topics", 10, "--rate", 5000, "--size", 1024, "--count", 15000)
    assert recorded(stage, stage.cyclone, load) == {f"/bench{k}": 15000 for k in range(10)}


def test_bursts_as_a_heart_strap_gives_them(stage, peer):
    load = ("--burst", 73, "--rate", 500, "--size", 1024, "--count", 73 * 40)
    assert recorded(stage, peer, load) == {"/bench": 73 * 40}


def recorded(stage, peer, load) -> dict[str, int]:
    """How many of the messages are in the bag, unharmed, once each and in order."""
    recorder, out = stage.record("/bench*")
    publisher = peer("publish", "/bench", *load)
    assert publisher.answer("sent", within_secs=90)["acknowledged"]
    assert recorder.interrupt() == 0, recorder.report()
    counts = {}
    for topic, tally in bags.tallies(harness.the_bag(out)).items():
        summary = tally.summary()
        assert summary["corrupt"] == summary["duplicates"] == summary["out_of_order"] == 0
        counts[topic] = summary["received"]
    return counts
