"""What reliable publishers in another process send is in the bag, or counted as lost.

Nothing is lost at these rates on an idle machine, which `make bench-recorder` measures; on a busy one
something may be, and then its count is exact.
"""

import json

import pytest

import bags
import harness


def test_fifty_topics_of_a_thousand_messages_a_second(stage, figure):
    load = ("--topics", 50, "--rate", 1000, "--size", 64, "--count", 5000)
    every_message_is_accounted_for(stage, stage.cyclone, load, 5000, figure)


def test_ten_topics_of_five_thousand_kilobytes_a_second(stage, figure):
    load = ("--topics", 10, "--rate", 5000, "--size", 1024, "--count", 15000)
    every_message_is_accounted_for(stage, stage.cyclone, load, 15000, figure)


def test_bursts_as_a_heart_strap_gives_them(stage, peer, figure):
    load = ("--burst", 73, "--rate", 500, "--size", 1024, "--count", 73 * 40)
    lost = every_message_is_accounted_for(stage, peer, load, 73 * 40, figure)
    assert lost == 0, "bursts of a strap fit any queue"


@pytest.mark.parametrize("peer", ["fastdds"], indirect=True)
def test_what_its_publisher_overwrites_is_lost_before_it_comes_here(stage, peer):
    # An asynchronous writer that keeps one message overwrites what it has not sent yet.
    load = ("--burst", 100, "--count", 2000, "--rate", 2000, "--size", 64, "--depth", 1)
    recorder, out = stage.record("/bench")
    sent = peer("publish", "/bench", *load).answer("sent")
    assert sent["handed_over"] < sent["sent"], "it sent each message before the next was written"
    reported = recorder.wait_for(r"(\d+) messages? of /bench lost before reaching this machine")
    assert recorder.interrupt() in (0, 3), recorder.report()
    received = bags.counts(harness.the_bag(out))["/bench"]
    assert received == sent["handed_over"]
    # What comes before the first that is heard is not known to be lost.
    assert 0 < int(reported[1]) <= sent["sent"] - received


def every_message_is_accounted_for(stage, peer, load, sent: int, figure) -> int:
    """Each topic has what was sent, unharmed, once each and in order, but for what is counted as lost.

    Returns how many were lost.
    """
    recorder, out = stage.record("/bench*")
    publisher = peer("publish", "/bench", *load)
    assert publisher.answer("sent", within_secs=90)["acknowledged"]
    assert recorder.interrupt() in (0, 3), recorder.report()
    bag = harness.the_bag(out)
    answer = json.loads(stage.ask("info", bag, "--json").stdout)
    counted = {stream["name"]: stream["lost"] for stream in answer["streams"]}
    tallies = bags.tallies(bag)
    topics = load[load.index("--topics") + 1] if "--topics" in load else 1
    assert len(tallies) == topics
    for topic, tally in tallies.items():
        summary = tally.summary()
        assert summary["corrupt"] == summary["duplicates"] == summary["out_of_order"] == 0
        assert summary["received"] + counted[topic] == sent, topic
    lost = sum(counted[topic] for topic in tallies)
    figure(f"{' '.join(map(str, load))}: {lost} of {topics * sent} lost, each counted")
    return lost
