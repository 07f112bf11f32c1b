"""Starts programs, waits for what they say, and ends them whatever happens."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

TESTS = Path(__file__).parent
ROOT = TESTS.parent
TEAMPULSE = Path(os.environ.get("TEAMPULSE", ROOT / "target/release/teampulse"))
CYCLONE_PEER = [sys.executable, TESTS / "peers/cyclone_peer.py"]
FASTDDS_PEER = [TESTS / "build/fastdds_peer"]

# No wait in the tests is longer, unless it says so.
PATIENCE_SECS = 30
CLOCK_TICKS = os.sysconf("SC_CLK_TCK")

# These commands keep no time: they take what is left of the processor, for this long at most.
AT_LEISURE = {"export", "extract", "import", "replay", "retime"}
LEISURE_SECS = 180


class Program:
    """A running program: what it says is gathered, and can be waited for."""

    def __init__(
        self, command: list, domain: int, env: dict | None = None, cwd: Path | None = None
    ):
        self.command = [str(word) for word in command]
        self._said = {"stdout": [], "stderr": []}
        self._changed = threading.Condition()
        self._process = subprocess.Popen(
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            bufsize=1,
            errors="replace",
            cwd=cwd,
            env={**os.environ, "ROS_DOMAIN_ID": str(domain), "NO_COLOR": "1", **(env or {})},
        )
        self.pid = self._process.pid
        self._listeners = [self._listen("stdout"), self._listen("stderr")]

    def _listen(self, pipe: str) -> threading.Thread:
        def listen() -> None:
            for line in getattr(self._process, pipe):
                with self._changed:
                    self._said[pipe].append(line.rstrip("\n"))
                    self._changed.notify_all()

        thread = threading.Thread(target=listen, daemon=True)
        thread.start()
        return thread

    @property
    def stdout(self) -> str:
        return "\n".join(self._said["stdout"])

    @property
    def stderr(self) -> str:
        return "\n".join(self._said["stderr"])

    def wait_for(self, pattern: str, pipe: str = "stderr", within_secs=PATIENCE_SECS) -> re.Match:
        """Waits for a line, said before or still to come, in which the pattern is found."""

        def found() -> re.Match | None:
            return next(filter(None, (re.search(pattern, line) for line in self._said[pipe])), None)

        return self._wait(found, f"'{pattern}' on {pipe}", within_secs)

    def answer(self, key: str, within_secs=PATIENCE_SECS) -> dict:
        """Waits for a line of JSON with this key; gives the newest there is."""

        def found() -> dict | None:
            answers = [json.loads(line) for line in self._said["stdout"] if line.startswith("{")]
            return next((each for each in reversed(answers) if key in each), None)

        return self._wait(found, f"an answer with '{key}'", within_secs)

    def sources(self, devices: int) -> str:
        """Waits for what `emulate` prints for a study, with the tables of so many devices; gives it."""

        def found() -> str | None:
            lines = list(self._said["stdout"])
            is_whole = lines.count("[[sources]]") >= devices and lines[-1] == ""
            return "\n".join(lines) if is_whole else None

        return self._wait(found, f"the tables of {devices} devices", PATIENCE_SECS)

    def _wait(self, found, what: str, within_secs: float):
        deadline = time.monotonic() + within_secs
        with self._changed:
            while (result := found()) is None:
                left_secs = deadline - time.monotonic()
                silent = not any(listener.is_alive() for listener in self._listeners)
                if left_secs <= 0 or silent:
                    why = "ended without" if silent else f"did not within {within_secs:.0f} s say"
                    raise AssertionError(f"{self} {why} {what}\n{self.report()}")
                self._changed.wait(min(left_secs, 0.1))
        return result

    def say(self, line: str) -> None:
        """Writes a line on its standard input."""
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def say_no_more(self) -> None:
        """Closes its standard input."""
        self._process.stdin.close()

    def interrupt(self, within_secs=PATIENCE_SECS) -> int:
        """Ctrl-C; gives the exit code."""
        self._process.send_signal(signal.SIGINT)
        return self.ended(within_secs)

    def signal(self, number: int) -> None:
        """Sends a signal, if it has not ended."""
        self._process.send_signal(number)

    def kill(self) -> None:
        """As a power cut would end it."""
        self._process.kill()
        self.ended()

    def ended(self, within_secs=PATIENCE_SECS) -> int:
        """Waits until it has ended by itself; gives the exit code."""
        try:
            code = self._process.wait(within_secs)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self} did not end\n{self.report()}") from None
        for listener in self._listeners:
            listener.join()
        return code

    def is_running(self) -> bool:
        return self._process.poll() is None

    def cpu_secs(self) -> float:
        """The time of a processor that it has used so far, in user and kernel."""
        fields = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / CLOCK_TICKS

    def close(self) -> None:
        """Lets go of its leash, and ends it if that does not."""
        self.say_no_more()
        try:
            self._process.wait(2)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def report(self) -> str:
        stdout, stderr = ("\n".join(lines[-40:]) for lines in self._said.values())
        return f"--- stdout\n{stdout}\n--- stderr\n{stderr}"

    def __str__(self) -> str:
        return " ".join(Path(word).name if "/" in word else word for word in self.command[:4])


class Stage:
    """A ROS domain, a folder, and the programs that a test runs there."""

    def __init__(self, folder: Path, domain: int):
        self.folder = folder
        self.domain = domain
        self._programs: list[Program] = []

    def start(self, *command, **options) -> Program:
        program = Program(list(command), self.domain, cwd=self.folder, **options)
        self._programs.append(program)
        return program

    def teampulse(self, *arguments, **options) -> Program:
        return self.start(TEAMPULSE, *arguments, **options)

    def cyclone(self, *arguments, **options) -> Program:
        return self.start(*CYCLONE_PEER, "--domain", self.domain, *arguments, **options)

    def fastdds(self, *arguments, **options) -> Program:
        return self.start(*FASTDDS_PEER, *arguments, "--domain", self.domain, **options)

    def ask(self, *arguments) -> subprocess.CompletedProcess:
        """Runs teampulse to its end; what computes as fast as it can leaves the processor to sessions beside it."""
        at_leisure = bool(AT_LEISURE.intersection(arguments[:1]))
        program = self.start(*(["nice"] if at_leisure else []), TEAMPULSE, *arguments)
        program.say_no_more()
        code = program.ended(LEISURE_SECS if at_leisure else PATIENCE_SECS)
        return subprocess.CompletedProcess(program.command, code, program.stdout, program.stderr)

    def study(self, text: str, name: str = "study.toml") -> Path:
        path = self.folder / name
        # A program that was started with it before may be reading it: it is whole at every moment.
        new = path.with_name(f"{name}.new")
        new.write_text(text)
        new.replace(path)
        return path

    def record(self, *names: str, settings: str = "", out: Path | None = None, **options):
        """Records topics by name; gives the program and the folder into which it puts its bag."""
        study = self.study(
            '[session]\nname = "test"\n'
            f'[[sources]]\ntype = "topics"\nnames = {json.dumps(names)}\n'
            f'[[sinks]]\ntype = "bag"\n{settings}\n'
        )
        out = out or self.folder / "sessions"
        return self.teampulse("run", study, "--out", out, **options), out

    def demo(self, secs: float, *arguments) -> Path:
        """A recording of so many seconds of the demo."""
        out = self.folder / "sessions"
        demo = self.teampulse("demo", "--duration", secs, "--out", out, "--no-dashboard", *arguments)
        code = demo.ended(within_secs=secs + 60)
        assert code == 0, demo.report()
        return the_bag(out)

    def close(self) -> None:
        for program in reversed(self._programs):
            program.close()


def eventually(found, within_secs=PATIENCE_SECS):
    """Waits until something is found; gives it."""
    deadline = time.monotonic() + within_secs
    while not (result := found()):
        assert time.monotonic() < deadline, f"not within {within_secs:.0f} s"
        time.sleep(0.05)
    return result


def the_bag(out: Path) -> Path:
    """The only bag in a folder."""
    [metadata] = out.glob("*/metadata.yaml")
    return metadata.parent


def receive_buffer_bytes() -> int:
    """The largest receive buffer that a socket of ours gets: all that we ask for, where we may."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        # Linux's `SO_RCVBUFFORCE`, which Python has no name for.
        for option in (socket.SO_RCVBUF, 33):
            with contextlib.suppress(PermissionError):
                ours.setsockopt(socket.SOL_SOCKET, option, 32 << 20)
        # The kernel doubles what is asked for.
        return ours.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2


def rmem_max_bytes() -> int:
    """The largest receive buffer that the kernel gives to a socket."""
    setting = Path("/proc/sys/net/core/rmem_max")
    # Before Linux 6.9 a network namespace doesn't show it.
    return int(setting.read_text() if setting.exists() else os.environ["TEST_RMEM_MAX"])
