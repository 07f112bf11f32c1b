"""What raw numbers come to in windows and phases, live, is what numpy says of them afterwards."""

from functools import cache

import numpy as np
import pytest

import bags
import harness

STUDY = """
[session]
name = "statistics"

[[sources]]
type      = "robots"
namespace = "/robot*"

[[sources]]
type      = "people"
namespace = "/humans/persons/*"

[features]
windows_secs = [5]

[[phases]]
name      = "baseline"
from_secs = 4
to_secs   = 14

[[phases]]
name      = "task"
from_secs = 14
to_secs   = 22

[[sinks]]
type = "bag"

[simulate]
robots = 1
people = 1
seed   = 3

[simulate.task]
baseline_secs = 14
level_secs    = 8
rest_secs     = 4
levels        = [1]
"""
RECORDED_SECS = 32
STATISTICS = ["mean", "sd", "median", "mad", "minimum", "maximum", "slope"]
EXACT = {"median", "minimum", "maximum"}
EMG = "/humans/persons/p001/simulated/emg"
TEMPERATURE = "/humans/persons/p001/simulated/temperature"
ODOMETRY = "/robot1/odom"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """The bag of a short session with a robot and a person."""
    stage = harness.Stage(tmp_path_factory.mktemp("statistics"), 97)
    study, out = stage.study(STUDY), stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--duration", RECORDED_SECS, "--out", out)
    simulator = stage.teampulse("simulate", study)
    assert monitor.ended(within_secs=90) == 0, monitor.report()
    assert simulator.interrupt() == 0, simulator.report()
    yield harness.the_bag(out)
    stage.close()


@pytest.mark.parametrize("topic", [EMG, TEMPERATURE, ODOMETRY])
def test_windows_are_what_numpy_says_of_their_samples(bag, topic):
    times_ns, columns = samples(bag, topic)
    windows = [window for window in windows_of(bag, topic, "w5") if window.content.reasons[0] == 0]
    assert len(windows) > 10
    for window in windows:
        assert_exact(window, channels(bag, topic, "w5"), times_ns, columns)


@pytest.mark.parametrize("topic", [EMG, TEMPERATURE, ODOMETRY])
def test_phases_differ_from_the_baseline_as_numpy_says(bag, topic):
    times_ns, columns = samples(bag, topic)
    names = channels(bag, topic, "phases")
    baseline, differed = None, 0
    windows = windows_of(bag, topic, "phases")
    # Where a person's own phases take the place of the session's, one may be cut to nearly nothing.
    for phase in [each for each in windows if each.content.window_secs > 1]:
        name_of_phase = label(bag, phase)
        values = dict(zip(names, phase.content.values, strict=True))
        if phase.content.reasons[0] == 0:
            assert_exact(phase, names, times_ns, columns)
        if name_of_phase == "baseline":
            baseline = values
        for name in names:
            statistic, _, channel = name.partition("/")
            own = f"{statistic.removesuffix('_difference')}{'/' if channel else ''}{channel}"
            if not statistic.endswith("_difference") or np.isnan(values[name]):
                continue
            assert values[name] == values[own] - baseline[own]
            differed += name_of_phase != "baseline"
    assert differed >= len(names) / 2


def test_a_stream_whose_mean_means_nothing_says_so(bag):
    assert "not the muscle" in described(bag, f"{EMG}/statistics/w5").doc
    assert "means nothing" not in described(bag, f"{TEMPERATURE}/statistics/w5").doc


def test_a_study_can_leave_statistics_out(bag, stage):
    text = STUDY.replace("windows_secs = [5]", 'windows_secs = [5]\ndisable = ["statistics"]')
    out = stage.folder / "replay"
    answer = stage.ask("replay", bag, "--study", stage.study(text), "--out", out)
    assert answer.returncode == 0, answer.stderr
    assert any("/statistics/" in topic for topic in bags.raw(bag))
    assert not any("/statistics/" in topic for topic in bags.raw(harness.the_bag(out)))


def assert_exact(window, names, times_ns, columns):
    """All values of a window are numpy's of the samples in it."""
    end_ns = stamp_ns(window)
    begin_ns = end_ns - round(window.content.window_secs * 1e9)
    inside = (times_ns >= begin_ns) & (times_ns < end_ns)
    secs = (times_ns[inside] - begin_ns) / 1e9
    values = dict(zip(names, window.content.values, strict=True))
    for channel, column in columns.items():
        suffix = f"/{channel}" if len(columns) > 1 else ""
        numbers = column[inside]
        reach = np.ptp(numbers) or 1.0
        for statistic, exact in zip(STATISTICS, by_numpy(secs, numbers), strict=True):
            found = values[statistic + suffix]
            if statistic in EXACT:
                assert found == exact, (statistic, channel)
            else:
                assert abs(found - exact) < 1e-9 * max(reach, abs(exact)), (statistic, channel)


def by_numpy(secs, numbers):
    deviations = np.abs(numbers - np.median(numbers))
    slope = np.polyfit(secs - secs.mean(), numbers, 1)[0]
    return [
        numbers.mean(),
        numbers.std(ddof=1),
        np.median(numbers),
        np.median(deviations),
        numbers.min(),
        numbers.max(),
        slope,
    ]


def samples(bag, topic: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The times [ns] and the numbers of each channel of a raw stream."""
    names = described(bag, topic).channels
    times_ns, rows = [], []
    for message in messages(bag, topic):
        content = message.content
        if hasattr(content, "samples"):
            block = np.asarray(content.samples).reshape(-1, len(names))
            steps_ns = np.round(np.arange(len(block)) * content.period_ns).astype(np.int64)
            times_ns.extend(stamp_ns(message) + steps_ns)
            rows.extend(block)
        else:
            times_ns.append(stamp_ns(message))
            rows.append([field(content, name) for name in names])
    rows = np.array(rows)
    return np.array(times_ns), {name: rows[:, place] for place, name in enumerate(names)}


def field(content, path: str) -> float:
    for name in path.split("."):
        content = getattr(content, name)
    return float(content)


def label(bag, phase) -> str:
    """The name of the phase that was reported, by the event that began it."""
    begin_ns = stamp_ns(phase) - round(phase.content.window_secs * 1e9)
    events = messages(bag, "/session/events") + messages(bag, "/task/phases")
    begun = [each for each in events if each.content.kind == "phase"]
    nearest = min(begun, key=lambda each: abs(stamp_ns(each) - begin_ns))
    return nearest.content.label


def channels(bag, topic: str, leaf: str) -> list[str]:
    return described(bag, f"{topic}/statistics/{leaf}").channels


def windows_of(bag, topic: str, leaf: str) -> list:
    return messages(bag, f"{topic}/statistics/{leaf}")


def described(bag, name: str):
    """The newest description of a stream."""
    streams = messages(bag, "/teampulse/streams")
    return [each.content for each in streams if each.content.name == name][-1]


@cache
def messages(bag, topic_ends: str) -> list:
    return bags.messages(bag, topic_ends)


def stamp_ns(message) -> int:
    stamp = message.content.header.stamp
    return stamp.sec * 1_000_000_000 + stamp.nanosec
