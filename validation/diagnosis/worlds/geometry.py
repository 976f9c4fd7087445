"""A recording's run as worlds are made of it: what forces and laws do to its measurements, all linear about one fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.diagnosis_data import Kind
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun, Hypothesis
from sssi_exudyn.validation.diagnosis.search.missing_force import (
    along_course,
    carried_by_soles,
    course_of,
    gain_of,
    latent_covariance,
)

_FARTHEST: Final = 10.0
"""Usual sizes up to which limits of an effect are looked for."""
_HALVINGS: Final = 8
"""Halvings of that, to some 0.04 of a usual size."""
_ROUNDING: Final = 1e-9
"""Share by which a number stays on this side of its bound."""


@dataclass(frozen=True)
class Geometry:
    """What worlds of a run are made of.

    linear, levels : the run linearised about its fit, and the noise that its measurements are weighed by
    candidates, kinds : of each hypothesis by its name, without those that no instrument shows
    limits : (c, w, 2) of its c candidates: how many usual sizes each amplitude may have, to either side
    edges : (c + 1,) s of the cells of time
    by_body : (N, 3·c) what a newton at the centre of mass does, along, across and normal to the skis, in each cell
    by_foot : (2, N, 3·c) the same of a newton on the left or the right foot
    following : (3·c, N) the force that does nearly what moves the measurements so
    speed, place : (c,) m/s and m down the fall line;  load : (2, c) N on each foot
    waves : m, usual height of the slope's own waves; 0 on a plane
    """

    linear: LinearModel
    levels: NoiseLevels
    candidates: Mapping[str, Sequence[Candidate]]
    limits: Mapping[str, Array]
    kinds: Mapping[str, Kind]
    edges: Array
    by_body: Array
    by_foot: Array
    following: Array
    speed: Array
    place: Array
    load: Array
    waves: float = 0.0

    @property
    def middles(self) -> Array:
        """(c,) s of the cells."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))

    @property
    def shape(self) -> tuple[int, int]:
        """Return how a force in cells is shaped: three directions, c cells."""
        return 3, len(self.edges) - 1

    def on_body(self, force: Array) -> Array:
        """Return (N,) what a ``force`` (3, c) N at the centre of mass does."""
        return np.asarray(self.by_body @ force.ravel())

    def on_foot(self, force: Array, foot: int) -> Array:
        """Return (N,) what a ``force`` (3, c) N on a foot does, 0 the left one."""
        return np.asarray(self.by_foot[foot] @ force.ravel())

    def bent(self, moved: Array, share: Array) -> Array:
        """Return what ``moved`` (N,) becomes where its force differs by a ``share`` (c,) of itself in each cell."""
        force = (self.following @ moved).reshape(self.shape)
        return np.asarray(moved + self.on_body(force * share))


def geometry_of(
    linear: LinearModel,
    levels: NoiseLevels,
    fitted: FittedRun,
    hypotheses: Sequence[Hypothesis],
    responses: Mapping[str, Array],
    waves: float = 0.0,
) -> Geometry:
    """Return the geometry of a run; ``responses`` (N, probes) are those of every hypothesis by its name."""
    edges, by_force = fitted.time_edges, responses[LATENT_FORCE.name]
    middles = 0.5 * (edges[1:] + edges[:-1])
    by_body, course = along_course(fitted, by_force), course_of(fitted)
    carried = np.zeros((2, *by_body.shape))
    if len(fitted.measurements.windows):
        carried = carried_by_soles(fitted, course)
    thresholds, run = fitted.thresholds, fitted.run
    prior = latent_covariance(edges, *thresholds.following_force, held=thresholds.cell)
    white = whiten_columns(linear, levels, by_body)
    weighed = whiten_columns(linear, levels, np.eye(len(by_body)))
    gain, _ = gain_of(prior, white.T @ white, np.zeros(len(prior)))
    following = gain @ (white.T @ weighed)

    def in_cells(values: Array) -> Array:
        return np.asarray(np.interp(middles, run.time, values))

    proposed = {hypothesis.name: _possible(hypothesis, fitted, responses[hypothesis.name]) for hypothesis in hypotheses}
    limits = {
        hypothesis.name: limits_of_all(hypothesis, proposed[hypothesis.name])
        for hypothesis in hypotheses
        if proposed[hypothesis.name]
    }
    return Geometry(
        linear=linear,
        levels=levels,
        candidates={name: some for name, some in proposed.items() if some},
        limits=limits,
        kinds={hypothesis.name: hypothesis.kind for hypothesis in hypotheses},
        edges=edges,
        by_body=by_body,
        by_foot=by_body + carried,
        following=np.asarray(following, dtype=np.float64),
        speed=in_cells(np.linalg.norm(run.com_velocity, axis=1)),
        place=in_cells(np.maximum.accumulate(run.foot_position[..., 0].mean(axis=1))),
        load=np.stack([in_cells(run.sole_force[:, foot]) for foot in (0, 1)]),
        waves=waves,
    )


def _possible(hypothesis: Hypothesis, fitted: FittedRun, responses: Array) -> list[Candidate]:
    """Return the candidates whose places are physically possible: with usual amplitudes a model can have them."""
    candidates = hypothesis.candidates(fitted, responses)
    return [candidate for candidate in candidates if is_possible(hypothesis, candidate, candidate.free.scales)]


def limits_of_all(hypothesis: Hypothesis, candidates: Sequence[Candidate]) -> Array:
    """Return (c, w, 2) as in ``Geometry``; amplitudes that a candidate has less than another have none."""
    width = max(len(candidate.amplitudes) for candidate in candidates)
    limits = np.broadcast_to(np.array([-np.inf, np.inf]), (len(candidates), width, 2)).copy()
    for k, candidate in enumerate(candidates):
        count = len(candidate.amplitudes)
        limits[k, :count] = limits_of(hypothesis, candidate, limits[max(k - 1, 0), :count])
    return limits


def limits_of(hypothesis: Hypothesis, candidate: Candidate, guess: Array | None = None) -> Array:
    """Return (w, 2) how many usual sizes each amplitude of a candidate may have to either side, all others being zero;
    infinite beyond ``_FARTHEST``.  Those of another place are a good ``guess`` (w, 2).
    """
    guessed = np.full((len(candidate.amplitudes), 2), np.inf) if guess is None else np.abs(guess)
    sides = [
        [-_largest(hypothesis, candidate, -row, low), _largest(hypothesis, candidate, row, high)]
        for row, (low, high) in zip(np.diag(candidate.free.scales), guessed.tolist(), strict=True)
    ]
    return np.array(sides)


def _largest(hypothesis: Hypothesis, candidate: Candidate, amplitudes: Array, guess: float) -> float:
    """Return by how many times ``amplitudes`` (w,) are possible at most.

    The bounds of numbers say so at once; what a hypothesis says beyond them is found by halving, unless it is the
    ``guess``.
    """
    model, high = candidate.model, _FARTHEST
    for group, amplitude in zip(candidate.amplitudes, amplitudes.tolist(), strict=True):
        for name in group if amplitude else ():
            bound = model.bounds(name)[amplitude > 0.0]
            high = min(high, (bound - model.value(name)) / amplitude)
    if is_possible(hypothesis, candidate, high * (1.0 - _ROUNDING) * amplitudes):
        return np.inf if high == _FARTHEST else high
    low, step = 0.0, high * 0.5**_HALVINGS
    if guess < high and _between(hypothesis, candidate, amplitudes, guess, guess + step):
        return guess
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_possible(hypothesis, candidate, middle * amplitudes) else (low, middle)
    return low


def _between(hypothesis: Hypothesis, candidate: Candidate, amplitudes: Array, low: float, high: float) -> bool:
    """Tell whether ``low`` times ``amplitudes`` (w,) are possible, and ``high`` times are not."""
    possible = [is_possible(hypothesis, candidate, times * amplitudes) for times in (low, high)]
    return possible == [True, False]


def is_possible(hypothesis: Hypothesis, candidate: Candidate, amplitudes: Array) -> bool:
    """Tell whether a run may have a candidate with ``amplitudes`` (w,), each added to what the model has."""
    values = {}
    for group, amplitude in zip(candidate.amplitudes, amplitudes.tolist(), strict=True):
        for name in group:
            value, (low, high) = candidate.model.value(name) + amplitude, candidate.model.bounds(name)
            if not low <= value <= high:
                return False
            values[name] = value
    if type(hypothesis).possible is Hypothesis.possible:  # it says nothing beyond bounds: making a model costs most
        return True
    return hypothesis.possible(candidate.model.with_values(values))
