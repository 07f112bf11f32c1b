"""However a session is ended, it ends whole: its bag indexed, its tidy files written, nobody left behind."""

import os
import pty
import random
import re
import signal
import time
from pathlib import Path

import bags
import harness
import pytest


def recording(stage):
    """A recorder into whose bag messages go."""
    recorder, out = stage.record("/bench*")
    publisher = stage.cyclone("publish", "/bench", "--size", 64, "--rate", 100)
    publisher.answer("matched")
    recorder.wait_for("/bench")
    return recorder, out


def whole(stage, bag: Path) -> None:
    answer = stage.ask("info", bag, "--check")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "damage" not in answer.stdout.lower(), answer.stdout
    assert bags.decoded_by_rosbags(bag).total() > 0
    assert "cut off" not in (bag / "summary.md").read_text()


def test_a_bag_is_read_while_it_is_recorded_and_not_repaired(stage):
    recorder, out = recording(stage)
    bag = harness.the_bag(out)
    answer = stage.ask("info", bag, "--check")
    assert answer.returncode == 0 and "still being recorded" in answer.stdout, answer.stdout + answer.stderr
    assert "damaged" not in answer.stdout
    [part] = bags.parts(bag)
    before = part.stat().st_ino
    refused = stage.ask("recover", bag)
    assert refused.returncode == 1 and "still being written" in refused.stderr, refused.stderr
    assert part.stat().st_ino == before
    exported = stage.ask("export", bag, "--out", stage.folder / "tables")
    assert exported.returncode == 0 and "still being recorded" in exported.stderr, exported.stderr
    assert recorder.interrupt() == 0, recorder.report()
    whole(stage, bag)


@pytest.mark.parametrize("name", ["SIGHUP", "SIGTERM"])
def test_a_signal_ends_a_session_whole(stage, name):
    recorder, out = recording(stage)
    os.kill(recorder.pid, getattr(signal, name))
    assert recorder.ended() == 0, recorder.report()
    whole(stage, harness.the_bag(out))


def test_sessions_that_begin_at_once_have_a_bag_each(stage):
    publisher = stage.cyclone("publish", "/bench", "--size", 64, "--rate", 100)
    recorders = [stage.record("/bench*")[0] for _ in range(3)]
    publisher.answer("matched")
    for recorder in recorders:
        recorder.wait_for("/bench")
        assert recorder.interrupt() == 0, recorder.report()
    bags_made = [path.parent for path in (stage.folder / "sessions").glob("*/metadata.yaml")]
    assert len(bags_made) == 3
    for bag in bags_made:
        whole(stage, bag)
        assert [file.name for file in bag.glob("*.mcap")] == [f"{bag.name}_0.mcap"]


def test_a_closed_terminal_ends_a_session_whole(stage):
    publisher = stage.cyclone("publish", "/bench", "--size", 64, "--rate", 100)
    study = stage.study(
        '[session]\nname = "test"\n[[sources]]\ntype = "topics"\nnames = ["/bench*"]\n'
        '[[sinks]]\ntype = "bag"\n'
    )
    out = stage.folder / "sessions"
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ.update(ROS_DOMAIN_ID=str(stage.domain))
        os.execv(harness.TEAMPULSE, ["teampulse", "run", str(study), "--out", str(out)])
    publisher.answer("matched")
    shown = b""
    while b"/bench" not in shown:
        shown += os.read(terminal, 65536)
    os.close(terminal)
    _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == 0
    whole(stage, harness.the_bag(out))


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_demo_names_a_simulator_that_dies_and_leaves_none_behind(stage):
    demo = stage.teampulse("demo", "--out", stage.folder / "sessions")
    demo.wait_for("robot1 online|marker: robot1|/robot1/")
    [first] = children(demo.pid)
    os.kill(first, signal.SIGKILL)
    demo.wait_for("simulator: failed to continue: its process ended .*9")
    [second] = harness.eventually(lambda: of_simulator(demo.pid))
    assert second != first and is_alive(second)
    demo.kill()
    harness.eventually(lambda: not is_alive(second))


@pytest.mark.parametrize("how", ["SIGHUP", "SIGTERM", "SIGINT twice", "SIGKILL"])
def test_a_demo_that_is_ended_at_any_moment_keeps_all_but_its_last_second(stage, figure, how):
    out = stage.folder / "sessions"
    demo = stage.teampulse("demo", "--out", out)
    demo.wait_for("robot1 online")
    [simulator] = harness.eventually(lambda: of_simulator(demo.pid))
    # ENDS=7 tries other moments.
    moment = random.Random(f"{how} {os.environ.get('ENDS', 0)}")
    time.sleep(moment.uniform(0, 2))
    ended_ns = time.time_ns()
    name, *twice = how.split()
    os.kill(demo.pid, getattr(signal, name))
    if twice:
        time.sleep(moment.uniform(0, 0.5))
        demo.signal(signal.SIGINT)
    code = demo.ended()
    harness.eventually(lambda: not is_alive(simulator))

    bag = harness.the_bag(out)
    if name == "SIGKILL":
        assert "the file ends without an index" in stage.ask("info", bag).stdout
        assert stage.ask("recover", bag).returncode == 0
        assert "cut off" in (bag / "summary.md").read_text()
    else:
        # What had to be left out in a hurry is said where the code is not 0.
        assert code == (3 if "error:" in demo.stderr else 0), demo.report()
        assert not code or twice, demo.report()
        whole(stage, bag)
    newest_age_secs = (ended_ns - max(log_ns for _, log_ns, _ in bags.stored(bag))) / 1e9
    figure(f"{how}: the demo's last {max(0, newest_age_secs):.3f} s are lost (bar 1)")
    assert newest_age_secs < 1


def of_simulator(pid: int) -> list[int]:
    """The simulator of a demo, by whatever thread it was started."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    found = [int(child) for task in tasks for child in (task / "children").read_text().split()]
    return [child for child in found if is_alive(child)]


def test_a_session_that_was_stopped_says_so_of_itself(stage):
    recorder, _ = recording(stage)
    stops = 0

    def said() -> bool:
        nonlocal stops
        # Rarely a stop falls into a moment of work, where it is not noticed.
        os.kill(recorder.pid, signal.SIGSTOP)
        # After five seconds what is silent would be offline.
        time.sleep(6)
        os.kill(recorder.pid, signal.SIGCONT)
        stops += 1
        return "teampulse itself stood still for" in recorder.stderr

    harness.eventually(said)
    assert recorder.interrupt() == 0, recorder.report()
    assert recorder.stderr.count("bench offline") < stops, recorder.report()


def test_a_recovered_bag_has_its_tidy_files(stage):
    recorder, out = recording(stage)
    recorder.kill()
    bag = harness.the_bag(out)
    assert not (bag / "summary.md").exists()
    answer = stage.ask("recover", bag)
    assert answer.returncode == 0, answer.stderr
    assert "## What is usable" in (bag / "summary.md").read_text()
    assert (bag / "events.tsv").exists() and (bag / "events.json").exists()


def test_a_file_may_not_grow_larger_and_the_recording_goes_on(stage):
    study = stage.study(
        '[session]\nname = "test"\n[[sources]]\ntype = "topics"\nnames = ["/bench*"]\n'
        '[[sinks]]\ntype = "bag"\ncompression = "none"\n'
    )
    out = stage.folder / "sessions"
    # 8 MiB, in blocks of 1 KiB.
    limited = ["bash", "-c", f"ulimit -f 8192; exec {harness.TEAMPULSE} run {study} --out {out}"]
    recorder = stage.start(*limited)
    publisher = stage.cyclone("publish", "/bench", "--size", 8192, "--rate", 1000, "--count", 2000)
    publisher.answer("sent")
    bag = harness.the_bag(out)
    harness.eventually(lambda: len(list(bag.glob("*.mcap"))) > 2)
    assert recorder.interrupt() == 0, recorder.report()
    assert re.search(r"recorded", recorder.stderr)
    tally = bags.tallies(bag)["/bench"].summary()
    assert tally["missing"] == 0


def test_a_name_that_is_an_option_is_refused(stage):
    study = stage.study('[session]\nname = "-rf"\n')
    answer = stage.ask("run", study)
    assert answer.returncode == 4
    assert "can't be the name of a session's folder" in answer.stderr


def test_a_session_whose_devices_never_appeared_says_which_and_ends_with_5(stage):
    bag = '[session]\nname = "test"\n[[sinks]]\ntype = "bag"\n[[sources]]\ntype = "topics"\n'
    robots = '[[sources]]\ntype = "robots"\nnamespace = "/robot*"\nrequired = ["battery"]\n'
    nowhere = stage.study(bag + 'names = ["/nowhere"]\n', "nowhere.toml")
    without = stage.folder / "without", "no topic of the study is published"
    some = stage.study(bag + 'names = ["/bench*"]\n' + robots, "some.toml")
    robotless = stage.folder / "robotless", "no robot matches /robot*"
    assert stage.ask("run", nowhere, "--duration", 2).returncode == 0, "devices may take 10 s to appear"
    publisher = stage.cyclone("publish", "/bench", "--size", 64, "--rate", 100)
    sessions = [
        (stage.teampulse("run", study, "--duration", 11, "--out", out), out, missing)
        for study, (out, missing) in ((nowhere, without), (some, robotless))
    ]
    publisher.answer("matched")
    for session, out, missing in sessions:
        assert session.ended() == 5, session.report()
        assert re.findall("missing during the whole session: (.*)", session.stderr) == [missing]
        summary = (harness.the_bag(out) / "summary.md").read_text()
        assert f"\n## What was lost or wrong\n\n- Missing during the whole session: {missing}\n" in summary, summary
