"""What every end-to-end test is given."""

import itertools
import os
import signal

import pytest

import harness

# Whoever starts the tests may ignore hang-ups, as `nohup` does, and programs inherit that.
signal.signal(signal.SIGHUP, signal.SIG_DFL)

FIGURES = pytest.StashKey[list[str]]()

# Two tests in a row do not meet, even if a program of the first lingers.
domains = itertools.cycle(range(100, 200))


@pytest.fixture
def stage(tmp_path):
    """A domain and a folder of one's own; whatever was started there is ended afterwards."""
    stage = harness.Stage(tmp_path, next(domains))
    yield stage
    stage.close()


@pytest.fixture(scope="session")
def five_robots_bag(tmp_path_factory):
    """The whole of `studies/five_robots.toml`, simulated by one process and recorded by another."""
    stage = harness.Stage(tmp_path_factory.mktemp("five_robots"), next(domains))
    study, out = harness.ROOT / "studies/five_robots.toml", stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out)
    simulator = stage.teampulse("simulate", study)
    assert simulator.ended(within_secs=120) == 0, simulator.report()
    assert monitor.interrupt() == 0, monitor.report()
    yield harness.the_bag(out)
    stage.close()


@pytest.fixture(scope="session")
def demo_bag(tmp_path_factory):
    """Twenty seconds of the demo."""
    stage = harness.Stage(tmp_path_factory.mktemp("demo"), next(domains))
    out = stage.folder / "sessions"
    demo = stage.teampulse("demo", "--duration", 20, "--out", out, "--seed", 7)
    assert demo.ended(within_secs=60) == 0, demo.report()
    yield harness.the_bag(out)
    stage.close()


@pytest.fixture(params=["cyclone", "fastdds"])
def peer(request, stage):
    """Each of the two DDS peers, by what starts it."""
    if request.param == "fastdds" and not harness.FASTDDS_PEER[0].exists():
        leave_out("the Fast DDS peer is not built on this system")
    return getattr(stage, request.param)


@pytest.fixture
def figure(request):
    """Tells a measured figure; all of them stand below the tests' outcome."""
    return lambda text: request.config.stash.setdefault(FIGURES, []).append(text)


def pytest_terminal_summary(terminalreporter, config) -> None:
    terminalreporter.section("figures")
    for text in config.stash.get(FIGURES, []):
        terminalreporter.line(text)


def leave_out(reason: str) -> None:
    """Leaves a test out where its peer can't be had; where all are demanded, fails it."""
    if os.environ.get("TEST_ALL_PEERS"):
        pytest.fail(reason)
    pytest.skip(reason)
