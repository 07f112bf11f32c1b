"""With both DDS peers, in both directions: every message, every hash, and every mismatch reported."""

import json
import re
from collections import Counter

import pytest

import bags
import harness
import ros_types

# What every session publishes.
OURS = ["/teampulse/streams", "/teampulse/status"]

SESSION = """
[session]
name = "test"
[[sources]]
type = "topics"
names = ["/bench*"]
"""


@pytest.mark.parametrize(
    "size, rate_hz, count",
    [(1024, 100, 500), (65536, 30, 150)],
    ids=["1 KiB x 100 Hz", "64 KiB x 30 Hz"],
)
def test_every_reliable_message_of_a_peer_is_in_the_bag(stage, peer, size, rate_hz, count):
    recorder, out = stage.record("/bench*")
    publisher = peer("publish", "/bench", "--size", size, "--rate", rate_hz, "--count", count)
    assert publisher.answer("sent")["acknowledged"]
    assert recorder.interrupt() == 0
    all_arrived(harness.the_bag(out), "/bench", count)


def test_megabyte_images_at_camera_rate_are_in_the_bag(stage, peer):
    if harness.rmem_max_bytes() < 4 << 20:
        pytest.skip(f"net.core.rmem_max is {harness.rmem_max_bytes()}: no room for an image")
    recorder, out = stage.record("/bench*")
    image = ("--size", 1 << 20, "--rate", 30, "--best-effort", "--depth", 5)
    publisher = peer("publish", "/bench", *image, "--count", 150)
    publisher.answer("sent")
    assert recorder.interrupt() == 0
    all_arrived(harness.the_bag(out), "/bench", 150)


def test_a_late_joiner_is_given_what_was_latched(stage, peer):
    publisher = peer("publish", "/bench", "--transient-local", "--subscribers", 0, "--count", 20)
    publisher.answer("sent")
    recorder, out = stage.record("/bench*")
    follower = peer("publish", "/bench_live", "--count", 1)
    follower.answer("sent")
    assert recorder.interrupt() == 0
    all_arrived(harness.the_bag(out), "/bench", 20)


def test_best_effort_and_reliable_publishers_of_a_topic_are_both_recorded(stage, peer):
    recorder, out = stage.record("/bench*")
    first = stage.cyclone("publish", "/bench", "--count", 100, "--settle-secs", 3)
    second = peer("publish", "/bench", "--count", 100, "--settle-secs", 3, "--best-effort")
    first.answer("sent"), second.answer("sent")
    assert recorder.interrupt() == 0
    tally = bags.tallies(harness.the_bag(out))["/bench"].summary()
    assert (tally["received"], tally["missing"], tally["corrupt"]) == (200, 0, 0)


@pytest.mark.parametrize("where", [[], ["--network"]], ids=["this machine", "network"])
def test_a_bag_played_back_reaches_every_peer(stage, peer, where):
    recorder, out = stage.record("/bench*")
    publisher = stage.cyclone("publish", "/bench", "--size", 1024, "--count", 300)
    publisher.answer("sent")
    assert recorder.interrupt() == 0
    publisher.close()
    subscriber = peer("subscribe", "/bench", "--count", 300)
    subscriber.answer("subscribed")
    player = stage.teampulse("play", harness.the_bag(out), *where)
    counted = subscriber.answer("messages")
    assert counted["messages"] == 300
    assert counted["topics"][0]["missing"] == counted["topics"][0]["corrupt"] == 0
    assert player.ended() == 0


def test_a_peer_sees_our_node_its_endpoints_and_their_type_hashes(stage):
    monitored(stage)
    seen = stage.cyclone("graph", "--until", *OURS).answer("nodes")
    [node] = [node for node in seen["nodes"] if node["name"] == "/teampulse"]
    endpoints = {endpoint["gid"]: endpoint for endpoint in seen["endpoints"]}
    published = [endpoints[gid] for gid in node["writers"] if gid in endpoints]
    assert {f"rt{topic}" for topic in OURS} <= {each["topic"] for each in published}
    assert "rt/bench" in {endpoints[gid]["topic"] for gid in node["readers"] if gid in endpoints}
    subscribed = [endpoints[gid] for gid in node["readers"] if gid in endpoints]
    assert {"rt/session/events", "rq/teampulse/list_parametersRequest"} <= {
        each["topic"] for each in subscribed
    }
    for endpoint in published + subscribed:
        announced = re.search(r"typehash=(RIHS01_[0-9a-f]{64});", endpoint["user_data"])
        assert announced, f"{endpoint} has no type hash"
        package, kind, _, name = endpoint["type"].removesuffix("_").split("::")
        known_hash = ros_types.type_hash(f"{package}/{kind}/{name}")
        assert known_hash in (None, announced[1]), endpoint


def test_no_topic_has_two_readers_of_ours(stage):
    """Not even where its name is wanted twice, and by `/**`."""
    twice = '[[sources]]\ntype = "topics"\nnames = ["/bench", "/**"]'
    monitored(stage, settings=twice)
    seen = stage.cyclone("graph", "--until", *OURS).answer("nodes")
    [node] = [node for node in seen["nodes"] if node["name"] == "/teampulse"]
    endpoints = {endpoint["gid"]: endpoint for endpoint in seen["endpoints"]}
    readers = [endpoints[gid] for gid in node["readers"] if gid in endpoints]
    names = Counter((reader["topic"], reader["type"]) for reader in readers)
    assert names[("rt/bench", "std_msgs::msg::dds_::UInt8MultiArray_")] == 1
    assert set(names.values()) == {1}, names


@pytest.mark.parametrize("late", [[], ["--listen-late"]], ids=["ready", "discovered late"])
def test_our_parameters_reach_any_node_on_cyclone(stage, late):
    monitored(stage)
    kind = "rcl_interfaces/srv/ListParameters"
    asker = stage.cyclone("ask", "/teampulse/list_parameters", kind, *late)
    # No prefixes, and any depth: an empty sequence and a zero, each in its place.
    asker.say((bytes([0, 1, 0, 0]) + bytes(16)).hex())
    reply = bytes.fromhex(asker.answer("reply")["reply"])
    assert b"start_type_description_service\0" in reply and b"use_sim_time\0" in reply


def test_our_gids_have_24_bytes_where_humble_is_spoken(stage):
    monitored(stage, env={"ROS_DISTRO": "humble"})
    nodes = stage.cyclone("graph", "--gid-bytes", 24, "--until", *OURS).answer("nodes")["nodes"]
    [node] = [node for node in nodes if node["name"] == "/teampulse"]
    assert all(len(gid) == 48 for gid in node["writers"])


def test_a_reader_that_asks_for_more_than_we_offer_is_reported(stage):
    monitor = monitored(stage)
    status = ("/teampulse/status", "--type", "teampulse_msgs/msg/StreamStatus")
    stage.cyclone("subscribe", *status, "--deadline-ms", 1)
    monitor.wait_for(r"/teampulse/status.*deadline|deadline.*/teampulse/status")


def test_a_missed_deadline_is_reported(stage):
    recorder, _ = stage.record("/bench*")
    publisher = stage.cyclone("publish", "/bench", "--deadline-ms", 200, "--count", 20)
    publisher.answer("sent")
    recorder.wait_for(r"/bench.*deadline|deadline.*/bench")


@pytest.mark.parametrize(
    "reliability", ["--best-effort", "--depth=1000"], ids=["best effort", "reliable"]
)
def test_injected_loss_is_reported_exactly_or_as_unknown(stage, reliability):
    lossy = "<Internal><Test><XmitLossiness>100</XmitLossiness></Test></Internal>"
    recorder, out = stage.record("/bench*")
    publisher = stage.cyclone(
        *("publish", "/bench", "--rate", 500, "--count", 3000, "--settle-secs", 3, reliability),
        env={"CYCLONEDDS_URI": lossy},
    )
    publisher.answer("sent", within_secs=60)
    assert recorder.interrupt() == 0
    bag = harness.the_bag(out)
    [stream] = [s for s in described(stage, bag)["streams"] if s["name"] == "/bench"]
    missing = bags.tallies(bag)["/bench"].summary()["missing"]
    assert missing > 100 if reliability == "--best-effort" else missing == 0
    assert stream["lost"] in (None, missing)


def monitored(stage, settings: str = "", **options) -> harness.Program:
    """A session that has something to report."""
    stage.cyclone("publish", "/bench")
    return stage.teampulse(
        "run", stage.study(SESSION + settings), "--out", stage.folder / "sessions", **options
    )


def all_arrived(bag, topic: str, count: int) -> None:
    """Whether all the numbered messages are in the bag, once each, unharmed and in order."""
    tally = bags.tallies(bag)[topic].summary()
    expected = {"received": count, "missing": 0, "corrupt": 0, "duplicates": 0, "out_of_order": 0}
    assert {key: tally[key] for key in expected} == expected


def described(stage, bag) -> dict:
    """What `info` says of a bag."""
    answer = stage.ask("info", bag, "--json")
    assert answer.returncode == 0, answer.stderr
    return json.loads(answer.stdout)
