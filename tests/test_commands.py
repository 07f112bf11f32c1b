"""Commands to a running session: from the keys of its terminal, and from nodes on ROS that are allowed to."""

import csv
import os
import pty
import time

import bags
import harness

STUDY = """
[session]
name = "test"
[[sources]]
type = "topics"
names = ["/bench*"]
[[phases]]
name = "baseline"
[[phases]]
name = "task"
[[sinks]]
type = "bag"
tidy = false
"""


def string(words: str) -> str:
    """A `std_msgs/String` as CDR, in hex."""
    text = words.encode() + b"\0"
    return (b"\0\1\0\0" + len(text).to_bytes(4, "little") + text).hex()


def events(bag, kind: str) -> list[tuple[float, str]]:
    """When what of a kind happened in a session."""
    happened = bags.messages(bag, "/session/events")
    return [(each.log_secs, each.content.label) for each in happened if each.content.kind == kind]


def test_a_node_commands_what_the_study_allows(stage):
    out = stage.folder / "sessions"
    allowed = '[commands]\nros = ["mark", "next_phase", "split", "stop"]\n'
    monitor = stage.teampulse("run", stage.study(STUDY + allowed), "--out", out)
    panel = stage.cyclone(
        "send", "/session/commands", "--type", "std_msgs/msg/String", "--subscribers", 1
    )
    panel.answer("matched")
    for words in ("next_phase", "mark robot 2 lost", "abort_phase", "split", "stop"):
        panel.say(string(words))
        wanted = f"`{words}` .*was refused" if words == "abort_phase" else f"command from ros:[^ ]+: {words}"
        if words == "mark robot 2 lost":
            wanted = "marker: robot 2 lost"
        monitor.wait_for(wanted)
    assert monitor.ended() == 0, monitor.report()

    bag = harness.the_bag(out)
    commands = events(bag, "command")
    senders = {label.split(" ")[0] for _, label in commands}
    assert len(senders) == 1 and senders.pop().startswith("ros:"), commands
    asked = [label.split(" ", 1)[1] for _, label in commands]
    assert asked == ["next_phase", "mark robot 2 lost", "split", "stop"]
    assert [label for _, label in events(bag, "phase")] == ["baseline"]
    assert [label for _, label in events(bag, "marker")] == ["robot 2 lost"]
    [refused] = [label for _, label in events(bag, "fault") if "refused" in label]
    assert "not allowed: add `abort_phase` to `ros` below [commands]" in refused
    assert len(list(bag.glob("*.mcap"))) == 2
    times = [time for time, _ in commands]
    assert times == sorted(times) and times[0] <= events(bag, "phase")[0][0]


def test_tables_state_which_part_of_a_session_a_recording_is(stage):
    out, again = stage.folder / "sessions", stage.folder / "again"
    robots = '[[sources]]\ntype = "robots"\nnamespace = "/robot*"\n[simulate]\nrobots = 1\n'
    allowed = '[commands]\nros = ["next_phase", "stop_recording", "start_recording", "stop"]\n'
    study = stage.study(STUDY.replace("tidy = false", "") + robots + allowed)
    stage.teampulse("simulate", study).wait_for("simulating")
    monitor = stage.teampulse("run", study, "--out", out)
    panel = stage.cyclone(
        "send", "/session/commands", "--type", "std_msgs/msg/String", "--subscribers", 1
    )
    panel.answer("matched")
    monitor.wait_for("robot1")
    for words, answer in (
        ("next_phase", "phase: baseline"),
        ("stop_recording", "command from ros:[^ ]+: stop_recording"),
        ("start_recording", "command from ros:[^ ]+: start_recording"),
        ("next_phase", "phase: task"),
        ("stop", "command from ros:[^ ]+: stop"),
    ):
        panel.say(string(words))
        monitor.wait_for(answer)
        # So long, that there are values of each part.
        time.sleep(2)
    assert monitor.ended() == 0, monitor.report()

    first, second = sorted(path.parent for path in out.glob("*/metadata.yaml"))
    page = (first / "summary.md").read_text()
    assert "ended before the session did, and these files with it: a command stopped the recording" in page, page
    assert [row["phase"] for row in phases(first)] == ["baseline"], "a row without values"
    assert len(phases(first)[0]) == 5
    answer = stage.ask("replay", first, "--out", again)
    assert answer.returncode == 0, answer.stderr
    [computed] = phases(harness.the_bag(again))
    assert computed["phase"] == "baseline" and float(computed["mean.twist.twist.linear.x"]) > 0
    page = (second / "summary.md").read_text()
    assert "The session was already running when this bag began" in page and "cut off" not in page, page
    assert [row["phase"] for row in phases(second)] == ["baseline", "task"]


def phases(bag) -> list[dict[str, str]]:
    with (bag / "phases.csv").open() as table:
        return list(csv.DictReader(table))


def test_nobody_on_ros_commands_a_session_that_does_not_say_so(stage):
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(STUDY), "--out", out)
    panel = stage.cyclone(
        "send", "/session/commands", "--type", "std_msgs/msg/String", "--subscribers", 1
    )
    panel.answer("matched")
    for words in ("stop", "halt"):
        panel.say(string(words))
    monitor.wait_for("`stop` .*was refused: not allowed")
    monitor.wait_for("there is no `halt`")
    assert monitor.interrupt() == 0, monitor.report()
    assert events(harness.the_bag(out), "command") == []


def test_a_key_is_a_command_with_its_sender_and_time(stage):
    out = stage.folder / "sessions"
    study = stage.study(STUDY + '[keys]\nl = "mark robot lost"\ns = "split"\nb = "do nback start 2"\n')
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ.update(ROS_DOMAIN_ID=str(stage.domain))
        os.execv(harness.TEAMPULSE, ["teampulse", "run", str(study), "--out", str(out)])
    shown = bytearray()

    def show(words: bytes) -> None:
        until = time.monotonic() + harness.PATIENCE_SECS
        while words not in shown:
            assert time.monotonic() < until, shown[-2000:]
            shown.extend(os.read(terminal, 65536))

    show(b"next baseline")
    for keys, answer in (
        (b"\x0e", b"phase: baseline"),
        (b"a", b"marker: a"),
        (b"l", b"marker: robot lost"),
        (b"s", b"command from keys: split"),
        (b"b", b"`do nback start 2`"),
        (b"q", b"end the recording?"),
    ):
        os.write(terminal, keys)
        show(answer)
    os.write(terminal, b"y")
    try:
        while os.read(terminal, 65536):
            pass
    except OSError:  # so Linux says that the other side is closed
        pass
    _, status = os.waitpid(pid, 0)
    os.close(terminal)
    assert os.waitstatus_to_exitcode(status) == 0

    bag = harness.the_bag(out)
    commands = events(bag, "command")
    asked = ["next_phase", "mark a", "mark robot lost", "split", "stop"]
    assert [label for _, label in commands] == [f"keys {words}" for words in asked]
    assert [label for _, label in events(bag, "phase")] == ["baseline"]
    assert [label for _, label in events(bag, "marker")] == ["a", "robot lost"]


def test_a_recording_that_begins_paused_begins_by_command_with_the_seconds_before(stage):
    out = stage.folder / "sessions"
    allowed = '[commands]\nros = ["mark", "start_recording", "stop_recording"]\n'
    paused = STUDY.replace("tidy = false", "start_paused = true\nsnapshot_secs = 60")
    monitor = stage.teampulse("run", stage.study(paused + allowed), "--out", out)
    panel = stage.cyclone(
        "send", "/session/commands", "--type", "std_msgs/msg/String", "--subscribers", 1
    )
    panel.answer("matched")
    for words in ("mark before", "start_recording", "mark within", "start_recording", "stop_recording", "mark after"):
        panel.say(string(words))
        monitor.wait_for(f"marker: {words[5:]}" if words.startswith("mark") else f"command from ros:[^ ]+: {words}")
    panel.say(string("stop_recording"))
    monitor.wait_for("bag note `start_recording` had no effect: a recording is already running")
    monitor.wait_for("bag note `stop_recording` had no effect: nothing is being recorded")
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    assert [label for _, label in events(bag, "marker")] == ["before", "within"]
    asked = [label.split(" ", 1)[1] for _, label in events(bag, "command")]
    assert asked == ["mark before", "start_recording", "mark within", "start_recording", "stop_recording"]
    assert "the recording was stopped" not in monitor.report()
    tidy = (bag / "events.tsv").read_text()
    assert "before" in tidy and "within" in tidy and "after" not in tidy


def test_a_session_that_never_recorded_leaves_nothing_and_says_so(stage):
    out = stage.folder / "sessions"
    study = STUDY.replace("tidy = false", "start_paused = true")
    monitor = stage.teampulse("run", stage.study(study), "--out", out)
    monitor.wait_for("the recording is paused: start it with Ctrl-P")
    monitor.wait_for("dashboard is at")
    assert monitor.interrupt() == 0, monitor.report()
    assert "nothing was recorded: no command started the recording" in monitor.report()
    assert list(out.iterdir()) == []
