"""teampulse hears a sound card of Linux' own (snd-aloop) through PulseAudio, in a virtual machine: what is not ours is
everything below PulseAudio's socket."""

import os
import subprocess
from pathlib import Path

import bags
import harness
import numpy
import pytest

HERE = Path(__file__).parent
KERNEL = harness.ROOT / "target/vm/kernel"
BOOT_SECS = 600
SOUND = "/humans/persons/p001/microphone/audio"
TONE_HZ, LEVEL = 1000.0, 0.5 / numpy.sqrt(2)


class Results:
    """What a session in the virtual machine left."""

    def __init__(self, folder: Path):
        self.folder = folder

    def text(self, name: str) -> str:
        return (self.folder / name).read_text()


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    command = [HERE / "boot", KERNEL, folder, HERE / "sound"]
    env = {**os.environ, "TEAMPULSE": str(harness.TEAMPULSE)}
    ran = subprocess.run(list(map(str, command)), env=env, capture_output=True, text=True, timeout=BOOT_SECS)
    logs = "\n".join(f"--- {each.name}\n{each.read_text()}" for each in sorted(folder.glob("*.*")))
    assert (folder / "recorded").is_dir(), ran.stdout + ran.stderr + logs
    return Results(folder)


def test_scan_lists_the_sound_card(results):
    assert "microphone" in results.text("scan.txt")


def test_a_tone_has_its_exact_level_and_pitch(results):
    assert results.text("run.code").strip() == "0", results.text("run.err")
    waves = bags.messages(harness.the_bag(results.folder / "recorded"), SOUND)
    rate_hz = 1e9 / waves[0].content.period_ns
    sound = numpy.concatenate([numpy.array(each.content.samples) for each in waves])
    # The middle of its longest part without a pause: a virtual machine is not always in time.
    envelope = numpy.convolve(numpy.abs(sound), numpy.ones(400) / 400, "same")
    loud = numpy.flatnonzero(envelope > 0.3)
    steps = numpy.split(loud, numpy.flatnonzero(numpy.diff(loud) > 1) + 1)
    part = sound[max(steps, key=len)][400:-400]
    assert len(part) > rate_hz / 2, len(part)
    level = numpy.sqrt(numpy.mean(part**2))
    spectrum = numpy.abs(numpy.fft.rfft(part * numpy.hanning(len(part))))
    pitch_hz = spectrum.argmax() * rate_hz / len(part)
    print(f"level {level / LEVEL - 1:+.3%} (1 %), tone at {pitch_hz:.0f} Hz in {len(part) / rate_hz:.1f} s")
    assert abs(level / LEVEL - 1) < 0.01 and abs(pitch_hz - TONE_HZ) < 5
