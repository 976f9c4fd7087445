"""The page of the faults concealed in real runs: its script makes it from the stored answers."""

from types import ModuleType

import pytest
from docs_script import DOCS, docs_script

from sssi_exudyn.validation.benchmark.semi_real import FAULTS


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return docs_script("make_semi_real")


def test_the_page_is_of_the_answers(script: ModuleType) -> None:
    assert script.page() == (DOCS / "notebook" / "semi-real.md").read_text(encoding="utf-8")


def test_every_run_was_diagnosed_untouched_and_with_each_fault_or_none(script: ModuleType) -> None:
    faults: dict[str, set[str]] = {}
    for case, commit in script.kept():
        assert len(commit) >= 7
        faults.setdefault(case.recording, set()).add(case.fault)
    assert all(concealed in ({"none"}, {"none", *FAULTS}) for concealed in faults.values())


def test_nothing_of_a_recording_is_kept_but_answers(script: ModuleType) -> None:
    for case, _ in script.kept():
        assert case.diagnosis.track_distance is case.diagnosis.way is case.diagnosis.latent_force is None
