"""What may be missing from a model: each hypothesis one class, what it adds, and how strong it usually is.

A hypothesis names probes: models that hold it a little, at a place or at all.  From what the instruments would make of
the probes it builds candidates, one a place, each a linear response with the amplitudes it usually has.
"""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np

from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.body_forces import PolePlant, UnexplainedForce
from sssi_exudyn.contact.terms.friction_corrections import (
    EdgeDependentFriction,
    LoadDependentFriction,
    SnowCompaction,
    SnowPatch,
    SpeedDependentFriction,
)
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import DragArea, Gust, Wind
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import BootCuff, GpsJump, HeadingDrift, InsoleGain, LeverArm
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.evidence import Freedom
from sssi_exudyn.validation.diagnosis.hypothesis import (
    Candidate,
    Everywhere,
    Hypothesis,
    InTime,
    OfTheStart,
    Probe,
    Scene,
    Terrain,
    added,
    everywhere,
    intervals,
    newest,
)


class GpsDelay(OfTheStart):
    """The GPS clock is late."""

    name = "gps_delay"
    kind = "sensor"


class HeadingMisalignment(OfTheStart):
    """The capture is turned by more than its instrument is said to be: the commonest fault of inertial sensors, whose
    compasses have steel edges and bindings beside them.
    """

    name = "heading_misalignment"
    kind = "sensor"
    weight = 4.0


class Patch(Hypothesis):
    """Snow that glides differently over a stretch: cells along the fall line, put together to stretches."""

    name = "snow_patch"
    kind = "physics"
    _TRY: Final = 0.02
    _SLICKEST: Final = 0.01  # half of the least gliding friction that Wolfsperger et al. (2021) measured

    def possible(self, model: Model) -> bool:
        fallen = min(term.delta_mu_t for term in model.terms if isinstance(term, SnowPatch))
        return model.friction.mu_t + fallen >= self._SLICKEST

    def probes(self, scene: Scene) -> list[Probe]:
        edges = scene.place_edges
        return [
            Probe(added(scene.model, SnowPatch(self._TRY, float(a), float(b), 0.5)), self._TRY)
            for a, b in itertools.pairwise(edges)
        ]

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        edges, found = scene.place_edges, []
        cells = len(edges) - 1
        summed = np.hstack([np.zeros((len(responses), 1)), np.cumsum(responses, axis=1)])
        spread = float(edges[-1] - edges[0]) / cells
        for i, j in intervals(cells, 2, max(2, round(0.6 * cells))):
            part = SnowPatch(0.0, float(edges[i]), float(edges[j]), 0.5)
            owner = newest(scene.model, part)
            found.append(
                Candidate(
                    added(scene.model, part),
                    Freedom(summed[:, [j]] - summed[:, [i]], np.array([0.06])),
                    ((f"{owner}.delta_mu_t",),),
                    {f"{owner}.f0": spread, f"{owner}.f1": spread},
                    (scene.passed(edges[i]), scene.passed(edges[j])),
                )
            )
        return found


class Gusts(InTime):
    """A wind that comes and goes.

    Meteorologists count means over 3 s as gusts; what comes and goes within a second is none.
    """

    name = "gust"
    kind = "physics"
    keys = ("w_f", "w_l")
    scale, trial, longest, least = 5.0, 1.5, 0.5, 4
    rises = (1.0, 0.4)
    _STRONGEST: Final = 20.0  # m/s, Beaufort 8 to 9: lifts stand still, nobody skis
    _SHORTEST: Final = 1.0  # s

    def possible(self, model: Model) -> bool:
        gusts = [term for term in model.terms if isinstance(term, Gust)]
        peak = max(np.hypot(term.w_f, term.w_l) for term in gusts)
        return bool(peak <= self._STRONGEST and min(term.t1 - term.t0 for term in gusts) >= self._SHORTEST)

    def part(self, t0: float, t1: float, rise: float, amplitudes: dict[str, float]) -> Term:
        return Gust(t0=t0, t1=t1, rise=rise, **amplitudes)

    def cell(self, t0: float, t1: float, amplitudes: dict[str, float]) -> Term:
        half = 0.5 * (t1 - t0)  # swells of twice a cell's length, one a cell, add up to one
        return Gust(t0=t0 - half, t1=t1 + half, **amplitudes)

    def course(self, share: Array, rise: float) -> Array:
        inwards = np.minimum(share, 1.0 - share)
        return np.asarray(0.5 * (1.0 - np.cos(np.pi * np.minimum(2.0 * inwards / rise, 1.0))))


class Unexplained(InTime):
    """A force of which nothing is known, in any direction: it stands for all that the list does not know."""

    name = "unexplained_force"
    kind = "unexplained"
    weight = 2.0
    keys = ("force_f", "force_l", "force_n")
    scale, trial, longest, least = 80.0, 20.0, 0.4, 1

    def part(self, t0: float, t1: float, rise: float, amplitudes: dict[str, float]) -> Term:
        return UnexplainedForce(t0=t0, t1=t1, **amplitudes)

    def cell(self, t0: float, t1: float, amplitudes: dict[str, float]) -> Term:
        return self.part(t0, t1, 1.0, amplitudes)

    def course(self, share: Array, rise: float) -> Array:
        return np.ones(len(share))


class SlopeChanges(Terrain):
    """The piste steepens or flattens."""

    name = "slope_change"
    kind = "physics"
    amplitude = "delta"
    scale = 0.03
    widths = (3.0, 10.0)

    def part(self, f0: float, width: float, size: float = 0.0) -> Term:
        return SlopeChange(size, f0, width)

    def window(self, scene: Scene, f0: float, width: float) -> tuple[float, float]:
        return scene.passed(f0), float(scene.run.time[-1])


class Bumps(Terrain):
    """A roll or a dip."""

    name = "terrain_bump"
    kind = "physics"
    amplitude = "rise"
    scale = 0.25
    widths = (2.0, 4.0, 8.0)

    def part(self, f0: float, width: float, size: float = 0.0) -> Term:
        return TerrainBump(size, f0, width)

    def window(self, scene: Scene, f0: float, width: float) -> tuple[float, float]:
        return scene.passed(f0 - 2.0 * width), scene.passed(f0 + 2.0 * width)


class PolePlants(Hypothesis):
    """A pole set at every transition, with the same impulse."""

    name = "pole_plant"
    kind = "physics"
    _SHIFTS: Final = (-0.4, -0.2, 0.0, 0.2, 0.4)
    _TRY: Final = 4.0

    def _planted(self, scene: Scene, shift: float, forward: float, up: float) -> tuple[Model, list[str]]:
        model, owners = scene.model, []
        for t in scene.transitions:
            part = PolePlant(forward, up, float(t) + shift)
            owners.append(newest(model, part))
            model = added(model, part)
        return model, owners

    def probes(self, scene: Scene) -> list[Probe]:
        if not len(scene.transitions):
            return []
        pushes = ((self._TRY, 0.0), (0.0, self._TRY))
        return [Probe(self._planted(scene, s, *push)[0], self._TRY) for s in self._SHIFTS for push in pushes]

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        found = []
        for k in range(responses.shape[1] // 2):
            model, owners = self._planted(scene, self._SHIFTS[k], 0.0, 0.0)
            names = tuple(tuple(f"{owner}.{key}" for owner in owners) for key in ("forward", "up"))
            found.append(Candidate(model, Freedom(responses[:, 2 * k : 2 * k + 2], np.array([15.0, 15.0])), names))
        return found


class GpsJumps(Hypothesis):
    """Fixes that are displaced for a while; needs no simulation."""

    name = "gps_jump"
    kind = "sensor"

    def probes(self, scene: Scene) -> list[Probe]:
        return []

    def candidates(self, scene: Scene, responses: Array) -> list[Candidate]:
        time, found = scene.measurements.fixes, []
        n = len(time)
        step = max(1, n // 80)
        edges = [*range(0, n, step), n]
        for a in range(len(edges) - 1):
            for b in range(a + 1, len(edges)):
                i, j = edges[a], edges[b]
                if j - i < 3 or j - i > 0.5 * n:
                    continue
                t0 = float(0.5 * (time[i - 1] + time[i])) if i else float(time[0] - 1.0)
                t1 = float(0.5 * (time[j - 1] + time[j])) if j < n else float(time[-1] + 1.0)
                columns = np.zeros((len(scene.base), 2))
                columns[i:j, 0] = 1.0
                columns[n + i : n + j, 1] = 1.0
                part = GpsJump(t0=t0, t1=t1)
                owner = newest(scene.model, part)
                found.append(
                    Candidate(
                        added(scene.model, part),
                        Freedom(columns, np.array([0.6, 0.6])),
                        ((f"{owner}.x",), (f"{owner}.y",)),
                        {},
                        (max(t0, float(time[0])), min(t1, float(time[-1]))),
                    )
                )
        return found


def _mean_speed(scene: Scene) -> float:
    return float(np.mean(np.linalg.norm(scene.run.com_velocity, axis=1)))


HYPOTHESES: Final[tuple[Hypothesis, ...]] = (
    everywhere("wind", "physics", lambda scene: Wind(), {"w_f": 4.0, "w_l": 4.0}),
    Gusts(),
    everywhere("drag_area", "physics", lambda scene: DragArea(), {"share": 0.4}),
    Patch(),
    everywhere(
        "speed_dependent_friction",
        "physics",
        lambda scene: SpeedDependentFriction(v_ref=_mean_speed(scene)),
        {"b": 0.008},
    ),
    everywhere(
        "edge_dependent_friction",
        "physics",
        lambda scene: EdgeDependentFriction(edge_ref=float(np.mean(np.abs(scene.run.edge_angle)))),
        {"b": 0.1},
    ),
    everywhere(
        "load_dependent_friction",
        "physics",
        lambda scene: LoadDependentFriction(load_ref=float(np.mean(scene.run.foot_load))),
        {"b": 0.05},
    ),
    everywhere("snow_compaction", "physics", lambda scene: SnowCompaction(), {"c": 2e4}),
    SlopeChanges(),
    Bumps(),
    PolePlants(),
    GpsDelay("start.clock_offset", 0.25),
    GpsJumps(),
    HeadingMisalignment("start.heading_offset", 0.1),
    everywhere(
        "heading_drift",
        "sensor",
        lambda scene: HeadingDrift(t_ref=float(scene.run.time.mean())),
        {"rate": 0.008},
    ),
    everywhere("lever_arm", "sensor", lambda scene: LeverArm(), {"forward": 0.2, "left": 0.2, "up": 0.2}),
    everywhere("insole_gain", "sensor", lambda scene: InsoleGain(), {"left": 0.2, "right": 0.2}),
    everywhere("boot_cuff", "sensor", lambda scene: BootCuff(), {"share": 0.2}),
    Unexplained(),
)
"""The list of them, written out."""
OF_A_DAY: Final = tuple(each for each in HYPOTHESES if isinstance(each, Everywhere) and each.kind == "physics")
"""What acts on all runs of a day alike."""
BY_NAME: Final[dict[str, Hypothesis]] = {hypothesis.name: hypothesis for hypothesis in HYPOTHESES}
