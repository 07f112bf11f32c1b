"""A person's microphone on ROS: how somebody speaks is recorded, and not what."""

import io
import struct
import subprocess
import time
import wave

import bags
import harness
import numpy
import pytest
from tables import described

TOPIC = "/humans/voices/v1/audio"
VOICE = "/humans/persons/p001/microphone/voice"
RATE_HZ = 16_000
BLOCK = 320
SENTENCE = "my password is blue elephant forty two"
STUDY = """
[[sources]]
type = "ros_audio"
topic = "/humans/voices/v1/audio"
person = "p001"
{more}
[[sinks]]
type = "bag"
tidy = false
[features]
windows_secs = [3]
"""


def data(samples: numpy.ndarray) -> str:
    """An AudioData of samples of 16 bits, as hexadecimal."""
    content = samples.astype("<i2").tobytes()
    return (b"\0\1\0\0" + struct.pack("<I", len(content)) + content).hex()


def info(rate_hz=RATE_HZ, form="S16LE", coding="wave") -> str:
    """An AudioInfo of one channel, as hexadecimal."""

    def text(word: str) -> bytes:
        return struct.pack("<I", len(word) + 1) + word.encode() + b"\0"

    body = struct.pack("<BxxxI", 1, rate_hz) + text(form)
    body += bytes(-len(body) % 4) + struct.pack("<I", 16 * rate_hz) + text(coding)
    return (b"\0\1\0\0" + body).hex()


def vowel(pitch_hz: float, secs: float) -> numpy.ndarray:
    """A buzz with the harmonics of a voice, and a pause of a second at its end."""
    t = numpy.arange(int(secs * RATE_HZ)) / RATE_HZ
    tone = sum(numpy.sin(2 * numpy.pi * k * pitch_hz * t) / k for k in range(1, 15))
    noise = numpy.random.default_rng(1).normal(0, 20, len(t) + RATE_HZ)
    return numpy.concatenate([4000 * tone, numpy.zeros(RATE_HZ)]) + noise


def spoken(words: str) -> numpy.ndarray:
    """What espeak-ng says, at our rate."""
    said = subprocess.run(["espeak-ng", "--stdout", words], check=True, capture_output=True).stdout
    with wave.open(io.BytesIO(said)) as file:
        rate_hz, sound = file.getframerate(), numpy.frombuffer(file.readframes(file.getnframes() % 2**30), "<i2")
    places = numpy.arange(0, len(sound) - 1, rate_hz / RATE_HZ)
    return numpy.interp(places, numpy.arange(len(sound)), sound)


class Microphone:
    """A node that publishes sound as audio_capture does."""

    def __init__(self, stage, about: str | None = None):
        if about is not None:
            kind = "audio_common_msgs/msg/AudioInfo"
            self.about = stage.cyclone("send", f"{TOPIC}_info", "--type", kind, "--subscribers", 1)
        kind = "audio_common_msgs/msg/AudioData"
        self.sound = stage.cyclone("send", TOPIC, "--type", kind, "--subscribers", 1)
        self.sound.answer("matched")
        if about is not None:
            self.about.answer("matched")
            self.about.say(about)

    def play(self, sound: numpy.ndarray) -> None:
        """Blocks of 20 ms, as they come."""
        began = time.monotonic()
        for number, start in enumerate(range(0, len(sound) - BLOCK, BLOCK)):
            self.sound.say(data(sound[start : start + BLOCK]))
            time.sleep(max(0.0, began + (number + 1) * BLOCK / RATE_HZ - time.monotonic()))


def run(stage, more=""):
    out = stage.folder / "sessions"
    return stage.teampulse("run", stage.study(STUDY.format(more=more)), "--out", out), out


def kept_files(folder) -> bytes:
    """All bytes of a session's folder, with those of its messages as they are, and not compressed."""
    files = b"".join(path.read_bytes() for path in folder.rglob("*") if path.is_file())
    return files + b"".join(message for _, _, message in bags.stored(harness.the_bag(folder)))


def traces(sound: numpy.ndarray, content: bytes) -> int:
    """How many of a hundred loud pieces of 16 samples are in bytes, in any of the forms in which they could be."""
    loud = numpy.flatnonzero(numpy.abs(sound[:-16]) > 2000)
    places = numpy.random.default_rng(2).choice(loud, 100)
    found = 0
    for place in places:
        piece = sound[place : place + 16].astype("<i2")
        scaled = piece / 32768
        forms = (piece, piece.astype(">i2"), scaled.astype("<f4"), scaled.astype("<f8"), piece.astype("<f8"), (piece >> 8).astype("i1"))
        found += any(form.tobytes() in content for form in forms)
    return found


def test_how_somebody_speaks_is_recorded(stage, figure):
    monitor, out = run(stage)
    microphone = Microphone(stage, info())
    microphone.play(vowel(151.0, 6.0))
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
    figure(f"pitch of a microphone on ROS: within {off:.2%} of the true one (bar 1 %)")
    assert off < 0.01, pitch
    # Their times are those of the sound, not of its arrival: a quarter of a second earlier.
    frames = bags.messages(bag, VOICE)
    late = [each.log_secs - (each.content.header.stamp.sec + each.content.header.stamp.nanosec / 1e9) for each in frames[20:]]
    assert 0.15 < numpy.median(late) < 0.5, numpy.median(late)


def test_a_known_sentence_leaves_no_trace(stage):
    sound = spoken(SENTENCE)
    monitor, out = run(stage, f"rate_hz = {RATE_HZ}")
    Microphone(stage).play(sound)
    assert monitor.interrupt() == 0, monitor.report()
    frames = bags.messages(harness.the_bag(out), VOICE)
    assert sum(len(each.content.samples) for each in frames) > 1000
    content = kept_files(out) + monitor.stdout.encode() + monitor.stderr.encode()
    assert traces(sound, content) == 0


def test_where_the_sound_is_asked_for_it_is_there(stage):
    sound = spoken(SENTENCE)
    monitor, out = run(stage, f"rate_hz = {RATE_HZ}\nraw_audio = true")
    Microphone(stage).play(sound)
    assert monitor.interrupt() == 0, monitor.report()
    # So the search above finds what there is, but for pieces that are in two messages.
    assert traces(sound, kept_files(out)) >= 85


@pytest.mark.parametrize(
    ("about", "words"),
    [(info(coding="mp3"), "encoded as `mp3`"), (info(form="Q7"), "format `Q7`"), (info(rate_hz=2000), "at 2000 Hz")],
)
def test_sound_that_can_not_be_heard_is_named_with_the_remedy(stage, about, words):
    monitor, out = run(stage)
    microphone = Microphone(stage, about)

    def found() -> bool:
        microphone.about.say(about)
        microphone.play(vowel(150, 0.1)[: 4 * BLOCK])
        return words in monitor.stderr

    harness.eventually(found)
    # Blocks that are empty, or cut off in a sample, hurt nobody.
    for broken in ("00010000" + "00000000", "00010000" + "03000000010203", "0001", data(numpy.zeros(0))):
        microphone.sound.say(broken)
    assert monitor.interrupt() == 0, monitor.report()
    assert harness.the_bag(out).exists()
