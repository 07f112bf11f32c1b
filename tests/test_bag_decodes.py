"""Every message of a bag decodes in the tools that others use."""

import json

import pytest
from rosbags.highlevel import AnyReader

import bags


@pytest.fixture(params=["demo_bag", "five_robots_bag"])
def bag(request):
    return request.getfixturevalue(request.param)


def test_rosbags_and_mcap_decode_every_message_alike(bag):
    by_rosbags = bags.decoded_by_rosbags(bag)
    assert by_rosbags == bags.decoded_by_mcap(bag)
    assert by_rosbags.total() > 1000


def test_every_topic_has_a_hash_that_rosbags_accepts(bag):
    with AnyReader([bag]) as reader:
        hashes = {each.topic: each.digest for each in reader.connections}
    assert hashes and all(each.startswith("RIHS01_") for each in hashes.values()), hashes


def test_info_counts_what_rosbags_counts(bag, stage):
    answer = stage.ask("info", bag, "--json")
    assert answer.returncode == 0, answer.stderr
    counts = {each["name"]: each["messages"] for each in json.loads(answer.stdout)["streams"]}
    with AnyReader([bag]) as reader:
        assert counts == {each.topic: each.msgcount for each in reader.connections}


def test_all_five_robots_are_in_it_with_what_they_offer_and_what_follows_from_it(bag):
    with AnyReader([bag]) as reader:
        topics = set(reader.topics)
    for robot in [f"/robot{k}" for k in range(1, 6)]:
        for topic in ["odom", "battery_state", "wifi", "diagnostics", "battery_state/use/w30"]:
            assert f"{robot}/{topic}" in topics


def test_streams_are_described_and_healthy_in_it(bag):
    described = {each.content.name for each in bags.messages(bag, "/teampulse/streams")}
    assert {f"/robot{k}/battery_state" for k in range(1, 6)} <= described
    statuses = {each.content.name: each.content for each in bags.messages(bag, "/teampulse/status")}
    for name in [f"/robot{k}/odom" for k in range(1, 6)]:
        assert statuses[name].lost_source == statuses[name].lost_queue == 0
