"""A replay equals the run it came from, byte for byte, however often."""

import pytest

import bags
import harness

REPLAYS = 10


@pytest.mark.parametrize("bag", ["demo_bag", "five_robots_bag"])
def test_ten_replays_equal_the_run(request, stage, bag):
    original = request.getfixturevalue(bag)
    expected = derived(original)
    assert len(expected) > 20
    for attempt in range(REPLAYS):
        out = stage.folder / f"replay_{attempt}"
        answer = stage.ask("replay", original, "--out", out)
        assert answer.returncode == 0, answer.stderr
        again = derived(harness.the_bag(out))
        assert again.keys() == expected.keys()
        for topic, samples in expected.items():
            assert again[topic] == samples, f"{topic} differs in replay {attempt}"


def test_a_replay_keeps_what_is_raw(demo_bag, stage):
    answer = stage.ask("replay", demo_bag, "--out", stage.folder / "replay")
    assert answer.returncode == 0, answer.stderr
    replayed = bags.raw(harness.the_bag(stage.folder / "replay"))
    origins = bags.origins(demo_bag)
    for topic, samples in bags.raw(demo_bag).items():
        if origins[topic] == "raw":
            assert replayed[topic] == samples


def derived(bag) -> dict[str, list[tuple[int, bytes]]]:
    """All that was computed: log times and bytes, by topic."""
    origins = bags.origins(bag)
    return {topic: all_of for topic, all_of in bags.raw(bag).items() if origins[topic] == "derived"}
