"""A run of the reduced model as a point of a search, and what would be measured of it linearised there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.balance import Balance, balance_of, own_moment
from sssi_exudyn.fitting.changing_drag import responses_to_changing_drag
from sssi_exudyn.fitting.observations import Observation, averages
from sssi_exudyn.fitting.parameters import MASS, SURFACE, Parameter, group_of
from sssi_exudyn.fitting.posture_errors import PostureError, PostureErrors, grown
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.runtime.threads import both
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.simulation.heading import Turn, turned
from sssi_exudyn.simulation.reduced.derivatives import TableChange, skier_mass_change
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.terrain.from_heights import TILTS

_SMALLEST: Final = 1e-6
"""Lower bound of a number that must stay above zero, in its unit, where the model allows zero."""
_DIFFERENCE: Final = 1e-3
"""Standard deviations of an error by which the body's own moment is differentiated."""


@dataclass(frozen=True)
class Setting:
    """What stays fixed in an estimate.

    mass : kg, stated, and its standard deviation;  changing_drag : m², standard deviation of a drag area that changes
    within turns
    """

    motion: Motion
    seen: Observation
    unknowns: tuple[Parameter, ...]
    errors: tuple[PostureError, ...]
    mass: tuple[float, float]
    changing_drag: float = 0.0

    @property
    def names(self) -> tuple[NumberRef, ...]:
        """(k,) of θ, the first where several move together."""
        return tuple(unknown.name for unknown in self.unknowns)

    def at(self, model: Model, values: Array) -> Model:
        """The model with θ at ``values`` (k,)."""
        pairs = zip(self.unknowns, self.in_units(values).tolist(), strict=True)
        return model.with_values({name: value for unknown, value in pairs for name in unknown.names})

    @property
    def of_surface(self) -> NDArray[np.bool_]:
        """(k,) whether each of θ is a mode of the snow surface."""
        return np.array([unknown.group == SURFACE for unknown in self.unknowns], dtype=bool)

    @property
    def of_process(self) -> NDArray[np.bool_]:
        """(k,) whether each of θ is a mode of a snow surface that no heights have shown beforehand."""
        return self.of_surface & self.seen.has_heights

    @property
    def waves(self) -> NDArray[np.bool_]:
        """(k,) whether each of θ is a wave of the snow surface.  One that heights have not shown beforehand begins with
        the plane's tilt, of which a slope's roughness says nothing.
        """
        waves = self.of_surface
        waves[np.flatnonzero(self.of_process)[:TILTS]] = False
        return waves

    def with_waves(self, sigma: float) -> Setting:
        """Return the same with waves of the snow of that standard deviation beforehand."""
        unknowns = (
            replace(unknown, prior=replace(unknown.prior, sigma=sigma)) if is_wave else unknown
            for unknown, is_wave in zip(self.unknowns, self.waves, strict=True)
        )
        return replace(self, unknowns=tuple(unknowns))

    @property
    def means(self) -> Array:
        """(k,) of θ beforehand."""
        return np.array([unknown.prior.mean for unknown in self.unknowns])

    @property
    def sigmas(self) -> Array:
        """(k,) standard deviations of θ beforehand."""
        return np.array([unknown.prior.sigma for unknown in self.unknowns])

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """(k,) whether each of θ is the logarithm of its number."""
        return np.array([unknown.logarithmic for unknown in self.unknowns], dtype=bool)

    def values(self, model: Model) -> Array:
        """(k,) θ of a model."""
        return np.array([unknown.of(model) for unknown in self.unknowns])

    def sizes_of(self, errors: Sequence[PostureError], sizes: Array) -> Array:
        """Return η (m,) where those of ``errors`` are ``sizes``, the skier's mass last; 0 of all other errors."""
        known = dict(zip(errors, sizes[:-1].tolist(), strict=True))
        return np.array([*(known.get(error, 0.0) for error in self.errors), sizes[-1]])

    def in_units(self, values: Array) -> Array:
        """Return the model's numbers (…, k) where θ is ``values`` (…, k)."""
        return np.exp(values, out=np.array(values, dtype=np.float64), where=self.logarithmic)

    def slopes(self, model: Model) -> Array:
        """Return the derivatives (k,) of the model's numbers by θ."""
        return np.array([unknown.slope(model) for unknown in self.unknowns])

    def bounds(self, model: Model) -> Array:
        """Return the lower and upper bounds (k, 2) of θ."""
        bounds = np.array([model.bounds(name) for name in self.names])
        lowest = np.where([unknown.is_positive for unknown in self.unknowns], _SMALLEST, -np.inf)
        bounds = np.maximum(bounds, lowest[:, None])
        return np.asarray(np.log(bounds, out=bounds, where=self.logarithmic[:, None]))

    def groups(self) -> list[str]:
        """Return where the uncertainty of each of η is counted, (m,)."""
        return [*(group_of(error) for error in self.errors), MASS]


@dataclass(frozen=True)
class Point:
    """Where a search is.

    model : with numbers, posture and mass as estimated;  prepared, balance : the tables of its run
    sizes : (m,) η, the skier's mass last
    predicted : (N,) what would be measured of it;  beyond : (N,) what of that the full model adds to the reduced one
    """

    model: Model
    prepared: Prepared
    balance: Balance
    sizes: Array
    predicted: Array
    beyond: Array


@dataclass(frozen=True)
class Responses:
    """The measurements linearised about a point: by θ (N, k) and by η (N, m), and what η does to the posture.

    by_drag : (N, c) by independent parts of a changing drag area, each as large as usual; no run is corrected for them
    """

    by_number: Array
    by_error: Array
    by_drag: Array
    posture: PostureErrors


def linearise_at(model: Model, setting: Setting) -> tuple[Point, Responses]:
    """Return a model as a point of a search that has no error of posture or mass yet, and the measurements linearised
    there.

    Raises SimulationDiverged when its simulation does.
    """
    point = point_at(setting, model, np.zeros(len(setting.errors) + 1), np.zeros(len(setting.seen.measured)))
    return point, linearise(setting, point)


def moved_point(setting: Setting, point: Point, responses: Responses, values: Array, sizes: Array) -> Point:
    """Return the point with θ at ``values`` (k,), posture and mass as ``sizes`` (m,) say.

    Raises SimulationDiverged when its simulation does.
    """
    change = responses.posture.angles((sizes - point.sizes)[:-1])
    mass, sigma = setting.mass
    model = setting.at(point.model, values)
    model = replace(
        model,
        posture=grown(model.posture, responses.posture.time, change),
        skier=replace(model.skier, mass=mass + float(sizes[-1]) * sigma),
    )
    return point_at(setting, model, sizes, point.beyond)


def point_at(setting: Setting, model: Model, sizes: Array, beyond: Array) -> Point:
    """Return the point of a model with errors of ``sizes`` (m,), from a run of it.

    Raises SimulationDiverged when its simulation does.
    """
    prepared = prepare(model, setting.motion, step=COARSE_STEP)
    run = simulate_reduced(model, prepared)
    balance = balance_of(model, correct_motion(model, setting.motion), prepared.correct_capture(model), run)
    predicted = setting.seen.predict(model, run, balance, prepared) + beyond
    return Point(model, prepared, balance, sizes, np.asarray(predicted), beyond)


def linearise(setting: Setting, point: Point) -> Responses:
    """Return the responses about a point."""
    model, prepared, seen = point.model, point.prepared, setting.seen
    posture = PostureErrors(Parts(model, correct_posture(setting.motion, model.posture)), prepared, setting.errors)
    heavier = skier_mass_change(model, setting.motion, prepared)
    changes = [posture.change(error) for error in setting.errors]
    changes.append(TableChange(lambda tables, size: heavier.apply(tables, size * setting.mass[1])))
    observed, size = _observation(setting, point), len(seen.measured)
    columns, by_drag = both(  # on a core each
        partial(responses_to_numbers, setting, point, setting.unknowns, changes),
        partial(responses_to_changing_drag, model, prepared, observed, setting.changing_drag, size),
    )
    by_number, by_error = np.split(columns, [len(setting.unknowns)], axis=1)
    by_error[seen.moments, :-1] += _own_moments(setting, model, posture, point)
    by_error[seen.moments, -1] = 0.0
    return Responses(by_number, by_error, by_drag, posture)


def linearise_numbers(setting: Setting, point: Point, known: Responses) -> Responses:
    """Return the responses to θ about a point, with those to errors and to a process' modes as they are ``known``:
    these are many, and change slowly.
    """
    places = np.flatnonzero(~setting.of_process)
    by_number = known.by_number.copy()
    by_number[:, places] = responses_to_numbers(setting, point, [setting.unknowns[i] for i in places], ())
    return replace(known, by_number=by_number)


def responses_to_numbers(
    setting: Setting, point: Point, unknowns: Sequence[Parameter], changes: Sequence[TableChange]
) -> Array:
    """Return the derivatives (N, k + changes) of the measurements by ``unknowns`` (k,) and changes of the posture."""
    observed = _observation(setting, point)
    names = [name for unknown in unknowns for name in unknown.names]
    slopes = sensitivities(point.model, point.prepared, names, observed, changes)[1]
    counts = [*(len(unknown.names) for unknown in unknowns), *[1] * len(changes)]
    columns = np.asarray(np.add.reduceat(slopes, np.cumsum([0, *counts[:-1]]), axis=1))
    columns[:, : len(unknowns)] *= [unknown.slope(point.model) for unknown in unknowns]
    return columns


def _observation(setting: Setting, point: Point) -> Callable[[Model, ReducedRun], Array]:
    """Return what is measured (N,) of runs with the posture of a point."""

    def observed(model: Model, run: ReducedRun) -> Array:
        return setting.seen.predict(model, run, point.balance, point.prepared)

    return observed


def _own_moments(setting: Setting, model: Model, posture: PostureErrors, point: Point) -> Array:
    """Return what each error changes of the moment that the posture has of itself, (moments, errors)."""
    time, prepared = setting.seen.times["moment_f"], point.prepared
    heading = averages(prepared.time, point.balance.heading, time)
    turn = Turn(prepared.up, *heading.T).matrices()
    if not len(time):
        return np.zeros((0, len(setting.errors)))
    own = own_moment(Parts(model, correct_motion(model, setting.motion)), time)
    kinds: dict[tuple[str, int], Array] = {}
    columns = []
    for error in setting.errors:
        kind = error.kind, error.side
        if kind not in kinds:
            angles = _DIFFERENCE / error.sigma * posture.direction(replace(error, support=-1))
            moved = replace(model, posture=grown(model.posture, prepared.time, angles))
            changed = own_moment(Parts(moved, correct_motion(moved, setting.motion)), time)
            kinds[kind] = (changed - own) / _DIFFERENCE
        shape = error.sigma * posture.profile(error, time)
        columns.append(turned(turn, kinds[kind] * shape[:, None]).T.ravel())
    return np.stack(columns, axis=1) if columns else np.zeros((3 * len(time), 0))
