"""What a hypothesis is: which change to the model it proposes, where, and how strong that usually is."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Final

import numpy as np

from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced import Prepared, ReducedRun
from sssi_exudyn.simulation.sensitivities import STEPS
from sssi_exudyn.validation.diagnosis.evidence import Freedom
from sssi_exudyn.validation.diagnosis.result import Kind
from sssi_exudyn.validation.measurements import Measurements

CELL: Final = 0.4
"""s; the finest division of a run in the search for a place."""
_CELLS: Final = 48
"""Cells at most."""


@dataclass(frozen=True)
class Scene:
    """A fitted run that a hypothesis is tried on."""

    model: Model
    prepared: Prepared
    run: ReducedRun
    measurements: Measurements
    base: Array

    @property
    def time_edges(self) -> Array:
        """Edges of the cells in time (s)."""
        begin, end = float(self.run.time[0]), float(self.run.time[-1])
        count = int(np.clip(round((end - begin) / CELL), 4, _CELLS))
        return np.linspace(begin, end, count + 1)

    @property
    def place_edges(self) -> Array:
        """Edges of the cells along the fall line (m); every cell takes some time to pass."""
        f = np.maximum.accumulate(self.run.foot_position[..., 0].mean(axis=1))
        edges = np.interp(self.time_edges, self.run.time, f)
        return np.asarray(edges[np.concatenate([[True], np.diff(edges) > 0.2])])

    def passed(self, f: float) -> float:
        """When the skier passes the place f (s)."""
        along = np.maximum.accumulate(self.run.foot_position[..., 0].mean(axis=1))
        return float(np.interp(f, along, self.run.time))

    @property
    def transitions(self) -> Array:
        """Times (s) at which the skis go from one edge to the other."""
        edge = self.run.edge_angle.mean(axis=1)
        count = max(1, round(0.3 / float(np.diff(self.run.time[:2])[0])))
        smooth = np.convolve(edge, np.ones(count) / count, mode="same")
        swings = np.abs(smooth) > 0.05
        signs = np.where(swings, np.sign(smooth), 0.0)
        found, last = [], 0
        for i in np.flatnonzero(signs):
            if last and signs[i] != signs[last]:
                found.append(0.5 * (self.run.time[i] + self.run.time[last]))
            last = int(i)
        return np.array(found)


@dataclass(frozen=True)
class Probe:
    """A model that holds a hypothesis with amplitude ``size`` (in the amplitude's unit)."""

    model: Model
    size: float


@dataclass(frozen=True)
class Candidate:
    """A hypothesis at a place.

    model : the scene's model extended, with amplitudes zero
    free : linear response and usual amplitudes
    amplitudes : the extended model's numbers that are amplitudes; several names in one entry are one number
    places : further numbers of its that say where, with their prior standard deviations
    window : when it acts (s); None for always
    """

    model: Model
    free: Freedom
    amplitudes: tuple[tuple[str, ...], ...]
    places: dict[str, float] = field(default_factory=dict)
    window: tuple[float, float] | None = None


class Hypothesis(ABC):
    """One name in ``diagnosis.json``.

    weight : how probable it is beforehand, against others
    moves_all : it moves the whole track by far more than the noise, so that its linear response tells little of it, and
        a fit has to begin on both sides
    """

    name: ClassVar[str]
    kind: ClassVar[Kind]
    weight: ClassVar[float] = 1.0
    moves_all: ClassVar[bool] = False

    @abstractmethod
    def probes(self, scene: Scene) -> list[Probe]:
        """Models whose responses the candidates are made of."""

    @abstractmethod
    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        """Candidates from the responses (N, probes), a unit of amplitude."""

    def possible(self, model: Model) -> bool:
        """Whether a model fitted with it is one that can be."""
        return True


def added(model: Model, part: Term | Sensor) -> Model:
    """The model with one more term or fault."""
    if isinstance(part, Term):
        return replace(model, terms=(*model.terms, part))
    return replace(model, sensors=(*model.sensors, part))


def newest(model: Model, part: Term | Sensor) -> str:
    """How ``Model.value`` calls the part that is added last."""
    parts: Sequence[Term | Sensor] = (*model.terms, *model.sensors)
    count = sum(other.name == part.name for other in parts) + 1
    return part.name if count == 1 else f"{part.name}#{count}"


@dataclass(frozen=True)
class Everywhere(Hypothesis):
    """What acts all the time, or an instrument's steady fault.

    part : the term or fault for a scene, amplitudes zero
    scales : usual amplitude of each of its numbers that is one;  tries : what the probes hold of them
    """

    part: Callable[[Scene], Term | Sensor]
    scales: dict[str, float]
    tries: float = 0.2

    def probes(self, scene: Scene) -> list[Probe]:
        return self.holding(scene.model, self.part(scene))

    def holding(self, model: Model, part: Term | Sensor) -> list[Probe]:
        """The model with a little of each amplitude of ``part``."""
        extended, owner = added(model, part), newest(model, part)
        return [
            Probe(extended.with_values({f"{owner}.{key}": self.tries * scale}), self.tries * scale)
            for key, scale in self.scales.items()
        ]

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        part = self.part(scene)
        owner = newest(scene.model, part)
        names = tuple((f"{owner}.{key}",) for key in self.scales)
        return [Candidate(added(scene.model, part), Freedom(responses, np.array(list(self.scales.values()))), names)]


def everywhere(name: str, kind: Kind, part: Callable[[Scene], Term | Sensor], scales: dict[str, float]) -> Hypothesis:
    """A hypothesis of that name that acts all the time."""
    made = type(name, (Everywhere,), {"name": name, "kind": kind})
    return made(part, scales)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class OfTheStart(Hypothesis):
    """A number of every model that is known beforehand, and is not as it was thought to be."""

    moves_all = True
    number: str
    scale: float

    def probes(self, scene: Scene) -> list[Probe]:
        # as near as a fit's own derivatives: what curvature makes of a larger step would part the two
        size = STEPS[self.number.partition(".")[2]]
        return [Probe(scene.model.with_values({self.number: scene.model.value(self.number) + size}), size)]

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        return [Candidate(scene.model, Freedom(responses, np.array([self.scale])), ((self.number,),))]


def intervals(count: int, least: int, most: int) -> Iterator[tuple[int, int]]:
    """All stretches [i, j) of ``count`` cells, from ``least`` to ``most`` cells long."""
    for length in range(least, most + 1):
        for i in range(count - length + 1):
            yield i, i + length


class InTime(Hypothesis):
    """What comes at one time and goes at another: cells in time, put together to stretches.

    keys : the part's numbers that are amplitudes;  scale, trial : their usual size, and what the probes hold of them
    longest : share of the run at most;  least : cells at least
    rises : shares of its time in which it comes and goes, each tried
    """

    keys: ClassVar[tuple[str, ...]]
    scale: ClassVar[float]
    trial: ClassVar[float]
    longest: ClassVar[float]
    least: ClassVar[int]
    rises: ClassVar[tuple[float, ...]] = (1.0,)

    @abstractmethod
    def part(self, t0: float, t1: float, rise: float, amplitudes: dict[str, float]) -> Term:
        """The term that acts from t0 to t1."""

    @abstractmethod
    def cell(self, t0: float, t1: float, amplitudes: dict[str, float]) -> Term:
        """The term that a probe holds of one cell; all cells together act as one that acts always."""

    @abstractmethod
    def course(self, share: Array, rise: float) -> Array:
        """How much of the amplitude there is at a share (c,) of the way from t0 to t1."""

    def probes(self, scene: Scene) -> list[Probe]:
        edges = scene.time_edges
        return [
            Probe(added(scene.model, self.cell(float(a), float(b), {key: self.trial})), self.trial)
            for key in self.keys
            for a, b in itertools.pairwise(edges)
        ]

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        edges, found = scene.time_edges, []
        cells, count = len(edges) - 1, len(self.keys)
        shaped = responses.reshape(len(responses), count, cells)
        spread = float(edges[1] - edges[0])
        stretches = intervals(cells, self.least, max(self.least, round(self.longest * cells)))
        for (i, j), rise in itertools.product(stretches, self.rises):
            part = self.part(float(edges[i]), float(edges[j]), rise, {})
            owner = newest(scene.model, part)
            course = self.course((np.arange(j - i) + 0.5) / (j - i), rise)
            found.append(
                Candidate(
                    added(scene.model, part),
                    Freedom(shaped[:, :, i:j] @ course, np.full(count, self.scale)),
                    tuple((f"{owner}.{key}",) for key in self.keys),
                    {f"{owner}.t0": spread, f"{owner}.t1": spread},
                    (float(edges[i]), float(edges[j])),
                )
            )
        return found


class Terrain(Hypothesis):
    """A surface that is no plane: places along the fall line, and widths."""

    amplitude: ClassVar[str]
    scale: ClassVar[float]
    widths: ClassVar[tuple[float, ...]]

    @abstractmethod
    def part(self, f0: float, width: float, size: float = 0.0) -> Term:
        """The surface."""

    @abstractmethod
    def window(self, scene: Scene, f0: float, width: float) -> tuple[float, float]:
        """When the skier is on it."""

    def _spots(self, scene: Scene) -> list[tuple[float, float]]:
        edges = scene.place_edges
        every = edges[1:-1] if len(edges) < 40 else edges[1:-1:2]
        return [(float(f), width) for width in self.widths for f in every]

    def probes(self, scene: Scene) -> list[Probe]:
        size = 0.1 * self.scale
        return [Probe(added(scene.model, self.part(f, width, size)), size) for f, width in self._spots(scene)]

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        found = []
        edges = scene.place_edges
        for k, (f, width) in enumerate(self._spots(scene)):
            part = self.part(f, width)
            owner = newest(scene.model, part)
            found.append(
                Candidate(
                    added(scene.model, part),
                    Freedom(responses[:, [k]], np.array([self.scale])),
                    ((f"{owner}.{self.amplitude}",),),
                    {f"{owner}.f0": 2.0 * float(edges[-1] - edges[0]) / len(edges), f"{owner}.width": width},
                    self.window(scene, f, width),
                )
            )
        return found
