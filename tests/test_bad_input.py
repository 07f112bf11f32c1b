"""Bad input: a clear error each, nothing lost, no panic."""

import json
import os
import pty
import random
import re
import shutil
import struct
import time
from pathlib import Path

import pytest
from mcap.reader import make_reader

import bags
import harness

BATTERY = "sensor_msgs/msg/BatteryState"
CDR_HEADER = bytes([0, 1, 0, 0])

ROBOTS = """
[session]
name = "test"
{session}
[[sources]]
type = "robots"
namespace = "/robot*"
{robots}
[[sources]]
type = "topics"
names = ["/bench*"]
[[sinks]]
type = "bag"
"""


def nonsense() -> list[bytes]:
    """Arbitrary bytes, and lengths that no message has."""
    noise = random.Random(1)
    arbitrary = [CDR_HEADER + noise.randbytes(noise.randrange(600)) for _ in range(200)]
    absurd = [
        CDR_HEADER + bytes(zeros) + struct.pack("<I", size) + noise.randbytes(80)
        for zeros in range(0, 64, 4)
        for size in (0xFFFFFFFF, 0x7FFFFFFF, 0x10000000, 81)
    ]
    return arbitrary + absurd + [CDR_HEADER]


def test_arbitrary_bytes_on_a_watched_topic_are_kept_and_harm_nothing(stage):
    study, out = stage.study(ROBOTS.format(session="", robots="")), stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out)
    honest = stage.cyclone("publish", "/bench", "--rate", 500, "--count", 2000)
    liar = stage.cyclone("send", "/robot1/battery_state", "--type", BATTERY)
    liar.answer("matched"), honest.answer("matched")
    time.sleep(1)  # for the reader to see its writer, too
    sent = nonsense()
    for message in sent:
        liar.say(message.hex())
    honest.answer("sent")
    calmly_ended(monitor)

    bag = harness.the_bag(out)
    kept = [cdr for _, cdr in bags.raw(bag)["/robot1/battery_state"]]
    for message, cdr in zip(sent, kept, strict=True):
        assert cdr.startswith(message) and len(cdr) - len(message) < 4, "DDS may pad to four bytes"
    assert bags.tallies(bag)["/bench"].summary()["received"] == 2000


def test_a_publisher_of_malformed_packets_harms_only_itself(stage):
    recorder, out = stage.record("/bench*")
    honest = stage.cyclone("publish", "/bench", "--rate", 500, "--count", 2000)
    liar = stage.cyclone("send", "/bench", "--settle-secs", 0)
    liar.answer("matched"), honest.answer("matched")
    noise = random.Random(2)
    for _ in range(50):
        # No such representation is known: Cyclone DDS refuses the packet, and all after it.
        liar.say((b"\xff\xff\0\0" + noise.randbytes(100)).hex())
    honest.answer("sent")
    calmly_ended(recorder)
    tally = bags.tallies(harness.the_bag(out))["/bench"]
    assert sorted(set(tally.numbers)) == list(range(2000))


@pytest.mark.parametrize(
    "definition",
    [
        "float64[] values\nstring name",
        "uint8[4294967295] everything",
        "Liar again",
        "float99 x",
        "string<=3 a\n" * 5000,
        "uint8 é\n\0\n=====\n",
    ],
    ids=["false", "enormous", "endless", "unknown", "long", "broken"],
)
def test_a_definition_that_lies_harms_nothing(stage, definition):
    folder = stage.folder / "definitions/bench_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "Liar.msg").write_text(definition)
    study = ROBOTS.format(
        session=f'messages = "{stage.folder}/definitions"',
        robots='numbers = [{ topic = "liar", field = "values[3]", unit = "1" }]',
    )
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(study), "--out", out)
    liar = stage.cyclone("send", "/robot1/liar", "--type", "bench_msgs/msg/Liar")
    liar.answer("matched")
    time.sleep(1)  # for the reader to see its writer, too
    sent = nonsense()
    for message in sent:
        liar.say(message.hex())
    while liar.answer("sent")["sent"] < len(sent):
        time.sleep(0.02)
    time.sleep(0.5)  # under way
    calmly_ended(monitor)
    assert len(bags.raw(harness.the_bag(out))["/robot1/liar"]) == len(sent)


def test_a_type_that_nobody_can_explain_is_said_once_and_recorded(stage):
    recorder, out = stage.record("/bench*")
    unknown = stage.cyclone("send", "/bench", "--type", "bench_msgs/msg/Unheard")
    unknown.answer("matched")
    recorder.wait_for("bench_msgs/msg/Unheard")
    for number in range(100):
        unknown.say((CDR_HEADER + bytes([number])).hex())
    while unknown.answer("sent")["sent"] < 100:
        time.sleep(0.02)
    time.sleep(0.5)  # under way
    calmly_ended(recorder)
    assert len(bags.raw(harness.the_bag(out))["/bench"]) == 100
    # Once when it happens, and once in the summary, which has no times.
    said = re.findall(r"^(\S* ?)fault: failed to find", recorder.stderr, re.MULTILINE)
    assert len(said) == 2 and said[1] == "", recorder.stderr


def test_two_types_on_one_topic_are_told_and_the_first_is_kept(stage):
    recorder, out = stage.record("/bench*")
    first = stage.cyclone("publish", "/bench", "--rate", 200, "--count", 1200)
    first.answer("matched")
    other = stage.cyclone("send", "/bench", "--type", "std_msgs/msg/String", "--subscribers", 0)
    other.answer("matched")
    recorder.wait_for(r"std_msgs/msg/String.*std_msgs/msg/UInt8MultiArray")
    first.answer("sent")
    calmly_ended(recorder)
    tally = bags.tallies(harness.the_bag(out))["/bench"].summary()
    assert (tally["received"], tally["missing"]) == (1200, 0)


@pytest.mark.parametrize(
    "content",
    [b"a,b\n1,2\n", b"#ROSBAG V2.0\n" + bytes(100), random.Random(3).randbytes(5000)],
    ids=["table", "ROS 1", "noise"],
)
@pytest.mark.parametrize(
    "command", [["info"], ["recover"], ["export", "--format", "csv"], ["play"]]
)
def test_a_bag_that_is_none_is_refused(stage, command, content):
    path = stage.folder / "no.mcap"
    path.write_bytes(content)
    refused(stage.ask(command[0], path, *command[1:]), "no.mcap")
    assert path.read_bytes() == content


def test_damage_within_a_bag_is_found_when_all_of_it_is_read(stage, demo_bag):
    copy = stage.folder / "damaged"
    shutil.copytree(demo_bag, copy)
    part = max(copy.glob("*.mcap"), key=lambda path: path.stat().st_size)
    content = bytearray(part.read_bytes())
    # The indexes between chunks have no checksum, and messages are read without them.
    with part.open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    middle = chunks[len(chunks) // 3].chunk_start_offset + chunks[len(chunks) // 3].chunk_length // 2
    content[middle : middle + 64] = bytes(64)
    part.write_bytes(content)

    def info(bag, code: int) -> dict:
        answer = stage.ask("info", bag, "--json", "--check")
        assert answer.returncode == code, answer.stderr
        return json.loads(answer.stdout)

    assert not info(demo_bag, 0)["damage"]
    checked = info(copy, 1)
    assert part.name in checked["damage"][0]
    assert all(stream["lost"] is None for stream in checked["streams"])


def test_a_bag_that_is_not_there_is_refused(stage):
    refused(stage.ask("info", stage.folder / "nowhere"), "nowhere")


def test_a_folder_that_is_no_bag_is_refused(stage):
    (stage.folder / "folder").mkdir()
    refused(stage.ask("info", stage.folder / "folder"), "folder")


def test_what_is_already_there_is_not_written_over(stage, demo_bag):
    out = stage.folder / "out"
    assert stage.ask("replay", demo_bag, "--out", out).returncode == 0
    before = contents_of(out)
    again = stage.ask("replay", demo_bag, "--out", out)
    assert "panicked" not in again.stderr
    after = contents_of(out)
    assert {path: after[path] for path in before} == before
    if again.returncode != 0:
        refused(again, "out")


STUDY = '[session]\nname = "test"\n\n[[sources]]\ntype = "topics"\nnames = ["/a"]\n'

COMMANDS = """[[sources]]
type = "robots"
namespace = "/robot*"
battery = {{ topic = "power/state" }}

commands = [{}]
"""

PHASES = (
    STUDY
    + """[[phases]]
name      = "{name}"
from_secs = {begin}
to_secs   = {end}
[[phases]]
name      = "task"
from_secs = 100
"""
)

MISTAKES = {
    "broken syntax": ('[session]\nname = "test\n', "study.toml:2", ""),
    "unknown table": (STUDY + "[sesion]\n", "study.toml:7", "session"),
    "unknown key": ('[session]\nnmae = "test"\n', "study.toml:2", "name"),
    "mistyped value": ("[session]\nname = 7\n", "study.toml:2", "string"),
    "missing person": ('[[sources]]\ntype = "polar"\n', "study.toml:1", 'person = "p001"'),
    "typographic quotes": ("[session]\nname = “test”\n", "study.toml:2", "straight quotes"),
    "set twice": ('[session]\nname = "a"\nname = "b"\n', "study.toml:3", "line 2"),
    "wrong table": ("[session]\npublish = []\n", "study.toml:2", "belongs to the study"),
    "no type": ('[[sources]]\nnames = ["/a"]\n', "study.toml:1", "type"),
    "unknown source": (STUDY.replace('"topics"', '"topcis"'), "study.toml:5", "topics"),
    "unknown source key": (STUDY.replace("names", "nams"), "study.toml:6", "names"),
    "mistyped source value": (STUDY.replace('["/a"]', "3"), "study.toml:6", ""),
    "bad pattern": (STUDY.replace('"/a"', '"no slash"'), "study.toml:6", ""),
    "unknown sink": (STUDY + '[[sinks]]\ntype = "bog"\n', "study.toml:8", "bag"),
    "unknown sink value": (
        STUDY + '[[sinks]]\ntype = "bag"\ncompression = "zip"\n',
        "study.toml:9",
        "zstd",
    ),
    "unknown feature": (
        STUDY + '[features]\ndisable = ["batery_use"]\n',
        "study.toml:8",
        "battery_use",
    ),
    "bad window": (STUDY + "[features]\nwindows_secs = [-3]\n", "study.toml:8", ""),
    "window twice": (STUDY + "[features]\nwindows_secs = [30, 30]\n", "study.toml:8", "twice"),
    "positive level": (STUDY + "[features.link_quality]\nweak_dbm = 75\n", "study.toml:8", "write -75"),
    "bad phase": (STUDY + '[[phases]]\nname = "a"\nfrom_secs = "x"\n', "study.toml:9", ""),
    "absolute command": (COMMANDS.format('"/goal_pose"'), "study.toml:6", "goal_pose"),
    "nameless command": (COMMANDS.format('""'), "study.toml:6", "goal_pose"),
    "command with a space": (COMMANDS.format('"cmd_vel", "goal pose"'), "study.toml:6", "goal pose"),
    "every topic a command": (COMMANDS.format('"*"'), "study.toml:6", "full name"),
    "command that is the battery": (COMMANDS.format('"power/state"'), "study.toml:6", "battery"),
    "unknown table of a feature": (STUDY + "[features.stat]\n", "study.toml:7", "state"),
    "unknown setting of a feature": (
        STUDY + "[features.state]\nstale_sec = 3\n",
        "study.toml:8",
        "stale_secs",
    ),
    "bad setting of a feature": (
        STUDY + "[features.state]\nstale_secs = -3\n",
        "study.toml:8",
        "seconds",
    ),
    "nameless phase": (PHASES.format(name="", begin=0, end=60), "study.toml:8", "name"),
    "phase before the start": (PHASES.format(name="a", begin=-1, end=60), "study.toml:9", "start"),
    "phase at no time": (PHASES.format(name="a", begin="nan", end=60), "study.toml:9", "NaN"),
    "phase without an end": (PHASES.format(name="a", begin=0, end="inf"), "study.toml:10", "inf"),
    "phase of no length": (PHASES.format(name="a", begin=60, end=60), "study.toml:10", "later"),
    "phase reversed": (PHASES.format(name="a", begin=60, end=5), "study.toml:10", "later"),
    "phases at once": (PHASES.format(name="a", begin=0, end=150), "study.toml:13", "`a`"),
    "unknown clock": ('[session]\nclock = "/time"\n', "study.toml:2", "/clock"),
}


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_study_is_shown_in_its_place(stage, command, mistake):
    text, place, word = MISTAKES[mistake]
    answer = stage.ask(command, stage.study(text))
    assert answer.returncode == 4, answer.stderr
    assert place in answer.stderr
    assert word in answer.stderr
    assert "panicked" not in answer.stderr
    assert answer.stdout == ""


def test_replay_refuses_the_studies_that_check_refuses(stage, demo_bag):
    out = stage.folder / "replayed"
    for mistake, (text, place, word) in MISTAKES.items():
        answer = stage.ask("replay", demo_bag, "--study", stage.study(text), "--out", out)
        assert answer.returncode == 4, (mistake, answer.stderr)
        assert place in answer.stderr and word in answer.stderr, (mistake, answer.stderr)
    assert not out.exists()


def test_a_study_that_is_not_there_is_a_wrong_study(stage):
    answer = stage.ask("run", stage.folder / "nowhere.toml")
    assert answer.returncode == 4
    assert "nowhere.toml" in answer.stderr


SIMULATE = STUDY + "[simulate]\nseed = 2\n"


@pytest.mark.parametrize(
    "line, word",
    [
        ("robots = 0", "1 to 1000"),
        ("robots = -1", "-1"),
        ("robots = 900", "arena_side_m"),
        ("people = 100000", "0 to 100"),
        ("speed = 0", "0.01 to 1000"),
        ("odometry_hz = -3", "0 to 1000"),
        ('script = [{ robot = "robot9", what = "dead" }]', "robot1 to robot5"),
    ],
)
def test_a_team_that_can_not_be_simulated_is_shown_in_its_place(stage, line, word):
    answer = stage.ask("simulate", stage.study(SIMULATE + line + "\n"))
    assert answer.returncode == 4, answer.stderr
    assert "study.toml:9" in answer.stderr
    assert word in answer.stderr
    assert answer.stdout == ""


@pytest.mark.parametrize("below", ["", "sessions"], ids=["file", "below a file"])
def test_nothing_is_run_that_would_be_recorded_into_a_file(stage, below):
    file = stage.folder / "mine.txt"
    file.write_text("mine")
    answer = stage.ask("run", stage.study(ROBOTS.format(session="", robots="")), "--out", file / below)
    refused(answer, "mine.txt is a file")
    assert "--out" in answer.stderr
    assert file.read_text() == "mine"


@pytest.mark.parametrize("domain", ["seven", "300", "-1", "1.5"])
def test_a_domain_that_ros_does_not_have_is_said_with_a_remedy(stage, domain):
    study = stage.study(STUDY)
    for command in (["run", study], ["check", study], ["scan"]):
        program = stage.teampulse(*command, env={"ROS_DOMAIN_ID": domain})
        assert program.ended() == 1, program.report()
        assert f'ROS_DOMAIN_ID is "{domain}", expected a whole number from 0 to 232' in program.stderr
        assert "hint: " in program.stderr and "unset ROS_DOMAIN_ID" in program.stderr
        assert "panicked" not in program.stderr


def test_a_configuration_of_dds_that_is_none_is_named(stage):
    program = stage.teampulse("check", stage.study(STUDY), env={"CYCLONEDDS_URI": "file:///nowhere.xml"})
    assert program.ended() == 1, program.report()
    assert "error: failed to join ROS domain" in program.stderr, program.report()
    assert "hint: CYCLONEDDS_URI may be the cause" in program.stderr, program.report()


@pytest.mark.parametrize("arguments", [["run"], ["fly"], ["run", "s.toml", "--duration", "-1"], []])
def test_arguments_that_make_no_sense_are_refused(stage, arguments):
    answer = stage.ask(*arguments)
    assert answer.returncode == 2
    assert "sage:" in answer.stderr or "--help" in answer.stderr
    assert answer.stdout == ""


def calmly_ended(program: harness.Program) -> None:
    code = program.interrupt()
    assert "panicked" not in program.stderr, program.report()
    assert code == 0, program.report()


def refused(answer, name: str) -> None:
    """An error that names what it is about, on standard error, and nothing else."""
    assert answer.returncode == 1, answer.stderr
    assert answer.stderr.startswith("error: "), answer.stderr
    assert name in answer.stderr
    assert "panicked" not in answer.stderr
    assert answer.stdout == ""


def contents_of(folder) -> dict:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def description(channels: int) -> bytes:
    """A `teampulse_msgs/StreamDescription` of a person's wave with so many channels without names."""
    body = bytearray()

    def number(kind: str, value) -> None:
        size = struct.calcsize(kind)
        body.extend(bytes(-len(body) % size) + struct.pack("<" + kind, value))

    def text(words: str) -> None:
        number("I", len(words) + 1)
        body.extend(words.encode() + b"\0")

    number("i", 1_700_000_000), number("I", 0), text("")
    for words in ("/humans/persons/p001/own/ecg", "teampulse_msgs/msg/Wave", "ecg"):
        text(words)
    number("B", 0), text("p001"), text("own"), number("B", 0)
    number("I", 0), text("")
    for _ in ("channels", "units"):
        number("I", channels)
        # Each an empty string, which some write without its closing zero.
        body.extend(bytes(4 * channels))
    number("d", 250.0), number("I", 0), text("")
    text(""), number("d", 0.0), text("")
    return CDR_HEADER + bytes(body)


def peak_bytes(program: harness.Program) -> int:
    """The most memory that a process has had so far."""
    status = Path(f"/proc/{program.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+) kB", status)[1]) * 1024


def test_a_crafted_message_costs_a_live_session_less_than_300_mb(stage):
    study = stage.study('[[sources]]\ntype = "people"\n[[sinks]]\ntype = "bag"\n')
    monitor = stage.teampulse("run", study, "--out", stage.folder / "sessions")
    liar = stage.cyclone(
        "send", "/teampulse/streams", "--type", "teampulse_msgs/msg/StreamDescription", "--subscribers", 1
    )
    liar.answer("matched")
    time.sleep(1)  # for the reader to see its writer, too
    before = peak_bytes(monitor)
    liar.say(description(1_500_000).hex())
    monitor.wait_for("read 1500000 channels: expected at most 1024")
    assert peak_bytes(monitor) - before < 300e6
    calmly_ended(monitor)


@pytest.mark.parametrize("arguments", [["check", "bad.toml"], ["--help"], ["nonsense"]])
def test_no_colours_where_none_are_wanted(stage, monkeypatch, arguments):
    (stage.folder / "bad.toml").write_text("[session]\nname = 1\n")
    monkeypatch.chdir(stage.folder)
    said = {}
    for wanted in (True, False):
        monkeypatch.setenv("TERM", "xterm-256color")
        monkeypatch.delenv("NO_COLOR", raising=False)
        if not wanted:
            monkeypatch.setenv("NO_COLOR", "1")
        said[wanted] = on_a_terminal(harness.TEAMPULSE, *arguments)
    assert b"\x1b[" in said[True] and b"\x1b[" not in said[False], said


def on_a_terminal(*command) -> bytes:
    """What a command says on a terminal."""
    command = [str(word) for word in command]
    pid, terminal = pty.fork()
    if pid == 0:
        os.execv(command[0], command)
    said = bytearray()
    try:
        while data := os.read(terminal, 1 << 16):
            said.extend(data)
    except OSError:  # so Linux says that the other side is closed
        pass
    os.waitpid(pid, 0)
    os.close(terminal)
    return bytes(said)
