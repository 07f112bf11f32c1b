"""Where a device's own clock runs fast, and how fast is found out while samples come, what is computed live
is what `extract --method causal` finds in the same samples at the times that they got, bit for bit."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import bags
import harness
import recorded
import tables
from windows import by_end, is_number, secs, windows

WINDOW_SECS = 20
LASTS_SECS = 120
FAST_PPM = 900
STUDY = f"""
[session]
name = "drifting"
[features]
windows_secs = [{WINDOW_SECS}]
[[sinks]]
type = "bag"
"""


@dataclass
class Drifting(recorded.Signal):
    """Sent as a device with a clock does: in chunks, each on its way for another while."""

    def waves(self):
        rng, begin = np.random.default_rng(7), 0
        while begin < len(self.samples):
            end = begin + max(1, int(self.rate_hz / 4))
            chunk = self.samples[begin:end]
            sent_secs = (begin + len(chunk)) / self.rate_hz * (1 - FAST_PPM * 1e-6)
            came_ns = recorded.BEGIN_NS + round((sent_secs + 0.02 + rng.exponential(0.01)) * 1e9)
            content = dict(
                device_time=round(begin / self.rate_hz * 1e9),
                index=begin,
                period_ns=1e9 / self.rate_hz,
                channels=1,
                samples=chunk.astype(float),
            )
            yield came_ns, came_ns, content
            begin = end


def pulses(rate_hz: float) -> np.ndarray:
    """70 to 80 beats a minute, with a little noise."""
    at_secs = np.arange(0, LASTS_SECS, 1 / rate_hz)
    phase = 1.25 * at_secs + 0.1 * np.sin(0.25 * at_secs)
    beat = sum(
        height * np.exp(-(((phase - place) % 1 - 0.5) ** 2) / (2 * width**2))
        for height, place, width in ((1, 0, 0.09), (0.3, 0.35, 0.1))
    )
    return 500 + 100 * beat + np.random.default_rng(5).normal(0, 0.5, len(beat))


def warmth(rate_hz: float) -> np.ndarray:
    at_secs = np.arange(0, LASTS_SECS, 1 / rate_hz)
    return 33 + 0.2 * np.sin(at_secs / 20) + np.random.default_rng(6).normal(0, 0.01, len(at_secs))


SIGNALS = {
    "pulse": Drifting("p001", "band", "ppg", 64.0, {"ppg": "1"}, pulses(64)),
    "skin_temperature": Drifting("p001", "band", "temperature", 4.0, {"skin": "degC"}, warmth(4)),
}


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    stage = harness.Stage(tmp_path_factory.mktemp("drifting"), 92)
    yield stage
    stage.close()


@pytest.fixture(scope="module")
def bag(stage):
    recording = recorded.write(list(SIGNALS.values()), stage.folder / "recording.mcap")
    study, out = stage.study(STUDY), stage.folder / "out"
    answer = stage.ask("replay", recording, "--study", study, "--out", out)
    assert answer.returncode == 0, answer.stderr
    return harness.the_bag(out)


def samples(stage, bag, signal: Drifting) -> Path:
    """Each sample at the time that it got, as a table."""
    only = ("--pivot", signal.topic, "--stream", signal.topic)
    answer = stage.ask("export", bag, *only, "--out", stage.folder / signal.name)
    assert answer.returncode == 0, answer.stderr
    rows = (stage.folder / signal.name / "aligned.csv").read_text().splitlines()[1:]
    table = stage.folder / f"{signal.name}.csv"
    named = ["measured_secs", *signal.channels]
    table.write_text("\n".join(",".join(row.split(",")[:2]) for row in [",".join(named), *rows]))
    return table


def test_how_fast_the_clock_runs_is_found_out_while_samples_come(bag):
    health = [each.content for each in bags.messages(bag, "/teampulse/status")]
    found = [each.skew_ppm for each in health if each.name == SIGNALS["pulse"].topic]
    found = [ppm for ppm in found if not math.isnan(ppm)]
    assert abs(found[0] - FAST_PPM) > 100 and abs(found[-1] - FAST_PPM) < 20
    # The line through its delays is laid anew every four seconds.
    assert len(set(found)) > LASTS_SECS / 4


@pytest.mark.parametrize("leaf", SIGNALS)
def test_live_is_what_is_extracted_afterwards_of_a_moving_rate(stage, bag, leaf):
    signal = SIGNALS[leaf]
    live = windows(bag, f"{signal.topic}/{leaf}/w{WINDOW_SECS}")
    described = tables.described(bag)[signal.topic]
    extracted = tables.extracted(stage, samples(stage, bag, signal), described, WINDOW_SECS)
    afterwards = by_end(extracted["features"], WINDOW_SECS)
    assert len(afterwards) > LASTS_SECS - WINDOW_SECS - 2
    assert {end: live.get(end) for end in afterwards} == afterwards
    assert any(is_number(value) for value in afterwards[max(afterwards)])


def test_pulses_are_those_that_are_found_afterwards(stage, bag):
    signal = SIGNALS["pulse"]
    described = tables.described(bag)[signal.topic]
    extracted = tables.extracted(stage, samples(stage, bag, signal), described, WINDOW_SECS)
    live = sorted(secs(each) for each in bags.messages(bag, f"{signal.topic}/pulses"))
    assert len(live) > LASTS_SECS
    assert live == [each["time_secs"] for each in extracted["events"] if each["kind"] == "pulse"]
