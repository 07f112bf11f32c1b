"""What every end-to-end test is given."""

import itertools
import os
import signal

import pytest

import harness
import network

# Whoever starts the tests may ignore hang-ups, as `nohup` does, and programs inherit that.
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# Two tests in a row do not meet, even if a program of the first lingers; nor do those of several processes where
# networks of their own can't be had.
PROCESS = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
domains = itertools.cycle(range(100 + PROCESS % 8 * 16, 116 + PROCESS % 8 * 16))


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
    yield stage.demo(20, "--seed", 7)
    stage.close()


@pytest.fixture(params=["cyclone", "fastdds"])
def peer(request, stage):
    """Each of the two DDS peers, by what starts it."""
    if request.param == "fastdds" and not harness.FASTDDS_PEER[0].exists():
        leave_out("the Fast DDS peer is not built on this system")
    return getattr(stage, request.param)


@pytest.fixture
def figure(request):
    """Reports a measured figure; all of them follow the tests' outcome."""
    return lambda text: request.node.user_properties.append(("figure", text))


# Files whose tests take a minute or more, the longest first. Whole files are handed out to processes: those that come
# last should be short, so that no process is left with a long one, and browsers should not all run at that time.
LONG = """
    dashboard_pages replay interop lsl live_is_afterwards tidy before_recording clocks
    import_device_files dashboard_for_everyone ends models bad_input team microphone people
    disk dashboard_h264 privacy statistics ros1_bags crash five_robots dashboard_server
""".split()


def pytest_collection_modifyitems(items) -> None:
    """Puts long files first."""
    place = {f"test_{name}": number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path.stem, len(place)))


# Last: the plugin that runs failed tests again has reached the first process by then.
@pytest.hookimpl(trylast=True)
def pytest_configure(config) -> None:
    """Gives each of several processes (`-n`) a network of its own, as tests that meet would disturb each other."""
    if hasattr(config, "workerinput") and network.is_isolated():
        network.enter_own()


def pytest_terminal_summary(terminalreporter) -> None:
    terminalreporter.section("figures")
    reports = [each for group in terminalreporter.stats.values() for each in group]
    for report in reports:
        if getattr(report, "when", None) == "call":
            for name, text in report.user_properties:
                terminalreporter.line(text) if name == "figure" else None


def leave_out(reason: str) -> None:
    """Leaves a test out where its peer can't be had; where all are demanded, fails it."""
    if os.environ.get("TEST_ALL_PEERS"):
        pytest.fail(reason)
    pytest.skip(reason)
