"""A microphone of this computer, over PulseAudio: how somebody speaks is recorded, and not what."""

import os
import signal
import subprocess
import time

import bags
import harness
import numpy
import pytest
from tables import described
from test_ros_audio import RATE_HZ, SENTENCE, kept_files, spoken, traces, vowel

VOICE = "/humans/persons/p001/microphone/voice"
SOUND = "/humans/persons/p001/microphone/audio"
STUDY = """
[[sources]]
type = "microphone"
person = "p001"
device = "room.monitor"
{more}
[[sinks]]
type = "bag"
tidy = false
[features]
windows_secs = [3]
"""


class Server:
    """PulseAudio with a loudspeaker that is not there, whose sound is the microphone's."""

    def __init__(self, stage):
        self.stage = stage
        self.folder = stage.folder / "pulse"
        self.folder.mkdir(mode=0o700, exist_ok=True)
        self.socket = self.folder / "native"
        self.env = {
            **os.environ, "HOME": str(self.folder), "XDG_RUNTIME_DIR": str(self.folder), "PULSE_RUNTIME_PATH": str(self.folder),
            "PULSE_SERVER": f"unix:{self.socket}",
        }  # fmt: skip
        self.begin()

    def begin(self) -> None:
        self.socket.unlink(missing_ok=True)
        modules = [
            f"module-native-protocol-unix socket={self.socket} auth-anonymous=1",
            f"module-null-sink sink_name=room rate={RATE_HZ} channels=1 format=s16le",
        ]
        command = ["pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disallow-exit"]
        loads = [word for module in modules for word in ("-L", module)]
        self.process = subprocess.Popen([*command, *loads], env=self.env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        harness.eventually(lambda: "room.monitor" in self.ask("list", "short", "sources"))

    def ask(self, *words: str) -> str:
        return subprocess.run(["pactl", *words], env=self.env, capture_output=True, text=True).stdout

    def play(self, sound: numpy.ndarray) -> None:
        """Plays samples of 16 bits, and returns when they were heard."""
        command = ["paplay", "--raw", f"--rate={RATE_HZ}", "--channels=1", "--format=s16le", "--device=room", "--latency-msec=100"]
        subprocess.run(command, env=self.env, input=sound.astype("<i2").tobytes(), check=True)

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


@pytest.fixture
def server(stage):
    server = Server(stage)
    yield server
    server.kill()


def run(stage, server, more=""):
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(STUDY.format(more=more)), "--out", out, env=server.env)
    return monitor, out


def is_heard(monitor, stream: str):
    harness.eventually(lambda: f"{stream} ok" in " ".join(monitor.stderr.split()), within_secs=30)


def test_how_somebody_speaks_is_recorded(stage, server, figure):
    monitor, out = run(stage, server)
    is_heard(monitor, VOICE)
    server.play(vowel(151.0, 6.0))
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    stream = described(bag)[VOICE]
    assert (stream.id, stream.signal, stream.rate_hz) == ("p001", "audio", 100.0)
    windows = bags.messages(bag, f"{VOICE}/voice/w3")
    names = described(bag)[f"{VOICE}/voice/w3"].channels
    values = numpy.array([each.content.values for each in windows])
    pitch = values[:, next(place for place, name in enumerate(names) if "pitch" in name.lower())]
    pitch = pitch[numpy.isfinite(pitch)]
    assert len(pitch) >= 2, names
    off = numpy.abs(pitch - 151).max() / 151
    figure(f"pitch of a microphone over PulseAudio: within {off:.2%} of the true one (bar 1 %)")
    assert off < 0.01, pitch


def test_the_sound_has_its_exact_level_where_it_is_asked_for(stage, server, figure):
    monitor, out = run(stage, server, "raw_audio = true")
    is_heard(monitor, SOUND)
    tone = 8000 * numpy.sin(2 * numpy.pi * 440 * numpy.arange(3 * RATE_HZ) / RATE_HZ)
    server.play(tone)
    assert monitor.interrupt() == 0, monitor.report()
    waves = bags.messages(harness.the_bag(out), SOUND)
    sound = numpy.concatenate([numpy.array(each.content.samples) for each in waves])
    loud = numpy.flatnonzero(numpy.abs(sound) > 0.1)
    assert len(loud) > 2 * RATE_HZ
    middle = sound[loud[0] + RATE_HZ // 2 : loud[0] + RATE_HZ // 2 + 2 * RATE_HZ]
    level, expected = numpy.sqrt(numpy.mean(middle**2)), 8000 / 32768 / numpy.sqrt(2)
    off = abs(level / expected - 1)
    figure(f"level of a microphone over PulseAudio: {off:.3%} off (bar 0.5 %)")
    assert off < 0.005


def test_a_server_that_was_killed_is_heard_again(stage, server, figure):
    monitor, out = run(stage, server)
    is_heard(monitor, VOICE)
    server.kill()
    harness.eventually(lambda: "microphone of p001 is gone" in monitor.stderr)
    server.begin()
    back = time.time()
    server.play(vowel(151.0, 5.0))
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    arrived = [each.log_secs for each in bags.messages(bag, VOICE)]
    again = min(at for at in arrived if at > back)
    figure(f"microphone after its server was killed: heard {again - back:.1f} s after it was back (bar 3)")
    assert again - back < 3
    assert [name for name in described(bag) if name.endswith("/microphone/voice")] == [VOICE]


def test_a_known_sentence_leaves_no_trace(stage, server):
    sound = spoken(SENTENCE)
    monitor, out = run(stage, server)
    is_heard(monitor, VOICE)
    server.play(sound)
    assert monitor.interrupt() == 0, monitor.report()
    assert sum(len(each.content.samples) for each in bags.messages(harness.the_bag(out), VOICE)) > 1000
    assert traces(sound, kept_files(out) + monitor.stdout.encode() + monitor.stderr.encode()) == 0


def test_a_microphone_that_is_not_there_is_named_with_those_that_are(stage, server):
    (stage.folder / "sessions").mkdir(exist_ok=True)
    study = stage.study(STUDY.format(more="").replace("room.monitor", "headset"))
    monitor = stage.teampulse("run", study, "--out", stage.folder / "sessions", env=server.env)
    monitor.wait_for("this computer has none")
    server.kill()
    monitor.wait_for("connect to the sound server: ")
    monitor.interrupt()
