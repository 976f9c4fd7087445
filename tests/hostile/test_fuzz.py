"""Mutated files: a few at every run of the tests, many in the slow part; see ``fuzzing``."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from fuzzing import LIMIT_BYTES, Guard, fuzz, judge, mutate
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tiny import Tiny

QUICK, EVERY, MANY = 30, 150, 2000


@pytest.mark.long
def test_a_few_mutated_files_give_one_clear_line(tmp_path: Path) -> None:
    tally = fuzz(QUICK, seed=7, keep=tmp_path / "keep")
    assert tally.findings == []
    assert tally.counts["refused"] > QUICK // 3  # else nothing was mutated
    assert tally.counts["taken"] + tally.counts["refused"] == QUICK
    assert tally.memory[0] < LIMIT_BYTES


@pytest.mark.long
def test_mutated_files_of_every_reader_give_one_clear_line(tmp_path: Path) -> None:
    tally = fuzz(EVERY, seed=11, keep=tmp_path / "keep", kinds=("reader", "day"))
    assert tally.findings == []
    assert tally.counts["refused"] > EVERY // 4  # else nothing was mutated; a damaged record often costs itself alone
    assert tally.memory[0] < LIMIT_BYTES


def test_the_judge_sees_a_recording_that_leads_out_of_its_folder(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("secret", encoding="utf-8")
    guard = Guard(secret)
    guard.folder = tmp_path / "case"
    secret.read_text(encoding="utf-8")
    (tmp_path / "stray").write_text("x", encoding="utf-8")
    guard.folder = None
    assert any("secret" in seen for seen in guard.seen)
    assert any("stray" in seen for seen in guard.seen)


@pytest.mark.slow
def test_many_mutated_files_give_one_clear_line(tmp_path: Path) -> None:
    tally = fuzz(MANY, seed=int(os.environ.get("FUZZ_SEED", "1")), keep=tmp_path / "keep")
    assert tally.findings == []


@pytest.mark.slow
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    file=st.sampled_from(("recording.toml", "motion.bvh", "gps.csv", "insoles.csv")),
    seeds=st.lists(st.integers(0, 2**32), min_size=1, max_size=4),
)
def test_hypothesis_finds_no_recording_that_is_not_answered_clearly(
    tmp_path: Path, file: str, seeds: list[int]
) -> None:
    """Hypothesis shrinks a finding to the fewest mutations."""
    folder = Tiny().write(tmp_path / "case" / "in")
    data = (folder / file).read_bytes()
    for seed in seeds:
        data = mutate(data, random.Random(seed))
    (folder / file).write_bytes(data)
    verdict, message = judge(tmp_path / "case", ["recording.toml"], "recording to fit", None)
    assert verdict != "finding", message
