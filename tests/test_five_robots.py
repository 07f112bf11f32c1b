"""The paper's figure, read by `rosbags` from a recorded run of `studies/five_robots.toml`."""

from dataclasses import dataclass

import numpy as np
import pytest

import bags

ROBOTS = [f"robot{k}" for k in range(1, 6)]
ROUTER_M = np.array([0.3, 0.3])
STEPS = 600
# Between these steps robot 4 consumes more.
RAISED = (250, 420)
# The longest that utilization looks back.
WINDOW_SECS = 60


@dataclass
class Series:
    """Values over the simulation's steps."""

    steps: np.ndarray
    values: np.ndarray

    def between(self, start: float, end: float) -> np.ndarray:
        return self.values[(self.steps >= start) & (self.steps < end)]


@pytest.fixture(scope="module")
def began_secs(five_robots_bag) -> float:
    """When the simulation began: so many steps of a second before its last truth."""
    return max(each.log_secs for each in bags.messages(five_robots_bag, "truth/robot1")) - STEPS


@pytest.fixture(scope="module")
def rssi(five_robots_bag, began_secs) -> dict[str, Series]:
    """The signal level of each robot's Wi-Fi [dBm]."""
    return {
        robot: series(five_robots_bag, f"/{robot}/wifi", began_secs, lambda m: m.signal_level)
        for robot in ROBOTS
    }


@pytest.fixture(scope="module")
def distance_m(five_robots_bag, began_secs) -> dict[str, Series]:
    """The true distance of each robot to the router."""

    def to_router_m(truth) -> float:
        position = truth.pose.pose.position
        return float(np.hypot(*(np.array([position.x, position.y]) - ROUTER_M)))

    return {
        robot: series(five_robots_bag, f"/sim/truth/{robot}", began_secs, to_router_m)
        for robot in ROBOTS
    }


@pytest.fixture(scope="module")
def utilization_w(five_robots_bag, began_secs) -> dict[str, Series]:
    """The power that each robot takes from its battery, as the session computed it."""
    return {
        robot: series(
            five_robots_bag, f"/{robot}/battery_state/use/w30", began_secs, lambda m: m.values[0]
        )
        for robot in ROBOTS
    }


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_signal_is_weak_at_the_start(rssi, robot):
    assert np.median(rssi[robot].between(0, 30)) < np.percentile(rssi[robot].values, 90) - 5


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_signal_falls_with_distance_to_the_router(rssi, distance_m, figure, robot):
    truth = distance_m[robot]
    assert len(truth.steps) > 0.9 * STEPS
    heard_dbm = [np.median(rssi[robot].between(step - 1, step + 1)) for step in truth.steps]
    correlation = rank_correlation(np.log(truth.values), np.array(heard_dbm))
    figure(f"{robot}: rank correlation of RSSI with log distance {correlation:.2f} (bar -0.7)")
    assert correlation < -0.7


def test_utilization_rises_while_robot_4_computes_more(utilization_w, figure):
    ratio = raised_to(utilization_w["robot4"])
    figure(f"robot4: utilization in steps 250-420 is {ratio:.2f} times that outside (bar 1.5)")
    assert ratio >= 1.5


@pytest.mark.parametrize("robot", [robot for robot in ROBOTS if robot != "robot4"])
def test_utilization_of_the_others_does_not_rise(utilization_w, figure, robot):
    ratio = raised_to(utilization_w[robot])
    figure(f"{robot}: utilization in steps 250-420 is {ratio:.2f} times that outside (bar 1.2)")
    assert ratio < 1.2


def raised_to(utilization_w: Series) -> float:
    """Utilization while robot 4's is raised, as a multiple of that before and after."""
    start, end = RAISED
    raised_w = np.median(utilization_w.between(start + WINDOW_SECS, end))
    before_w = utilization_w.between(WINDOW_SECS, start)
    after_w = utilization_w.between(end + WINDOW_SECS, STEPS)
    return raised_w / np.median(np.concatenate([before_w, after_w]))


def series(bag, topic: str, began_secs: float, value) -> Series:
    found = [each for each in bags.messages(bag, topic) if each.topic == topic]
    steps = np.array([each.log_secs for each in found]) - began_secs
    values = np.array([value(each.content) for each in found])
    usable = np.isfinite(values)
    assert usable.any(), f"there is nothing on {topic}"
    return Series(steps[usable], values[usable])


def rank_correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Spearman's; ties by their mean rank."""

    def ranks(values: np.ndarray) -> np.ndarray:
        _, place, count = np.unique(values, return_inverse=True, return_counts=True)
        return (np.cumsum(count) - (count - 1) / 2)[place]

    usable = np.isfinite(one) & np.isfinite(other)
    return float(np.corrcoef(ranks(one[usable]), ranks(other[usable]))[0, 1])
