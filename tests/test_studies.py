"""Every study of `studies/` runs."""

import tomllib

import pytest

import harness

STUDIES = sorted((harness.ROOT / "studies").glob("*.toml"))


def test_there_are_studies():
    assert STUDIES


@pytest.mark.parametrize("study", STUDIES, ids=lambda path: path.stem)
def test_a_study_runs(stage, study):
    settings = tomllib.loads(study.read_text())
    monitor = stage.teampulse("run", study, "--duration", 5, "--out", stage.folder / "sessions")
    if "simulate" in settings:
        stage.teampulse("simulate", study)
    assert monitor.ended() == 0, monitor.report()
