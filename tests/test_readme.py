"""The commands of the README, as somebody runs them who has read nothing else."""

import os
import pty
import re
import shlex
import shutil
import signal

import pytest

import harness

# One's own strap, as far as a test can have one.
STRAP = '[[simulate.wearables]]\ntype = "heart_rate"\nperson = "p001"\n'


def test_one_s_own_heartbeat_takes_five_commands(stage, figure, monkeypatch):
    if not shutil.which("dbus-daemon"):
        pytest.skip("dbus-daemon is not installed")
    commands = heartbeat_commands()
    # With those that install it: `cargo install`, and putting on the strap needs none.
    figure(f"from the README to one's own heartbeat: {1 + len(commands)} commands (bar 5)")
    assert 1 + len(commands) <= 5
    strap = stage.teampulse("emulate", stage.study(STRAP, "strap.toml"))
    address = strap.wait_for("DBUS_SYSTEM_BUS_ADDRESS=(.*)", pipe="stdout")
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address[1])
    monkeypatch.chdir(stage.folder)

    scan, run = commands
    answer = stage.ask(*scan)
    assert answer.returncode == 0, answer.stderr
    [lines] = re.findall(r"(?m)^\[\[sources\]\]\n(?:.+\n)+", answer.stdout)
    assert lines.count("\n") == 4, lines
    (stage.folder / "me.toml").write_text(lines)
    assert re.search(r"heart +\d+ /min", seen(stage, [*run, "--duration", "60"])), "no heartbeat on the screen"


def heartbeat_commands() -> list[list[str]]:
    """The arguments of the commands that the README lists for it."""
    text = (harness.ROOT / "README.md").read_text()
    block = text.split("To see your own heartbeat", 1)[1].split("```sh\n", 1)[1].split("```", 1)[0]
    commands = [shlex.split(line, comments=True) for line in block.splitlines()]
    assert all(command[0] == "teampulse" for command in commands)
    return [command[1:] for command in commands]


def seen(stage, arguments) -> str:
    """What is on the screen until there is a heart rate, without colours."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ.update(ROS_DOMAIN_ID=str(stage.domain), TERM="xterm-256color")
        os.execv(harness.TEAMPULSE, ["teampulse", *map(str, arguments)])
    shown = ""
    try:
        while not re.search(r"heart +\d+ /min", shown):
            shown += re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", os.read(terminal, 65536).decode(errors="replace"))
    except OSError:
        pass  # it ended
    finally:
        os.kill(pid, signal.SIGTERM)
        os.close(terminal)
        os.waitpid(pid, 0)
    return shown
