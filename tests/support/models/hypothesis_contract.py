"""The contract of every hypothesis, checked on one fitted run."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.reduced.sensitivities import simulate_each
from sssi_exudyn.validation.diagnosis.diagnosis_data import Kind, Number
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun, Hypothesis, Probe, responses_of

UNSIGNED = ("gps_jump", "lever_arm")
"""Hypotheses whose sentence gives a distance; its direction is in the parameters."""


def check_statements(hypothesis: Hypothesis) -> None:
    """Check that name, kind, caption, formula or meaning, prior and distinctions are stated."""
    cls = type(hypothesis)
    assert hypothesis.name.isidentifier()
    assert hypothesis.name.islower()
    assert hypothesis.kind in get_args(Kind)
    assert hypothesis.caption
    assert not hypothesis.caption.endswith(".")
    assert (cls.__dict__.get("__doc__") or "").strip(), "no formula, nor the term that has it"
    assert hypothesis.weight > 0.0
    others = [other for distinction in hypothesis.distinctions for other in distinction.others]
    assert all(distinction.measurement for distinction in hypothesis.distinctions)
    assert len(others) == len(set(others))
    assert set(others) <= BY_NAME.keys() - {hypothesis.name}


def check_on_run(hypothesis: Hypothesis, fitted: FittedRun) -> None:
    """Check that probes move measurements and that candidates, their windows and their sentence fit the run."""
    probes = hypothesis.probes(fitted)
    size = len(fitted.prediction)
    responses = responses_of(probes, fitted.prepared, fitted.measurements)
    assert np.all(np.isfinite(responses))
    assert np.all(np.any(responses != 0.0, axis=0)), "a probe that nothing measures"
    for index in {0, len(probes) // 2, len(probes) - 1} if probes else ():
        check_probe(fitted, probes[index], responses[:, index])
    candidates = hypothesis.candidates(fitted, responses)
    assert candidates
    for index in {0, len(candidates) // 2, len(candidates) - 1}:
        check_candidate(hypothesis, fitted, candidates[index], size)
    check_linear(fitted, candidates[len(candidates) // 2])


def check_candidate(hypothesis: Hypothesis, fitted: FittedRun, candidate: Candidate, size: int) -> None:
    """Check a candidate's shapes and priors and its window inside the run.

    For both signs of the amplitudes there are a sentence and plain words.
    """
    count = len(candidate.amplitudes)
    assert candidate.free.columns.shape == (size, count)
    assert candidate.free.scales.shape == (count,)
    assert np.all(candidate.free.scales > 0.0)
    assert all(spread > 0.0 for spread in candidate.places.values())
    # only an amplitude of zero leaves the run as it was; a number of every model stands where it was fitted
    amplitudes = {name: candidate.model.value(name) for group in candidate.amplitudes for name in group}
    assert all(value == 0.0 or math.isclose(value, fitted.model.value(name)) for name, value in amplitudes.items())
    readings, plain = set(), set()
    for sign in (-1.0, 1.0):
        numbers = _numbers(candidate, sign * candidate.free.scales)
        window = hypothesis.window(fitted, candidate, numbers)
        if window is not None:
            assert fitted.run.time[0] <= window[0] < window[1] <= fitted.run.time[-1]
        sentence = hypothesis.sentence(numbers, fitted.model)
        assert sentence
        assert sentence[0].islower() or sentence[0] == "μ"  # it follows "between 3.0 s and 4.0 s"
        assert not sentence.endswith(".")
        readings.add(sentence)
        words = hypothesis.plain_words(numbers, fitted.model)
        assert words[0].islower()
        assert not words.endswith(".")
        assert not any(symbol in words for symbol in ("μ", "N s", "rad", "nan"))  # a coach's words
        plain.add(words)
    signed = any(candidate.model.bounds(group[0])[0] < 0.0 for group in candidate.amplitudes)
    expected = 2 if signed and hypothesis.name not in UNSIGNED else 1
    assert len(readings) == len(plain) == expected


def check_probe(fitted: FittedRun, probe: Probe, response: Array) -> None:
    """Check that the response is the derivative of runs with a little of the hypothesis.

    The derivative is by central differences with two steps, extrapolated.
    """
    now = probe.model.value(probe.number)
    assert now == 0.0 or math.isclose(now, fitted.model.value(probe.number))
    # so much that the track moves by 0.3 mm: little enough for points to touch down and lift off as in the run itself;
    # and a small part of what the number may be, as loads between instants are no straight line
    low, high = probe.model.bounds(probe.number)
    step = 3e-4 / max(float(np.max(np.abs(response[: fitted.measurements.blocks["height"].stop]))), 1e-3)
    step = min(step, 2e-4 * (high - low))
    models = [probe.model.with_values({probe.number: now + share * step}) for share in (-1.0, -0.5, 0.5, 1.0)]
    far, near, nearer, farther = simulate_each(models, fitted.prepared, fitted.measurements.predict)
    expected = (8.0 * (nearer - near) - (farther - far)) / (6.0 * step)
    for place in fitted.measurements.blocks.values():
        # the residual of Newton's method, a point that touches down in one of the runs, and rounding
        largest, seen = (float(np.max(np.abs(values[place]), initial=0.0)) for values in (expected, fitted.prediction))
        apart = np.max(np.abs(response[place] - expected[place]), initial=0.0)
        assert apart <= 1e-3 * largest + 1e-12 * seen / step, f"{apart:.3g} of {largest:.3g}"


def check_linear(fitted: FittedRun, candidate: Candidate) -> None:
    """Check the linear response of the first amplitude, put together from cells.

    The reference is the model with the term itself at a tenth of its usual strength.
    """
    size = 0.1 * candidate.free.scales[0]
    names = candidate.amplitudes[0]
    changed = candidate.model.with_values({name: candidate.model.value(name) + size for name in names})
    moved = simulate_each([changed], fitted.prepared, fitted.measurements.predict)[0] - fitted.prediction
    track = slice(0, fitted.measurements.blocks["height"].stop)
    expected = size * candidate.free.columns[track, 0]
    # a third of the largest change, or 3 mm: cells of 0.4 s for the shapes that are put together, and the curvature of
    # what a few of the terms do
    allowed = 0.003 + 0.35 * np.max(np.abs(expected))
    assert np.max(np.abs(moved[track] - expected)) < allowed


def _numbers(candidate: Candidate, sizes: Array) -> dict[str, Number]:
    values = {group[0]: float(size) for group, size in zip(candidate.amplitudes, sizes, strict=True)}
    values |= {name: candidate.model.value(name) for name in candidate.places}
    return {name.partition(".")[2]: Number(value, value, value, "1") for name, value in values.items()}
