"""What a hypothesis is: which change to the model it proposes, where, how strong that usually is, and how it reads.

A hypothesis names probes: models to which it is added without strength, at a place or everywhere.  From the
derivatives of what the instruments show by the probes' amplitudes it builds candidates, one a place, each a linear
response with the amplitudes it usually has.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Final

import numpy as np
from scipy.interpolate import CubicSpline

from sssi_exudyn.analysis.turns import edge_changes
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.fitting.observations import Measurements
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun
from sssi_exudyn.simulation.reduced.sensitivities import responses_to_additions
from sssi_exudyn.validation.diagnosis.diagnosis_data import Kind, Number
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds

_LEAST_CELLS: Final = 4
"""Cells of the shortest run: with fewer no stretch has a beginning and an end."""


@dataclass(frozen=True)
class FittedRun:
    """A fitted run that hypotheses are tried on.

    prediction : (N,) what the instruments would measure of it, by the reduced model
    stated : standard deviations of the model's numbers, as their instruments state them
    thresholds : the chosen numbers of the search
    """

    model: Model
    prepared: Prepared
    run: ReducedRun
    measurements: Measurements
    prediction: Array
    stated: Mapping[NumberRef, float] = field(default_factory=dict)
    thresholds: Thresholds = THRESHOLDS

    @property
    def time_edges(self) -> Array:
        """Edges of the cells in time (s)."""
        begin, end = float(self.run.time[0]), float(self.run.time[-1])
        count = min(max(round((end - begin) / self.thresholds.cell), _LEAST_CELLS), self.thresholds.most_cells)
        return np.linspace(begin, end, count + 1)

    @property
    def cell(self) -> float:
        """Length of a cell in time (s)."""
        edges = self.time_edges
        return float(edges[1] - edges[0])

    @property
    def place_edges(self) -> Array:
        """Edges of the cells along the fall line (m); every cell takes some time to pass."""
        f = np.maximum.accumulate(self.run.foot_position[..., 0].mean(axis=1))
        edges = np.interp(self.time_edges, self.run.time, f)
        return np.asarray(edges[np.concatenate([[True], np.diff(edges) > self.thresholds.cell_length])])

    def time_at(self, f: float) -> float:
        """Return the time (s) at which the skier passes the place f (m) along the fall line."""
        along = np.maximum.accumulate(self.run.foot_position[..., 0].mean(axis=1))
        return float(np.interp(f, along, self.run.time))

    @property
    def edge_changes(self) -> Array:
        """Times (s) at which the skis go from one edge to the other."""
        return edge_changes(self.run.time, self.run.edge_angle)


@dataclass(frozen=True)
class Probe:
    """A model to which a hypothesis is added, all amplitudes zero, and the name of its number that is the amplitude."""

    model: Model
    number: NumberRef


@dataclass(frozen=True)
class Candidate:
    """A hypothesis at a place.

    model : the fitted model extended, with amplitudes zero
    free : linear response and usual amplitudes
    amplitudes : the extended model's numbers that are amplitudes; several names in one entry are one number
    places : further numbers of its that say where, with their prior standard deviations
    window : when it acts (s); None for always
    """

    model: Model
    free: Freedom
    amplitudes: tuple[tuple[NumberRef, ...], ...]
    places: dict[NumberRef, float] = field(default_factory=dict)
    window: tuple[float, float] | None = None

    @property
    def strengths(self) -> set[NumberRef]:
        """All names in ``amplitudes``."""
        return {name for group in self.amplitudes for name in group}


Shifts = tuple[Mapping[NumberRef, float], ...]
"""By how much numbers of a model would be larger, one mapping a way in which they may be."""
Numbers = Mapping[str, Number]
"""Fitted numbers of a hypothesis by their names in its term or fault."""


@dataclass(frozen=True)
class Distinction:
    """The measurement that would distinguish a hypothesis from others, by their names."""

    others: tuple[str, ...]
    measurement: str


class Hypothesis(ABC):
    """One name in ``diagnosis.json``.

    caption : what it adds to the model, as a figure names it
    smallest : words for the size from which it would have been noticed, of a ``value`` or, of an angle, ``degrees``; ""
        where a reader would not ask
    plain_smallest : the same in a coach's words, of a ``value``, of ``degrees`` or of ``kmh``
    weight : prior probability relative to the others
    moves_all : it moves the whole track by far more than the noise, so that a linear response is a poor start of a fit,
        which then begins on both sides
    shapes_snow : the snow surface, were it free, would take up most of it before it is where it belongs
    natural : of what shapes the snow: how large a natural slope's own is, a standard deviation in its unit for a metre
        of the slope's waves
    comes_again : it is there again on another pass of the slope
    through_air : its force changes where something else moves the air or takes more of it
    lines : numbers of its term that are places down the fall line (m), where another run that passes them meets it
        again; none of what shapes the snow, which is in every run's own estimate of the surface
    distinctions : measurements that would distinguish it from others; each pair stands with one of the two
    """

    name: ClassVar[str]
    kind: ClassVar[Kind]
    caption: ClassVar[str]
    smallest: ClassVar[str] = ""
    plain_smallest: ClassVar[str] = ""
    weight: ClassVar[float] = 1.0
    moves_all: ClassVar[bool] = False
    shapes_snow: ClassVar[bool] = False
    natural: ClassVar[float] = 0.0
    comes_again: ClassVar[bool] = True
    through_air: ClassVar[bool] = False
    lines: ClassVar[tuple[str, ...]] = ()
    distinctions: ClassVar[tuple[Distinction, ...]] = ()

    @abstractmethod
    def probes(self, fitted: FittedRun) -> list[Probe]:
        """Return what the candidates' responses are made of."""

    @abstractmethod
    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        """Return candidates from the responses (N, probes), a unit of amplitude; none where no instrument would show
        it.
        """

    @abstractmethod
    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> tuple[float, float] | None:
        """Return when it acts (s), by its fitted numbers; None for always."""

    @abstractmethod
    def sentence(self, numbers: Numbers, model: Model) -> str:
        """Return what its fitted numbers mean, in a clause; ``model`` is the fitted one."""

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        """Return the same in a coach's words and sizes, without symbols; where ``sentence`` has none, it does."""
        return self.sentence(numbers, model)

    def shifts_if_usual(self, fitted: FittedRun, candidate: Candidate, model: Model) -> Shifts:
        """Return by how much the model's numbers, by their names, would be larger, were another part of the run, or
        another ski, the usual one: of each that fits alike.  None where the usual can be distinguished.
        """
        return ()

    def possible(self, model: Model) -> bool:
        """Tell whether a model fitted with it is physically possible."""
        return True

    def draw_amplitudes(self, rng: np.random.Generator, count: int) -> Array:
        """Draw (count,) amplitudes in usual sizes, of a simulated run that has it; a hypothesis whose amplitudes have a
        sign says so here.
        """
        if count == 1:
            return np.asarray(rng.choice([-1.0, 1.0], 1) * rng.uniform(0.5, 1.2))
        return np.asarray(rng.standard_normal(count))

    def sides(self, fitted: FittedRun) -> tuple[float, ...]:
        """Return where else a refit begins than at the candidate, in usual sizes from it."""
        return (-0.5, 0.5) if self.moves_all else ()

    def always_refitted(self, fitted: FittedRun) -> bool:
        """Tell whether it is refitted in this run even where its responses promise little."""
        return False


def by_sign(value: float, positive: str, negative: str) -> str:
    """Return the word for the sign of ``value``."""
    return positive if value > 0.0 else negative


def as_slope(delta_mu: float) -> str:
    """Return, in words, the change of the slope that brakes or drives as much as friction along the ski that is
    ``delta_mu`` greater; their difference is of the third order.
    """
    return f"as if the slope were {abs(np.degrees(delta_mu)):.1f}° {by_sign(delta_mu, 'flatter', 'steeper')}"


def as_weight(force: float) -> str:
    """Return, in words, a force (N) as a weight."""
    return f"as strong as the weight of {abs(force) / GRAVITY:.1f} kg"


def probes_by(model: Model, part: Term | Sensor, keys: Sequence[str]) -> list[Probe]:
    """Return probes by the numbers ``keys`` of a part that is added to the model."""
    extended, owner = add_part(model, part), name_in_model(model, part)
    return [Probe(extended, NumberRef.of(owner, key)) for key in keys]


def responses_of(probes: Sequence[Probe], prepared: Prepared, measurements: Measurements) -> Array:
    """Return (N, probes) derivatives of the measurements by the amplitude of each."""
    if not probes:
        return np.zeros((len(measurements.measured), 0))
    return responses_to_additions([(probe.model, probe.number) for probe in probes], prepared, measurements.predict)


class Everywhere(Hypothesis):
    """What acts all the time.

    amplitudes : names of the part's numbers that are amplitudes, each with its usual size
    """

    amplitudes: ClassVar[tuple[tuple[str, float], ...]]

    @abstractmethod
    def part(self, fitted: FittedRun) -> Term | Sensor:
        """Return the term or fault for a run, amplitudes zero."""

    @property
    def scales(self) -> Array:
        """Usual sizes of the amplitudes."""
        return np.array([scale for _, scale in self.amplitudes])

    def own_amplitudes(self, fitted: FittedRun) -> tuple[tuple[str, float], ...]:
        """Return further amplitudes of the part, each with its usual size, that a run has for itself: several runs of
        a day do not share them.
        """
        return ()

    def probes(self, fitted: FittedRun) -> list[Probe]:
        amplitudes = (*self.amplitudes, *self.own_amplitudes(fitted))
        return probes_by(fitted.model, self.part(fitted), [key for key, _ in amplitudes])

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        if not np.any(responses):
            return []  # of an instrument that the recording lacks
        part, own = self.part(fitted), self.own_amplitudes(fitted)
        owner = name_in_model(fitted.model, part)
        names = tuple((NumberRef.of(owner, key),) for key, _ in (*self.amplitudes, *own))
        free = Freedom(responses, np.concatenate([self.scales, [scale for _, scale in own]]))
        return [Candidate(add_part(fitted.model, part), free, names)]

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> None:
        return None


class SteadyLaw(Everywhere):
    """A hypothesis of this kind is a law that acts all the time, and on all runs of a day alike.

    Examples
    --------
    >>> class FrictionOfWetSnow(sssi_exudyn.SteadyLaw):
    ...     name = "wet_snow"
    ...     caption = "suction of a water film"
    ...     amplitudes = (("c", 0.0005),)
    ...
    ...     def part(self, fitted):
    ...         return WetSnow()
    ...
    ...     def sentence(self, numbers, model):
    ...         return f"the snow is wet: μ_t rises by {numbers['c'].value:.5f} times the speed's square"
    """

    kind: ClassVar[Kind] = "physics"


class SteadyFault(Everywhere):
    """A fault of an instrument that does not change during a run."""

    kind = "sensor"


class KnownNumber(Hypothesis):
    """A number that every model has, which is not what its instrument states.

    number : its name in the model;  scale : its usual size, of good instruments
    """

    kind = "sensor"
    moves_all = True
    number: ClassVar[NumberRef]
    scale: ClassVar[float]

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return [Probe(fitted.model, self.number)]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        return [Candidate(fitted.model, Freedom(responses, np.array([self.usual(fitted)])), ((self.number,),))]

    def usual(self, fitted: FittedRun) -> float:
        """Return its usual size in a run: ``scale``, or more where the instrument states that it may be off by more."""
        return max(self.scale, fitted.thresholds.faulty * fitted.stated.get(self.number, 0.0))

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> None:
        return None


def intervals(count: int, least: int, most: int) -> Iterator[tuple[int, int]]:
    """Return all stretches [i, j) of ``count`` cells, from ``least`` to ``most`` cells long, by their half cells.

    A strong effect that begins within a cell differs so much from one that begins with it that another law may do
    better.
    """
    for length in range(2 * least, 2 * most + 1):
        for i in range(2 * count - length + 1):
            yield i, i + length


def sums_by_half_cells(edges: Array, responses: Array) -> tuple[Array, Array]:
    """Return the edges (2c + 1,) of half cells and the sums (…, 2c + 1) of responses up to each, from the responses
    (…, c) to cells: the sum up to a place is a smooth function of it.
    """
    halves = np.interp(0.5 * np.arange(2 * len(edges) - 1), np.arange(len(edges)), edges)
    summed = np.concatenate([np.zeros((*responses.shape[:-1], 1)), np.cumsum(responses, axis=-1)], axis=-1)
    return halves, np.asarray(CubicSpline(edges, summed, axis=-1)(halves))


class InTime(Hypothesis):
    """What comes at one time and goes at another: cells in time, put together to stretches.

    keys : the part's numbers that are amplitudes;  scale : their usual size
    longest : share of the run at most;  least : cells at least
    rises : shares of its time in which it comes and goes, each tried
    """

    keys: ClassVar[tuple[str, ...]]
    scale: ClassVar[float]
    longest: ClassVar[float]
    least: ClassVar[int]
    rises: ClassVar[tuple[float, ...]] = (1.0,)

    @abstractmethod
    def part(self, t0: float, t1: float, rise: float) -> Term:
        """Return the term that acts from t0 to t1, amplitudes zero."""

    @abstractmethod
    def cell(self, t0: float, t1: float) -> Term:
        """Return the term of one cell, amplitudes zero; all cells together act as one that acts always."""

    @abstractmethod
    def profile(self, share: Array, rise: float) -> Array:
        """Return how much of the amplitude there is at a share (c,) of the time from t0 to t1."""

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> tuple[float, float]:
        return numbers["t0"].value, numbers["t1"].value

    def probes(self, fitted: FittedRun) -> list[Probe]:
        cells = [self.cell(float(a), float(b)) for a, b in itertools.pairwise(fitted.time_edges)]
        return [probe for key in self.keys for part in cells for probe in probes_by(fitted.model, part, [key])]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        cells, count, candidates = len(fitted.time_edges) - 1, len(self.keys), []
        edges, summed = sums_by_half_cells(fitted.time_edges, responses.reshape(len(responses), count, cells))
        shaped, spread = np.diff(summed, axis=-1), fitted.cell
        stretches = intervals(cells, self.least, max(self.least, round(self.longest * cells)))
        for (i, j), rise in itertools.product(stretches, self.rises):
            part = self.part(float(edges[i]), float(edges[j]), rise)
            owner = name_in_model(fitted.model, part)
            profile = self.profile((np.arange(j - i) + 0.5) / (j - i), rise)
            candidates.append(
                Candidate(
                    add_part(fitted.model, part),
                    Freedom(shaped[:, :, i:j] @ profile, np.full(count, self.scale)),
                    tuple((NumberRef.of(owner, key),) for key in self.keys),
                    {NumberRef.of(owner, "t0"): spread, NumberRef.of(owner, "t1"): spread},
                    (float(edges[i]), float(edges[j])),
                )
            )
        return candidates


class FreeFormForce(InTime):
    """A force without a law: for a while as its term has it, and in the place of a law in any form.

    Its three amplitudes are newtons down the fall line, to the left and away from the snow.
    """

    def in_cells(self, force: Array, edges: Array) -> list[Term]:
        """Return terms that act as the ``force`` (3, c) N in the cells between ``edges`` (c + 1,) s."""
        return [
            replace(self.cell(float(begin), float(end)), **dict(zip(self.keys, map(float, newtons), strict=True)))
            for newtons, begin, end in zip(force.T, edges[:-1], edges[1:], strict=True)
        ]


class Terrain(Hypothesis):
    """A surface that is no plane: places along the fall line, and widths."""

    shapes_snow = True
    amplitude: ClassVar[str]
    scale: ClassVar[float]
    widths: ClassVar[tuple[float, ...]]

    @abstractmethod
    def part(self, f0: float, width: float) -> Term:
        """Return the surface, its amplitude zero."""

    @abstractmethod
    def span(self, fitted: FittedRun, f0: float, width: float) -> tuple[float, float]:
        """Return when the skier is on it (s)."""

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> tuple[float, float]:
        return self.span(fitted, numbers["f0"].value, numbers["width"].value)

    def _spots(self, fitted: FittedRun) -> list[tuple[float, float]]:
        edges = fitted.place_edges
        every = edges[1:-1] if len(edges) < 40 else edges[1:-1:2]
        return [(float(f), width) for width in self.widths for f in every]

    def probes(self, fitted: FittedRun) -> list[Probe]:
        parts = [self.part(f, width) for f, width in self._spots(fitted)]
        return [probe for part in parts for probe in probes_by(fitted.model, part, [self.amplitude])]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        candidates = []
        edges = fitted.place_edges
        for k, (f, width) in enumerate(self._spots(fitted)):
            part = self.part(f, width)
            owner = name_in_model(fitted.model, part)
            candidates.append(
                Candidate(
                    add_part(fitted.model, part),
                    Freedom(responses[:, [k]], np.array([self.scale])),
                    ((NumberRef.of(owner, self.amplitude),),),
                    {
                        NumberRef.of(owner, "f0"): 2.0 * float(edges[-1] - edges[0]) / len(edges),
                        NumberRef.of(owner, "width"): width,
                    },
                    self.span(fitted, f, width),
                )
            )
        return candidates
