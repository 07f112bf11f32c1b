"""What `check` and `scan` say of a team before it is recorded, and who hears of a demo."""

import contextlib
import json
import os
import subprocess
import tomllib
from pathlib import Path

import pytest

import harness

TEAM = """
[session]
name = "team"
[[sources]]
type = "robots"
namespace = "/robot*"
required = ["battery", "link"]
[[sinks]]
type = "bag"
[simulate]
robots = 3
"""


@pytest.fixture
def team(stage) -> Path:
    """The study of a team that is there."""
    study = stage.study(TEAM)
    stage.teampulse("simulate", study).wait_for("simulating")
    return study


def test_check_says_go_and_holds_each_robot_against_the_profile(stage, team):
    answer = stage.ask("check", team, "--out", stage.folder)
    assert answer.returncode == 0, answer.stdout
    lines = answer.stdout.splitlines()
    robots = [line for line in lines if line.startswith("robot ")]
    assert [line.split()[1] for line in robots] == ["robot1", "robot2", "robot3"]
    assert all("meets the profile" in line for line in robots)
    assert lines[-1] == "go"


def test_check_says_no_go_where_nobody_is(stage):
    answer = stage.ask("check", stage.study(TEAM), "--seconds", 2, "--out", stage.folder)
    assert answer.returncode == 5
    assert answer.stdout.splitlines()[-1] == "no-go"


def test_a_study_that_names_nothing_is_wrong(stage):
    answer = stage.ask("check", stage.study(""), "--seconds", 1, "--out", stage.folder)
    assert answer.returncode == 4, answer.stdout
    assert "study    ok" not in answer.stdout
    assert "it has no [[sources]]: nothing is watched" in answer.stderr and "teampulse scan" in answer.stderr


# Devices of this computer, and the node of a microphone, none of which is there.
ABSENT = """
[[sources]]
type = "ttl"
port = "/dev/absent"
[[sources]]
type = "camera"
device = "absent"
[[sources]]
type = "ros_audio"
topic = "/absent/audio"
person = "p001"
"""


def test_devices_that_cannot_be_opened_are_no_go_and_missing_in_the_summary(stage, team):
    study = stage.study(TEAM + ABSENT)
    answer = stage.ask("check", study, "--out", stage.folder)
    assert answer.returncode == 5, answer.stdout
    wanted = ["ttl: failed to open /dev/absent", "camera: failed to", "/absent/audio: no audio is published on this topic"]
    for words in wanted:
        assert f"missing  {words}" in answer.stdout, answer.stdout
    answer = stage.ask("run", study, "--duration", 12, "--out", stage.folder / "out")
    assert answer.returncode == 5, answer.stderr
    summary = (harness.the_bag(stage.folder / "out") / "summary.md").read_text()
    assert all(f"- Missing during the whole session: {words}" in summary for words in wanted), summary


def test_check_asks_for_the_room_that_the_study_keeps_free(stage, team):
    text = TEAM.replace('type = "bag"', 'type = "bag"\nkeep_free_mib = 1000000000')
    study = stage.study(text, "room.toml")
    answer = stage.ask("check", study, "--out", stage.folder)
    assert answer.returncode == 1, answer.stdout
    [missing] = [line for line in answer.stdout.splitlines() if line.startswith("missing")]
    assert "the study keeps 1000000000 MiB free (keep_free_mib)" in missing
    refused = stage.ask("run", study, "--out", stage.folder / "sessions", "--duration", 1)
    assert refused.returncode == 1 and "keep_free_mib" in refused.stderr, refused.stderr
    assert not (stage.folder / "sessions").exists()


def test_a_recording_begins_in_the_fallback_where_nothing_can_be_recorded(stage, team):
    no_folder, fallback = stage.folder / "file", stage.folder / "other disk"
    no_folder.write_text("")
    fallback.mkdir()
    study = stage.study(TEAM.replace('type = "bag"', f'type = "bag"\nfallback = "{fallback}"'), "two.toml")
    note = f"is a file, not a folder to write into: the recording starts in {fallback}"
    answer = stage.ask("check", study, "--out", no_folder)
    assert answer.returncode == 0 and note in answer.stdout, answer.stdout
    session = stage.ask("run", study, "--out", no_folder, "--duration", 2)
    assert session.returncode == 0 and note in session.stdout + session.stderr, session.stderr
    [bag] = fallback.iterdir()
    assert stage.ask("info", bag).returncode == 0


def test_check_lists_robots_and_topics_of_people_that_the_study_does_not_name(stage, team):
    sources = '[[sources]]\ntype = "robots"\nnamespace = "/robot1"\n[[sources]]\ntype = "people"\n'
    odd = "/humans/persons/p001/h10/hr"
    other = stage.cyclone("send", odd, "--type", "std_msgs/msg/String", "--subscribers", 0)
    other.answer("matched")
    lines = stage.ask("check", stage.study(sources, "one.toml"), "--out", stage.folder).stdout.splitlines()
    notes = [line.removeprefix("note     ") for line in lines if line.startswith("note ")]
    for robot in ("robot2", "robot3"):
        assert any(note.startswith(f"robot {robot} is present, but the study") for note in notes), lines
    assert not any(note.startswith("robot robot1 ") for note in notes), lines
    assert any(note.startswith(f"{odd} is not recorded") and "std_msgs/msg/String" in note for note in notes), lines


def test_check_says_who_was_not_found_and_is_no_go_where_nobody_is_there(stage):
    people = '[[sources]]\ntype = "people"\n'
    alpha = '[[sources]]\ntype = "robots"\nnamespace = "/alpha*"\n'
    for sources in (alpha, people, alpha + people):
        answer = stage.ask("check", stage.study(sources), "--seconds", 2, "--out", stage.folder)
        lines = answer.stdout.splitlines()
        assert answer.returncode == 5, answer.stdout
        assert lines[-1] == "no-go"
        if "robots" in sources:
            assert {"robot    none  no robot matches /alpha*", "missing  no robot matches /alpha*"} < set(lines)
        if "people" in sources:
            assert "missing  no person matches /humans/persons/*" in lines


def test_check_says_go_where_not_all_are_there_and_none_is_required(stage, team):
    text = '[[sources]]\ntype = "robots"\nnamespace = "/robot*"\n[[sources]]\ntype = "people"\n'
    answer = stage.ask("check", stage.study(text, "both.toml"), "--out", stage.folder)
    assert answer.returncode == 0, answer.stdout
    assert "person   none  no person matches /humans/persons/*" in answer.stdout.splitlines()
    strict = text.replace('"/robot*"\n', '"/alpha*"\nrequired = ["battery"]\n')
    answer = stage.ask("check", stage.study(strict, "strict.toml"), "--seconds", 2, "--out", stage.folder)
    assert answer.returncode == 5
    assert "missing  no robot matches /alpha*" in answer.stdout.splitlines()


def test_check_says_what_people_lack_and_whose_phases_count(stage):
    people = '[[sources]]\ntype = "people"\n[simulate]\nrobots = 1\npeople = 1\n'
    study = stage.study(people + '[[phases]]\nname = "baseline"\nfrom_secs = 0\n')
    stage.teampulse("simulate", study).wait_for("simulating")
    undescribed = "/humans/persons/p009/own/ecg"
    other = stage.cyclone("send", undescribed, "--type", "teampulse_msgs/msg/Wave", "--subscribers", 0)
    other.answer("matched")
    lines = stage.ask("check", study, "--out", stage.folder).stdout.splitlines()
    notes = [line.removeprefix("note     ") for line in lines if line.startswith("note ")]
    assert any(note.startswith("phases of p001 are published on /humans/persons/p001/") for note in notes), lines
    assert any(note.startswith(f"{undescribed}: no description on") for note in notes), lines


def test_simulate_takes_the_domain_of_the_session(stage):
    study = stage.study("[session]\ndomain = 42\n[simulate]\nrobots = 1\n")
    stage.teampulse("simulate", study).wait_for("on ROS domain 42")


def test_check_warns_of_a_network_without_room_for_images(stage, team):
    lines = stage.ask("check", team, "--out", stage.folder).stdout.splitlines()
    [network] = [line for line in lines if line.startswith("network")]
    assert ("ok" in network.split()) == (harness.receive_buffer_bytes() >= 4 << 20)


def test_scan_lists_topics_with_what_they_add(stage, team):
    answer = stage.ask("scan", "--json")
    [domain] = json.loads(answer.stdout)
    assert "/teampulse_simulator" in domain["nodes"]
    topics = {topic["name"]: topic for topic in domain["topics"]}
    odometry = topics["/robot1/odom"]
    assert odometry["type"] == "nav_msgs/msg/Odometry"
    assert 15 < odometry["rate_hz"] < 25
    assert odometry["kb_per_sec"] > 10


def test_what_scan_suggests_is_a_study(stage, team):
    suggestion = suggested(stage)
    assert [each["type"] for each in tomllib.loads(suggestion)["sources"]] == ["robots"]
    checked = stage.ask("check", stage.study(suggestion), "--out", stage.folder)
    assert checked.returncode == 0, checked.stderr


def test_scan_suggests_people_where_it_hears_them(stage):
    study = stage.study(TEAM.replace("robots = 3", "robots = 1\npeople = 1"))
    stage.teampulse("simulate", study).wait_for("simulating")
    suggestion = suggested(stage)
    sources = tomllib.loads(suggestion)["sources"]
    assert [each["type"] for each in sources] == ["robots", "people"]
    assert sources[1]["namespace"] == "/humans/persons/*"
    checked = stage.ask("check", stage.study(suggestion), "--out", stage.folder)
    assert checked.returncode == 0, checked.stderr
    assert any(line.startswith("person   p001  ") for line in checked.stdout.splitlines())


def suggested(stage) -> str:
    """The lines of a study that `scan` prints."""
    output = stage.ask("scan").stdout
    lines = [line.strip() for line in output[output.index("[[sources]]") :].splitlines()]
    return "\n".join(line for line in lines if line.startswith("[[") or " = " in line)


@pytest.mark.parametrize("what", ["demo", "play"])
def test_nobody_beyond_this_machine_hears_of_it(stage, what, demo_bag):
    with another_network() as sent_packets:
        if what == "demo":
            demo = stage.teampulse("demo", "--duration", 5, "--out", "sessions")
            demo.wait_for(r"ROS_DOMAIN_ID=\d+ .* ros2 topic list")
            demo.ended()
        else:
            stage.teampulse("play", demo_bag, "--rate", 10).ended()
        assert sent_packets() == 0


@contextlib.contextmanager
def another_network():
    """A wired network beside loopback; gives what counts the packets sent there."""
    if os.environ.get("TEST_ISOLATED") != "yes":
        pytest.skip("no network of our own: a card can't be added")

    def ip(*words: str) -> None:
        subprocess.run(["ip", *words], check=True)

    # Without ARP and IPv6 the kernel has nothing of its own to send there.
    ip("link", "add", "card0", "type", "veth", "peer", "name", "card1")
    try:
        for card in ["card0", "card1"]:
            Path(f"/proc/sys/net/ipv6/conf/{card}/disable_ipv6").write_text("1")
            ip("link", "set", card, "up", "arp", "off", "multicast", "on")
        ip("addr", "add", "10.99.0.1/24", "dev", "card0")
        yield lambda: packets_sent("card0")
    finally:
        ip("link", "del", "card0")


def packets_sent(card: str) -> int:
    """From the table of this network namespace; /sys may still show another's."""
    [line] = [line for line in Path("/proc/net/dev").read_text().splitlines() if card in line]
    return int(line.partition(":")[2].split()[9])
