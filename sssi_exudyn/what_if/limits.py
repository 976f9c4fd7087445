"""What a skier can do: where a run is beyond it, the answer says that it is not skiable like this.

A figure counts against its limit, or against the recorded run's where that is larger: what was skied can be skied.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.analysis.biomechanics import RESIDUAL_MOMENT
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.muscle_forces.loads import joint_moments, movement_of
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.what_if.intent import BALANCE_TIME, MOMENT, SETTLING
from sssi_exudyn.what_if.question import STEP, Played, Question

FAR: Final = 1.0
"""m off the recorded path beyond which it is not kept: chosen, half of a ski's length and the width of a stance."""
FORCE: Final = 5.0
"""Body weights of the snow's force on both skis: the largest that races have shown (Supej, Holmberg, Front. Physiol. 10
(2019) 111)."""
KNEE_EXTENSION: Final[Mapping[str, float]] = {"male": 3.45, "female": 2.74}
"""N m per kg of body mass, isometric, at middle knee angles: upper ends of the 95 % intervals of adults' means over 411
studies (Šarabon, Kozinc, Perman, Front. Physiol. 12 (2021) 767941)."""
BALANCE: Final = RESIDUAL_MOMENT["peak"][1]
"""N m of change of the averaged residual moment: the largest that OpenSim's guide accepts."""
_EVERY: Final = 0.05
"""s between the instants at which joint moments are computed."""


@dataclass(frozen=True)
class RunFigures:
    """One of the two runs: its largest loads, and energies in J at its end less at its start."""

    duration_s: float
    mean_speed_mps: float
    peak_force_bodyweights: float
    peak_leg_bodyweights: float
    peak_knee_extension_Nm_per_kg: float
    residual_moment_rms_Nm: float
    kinetic_J: float
    gravity_J: float
    friction_J: float
    rest_J: float


def run_figures(played: Played) -> RunFigures:
    """Return the figures of a run between its first and last sample."""
    run, prepared = played.run, played.prepared
    inside = run.time <= played.times[-1]
    weight = prepared.mass * GRAVITY
    speed2 = np.sum(run.com_velocity[inside] ** 2, axis=1)
    kinetic = 0.5 * prepared.mass * float(speed2[-1] - speed2[0])
    moved = run.com[inside]
    gravity = prepared.mass * float((moved[-1] - moved[0]) @ prepared.gravity)
    power = np.einsum("nsc,nsc->n", run.foot_friction[inside], run.foot_velocity[inside])
    friction = float(np.trapezoid(power, run.time[inside]))
    settled = inside & (run.time >= run.time[0] + SETTLING)
    return RunFigures(
        duration_s=float(played.times[-1] - run.time[0]),
        mean_speed_mps=float(np.mean(np.sqrt(speed2))),
        peak_force_bodyweights=float(run.foot_load[settled].sum(axis=1).max()) / weight,
        peak_leg_bodyweights=float(run.foot_load[settled].max()) / weight,
        peak_knee_extension_Nm_per_kg=_knee_extension(played),
        residual_moment_rms_Nm=moment_rms(played),
        kinetic_J=kinetic,
        gravity_J=gravity,
        friction_J=friction,
        rest_J=kinetic - gravity - friction,
    )


def moment_rms(played: Played) -> float:
    """Return the residual moment at the pelvis, as it is and not averaged, rms over the run, N m."""
    clock, times = played.run.time, played.times
    settled = (clock >= times[0] + SETTLING) & (clock <= times[-1] - SETTLING)
    moment = played.balance.residual(played.run, played.prepared)[settled]
    return float(np.sqrt(np.mean(np.sum(moment**2, axis=1))))


@dataclass(frozen=True)
class Imbalance:
    """Where a skier is furthest from the balance of the recorded run at the same place.

    moment_Nm : change of the residual moment at the pelvis, averaged over ``BALANCE_TIME``
    at_s : instant of the recorded run
    falls : where to, as nothing holds him
    """

    moment_Nm: float
    at_s: float
    falls: str


def imbalance(question: Question, played: Played) -> Imbalance:
    """Return where a run is furthest from the recorded run's balance.

    The residual moment is what a hand at the pelvis would have to give.  Without it the skier falls the other way.
    """
    samples, way = question.samples, question.way
    change = (played.figures - question.intended)[:, MOMENT]
    settled = (samples >= samples[0] + SETTLING) & (samples <= samples[-1] - SETTLING)
    size = np.where(settled, np.linalg.norm(change, axis=1), 0.0)
    worst = int(np.argmax(size))
    (forward, left), up = way[worst], change[worst, 2]
    rolls, pitches = change[worst, :2] @ (forward, left), change[worst, :2] @ (-left, forward)
    ways = (
        (rolls, "to the left", "to the right"),
        (pitches, "backward", "forward"),
        (up, "round to the right", "round to the left"),
    )
    part, positive, negative = max(ways, key=lambda one: abs(one[0]))
    return Imbalance(float(size[worst]), float(samples[worst]), positive if part > 0.0 else negative)


def _knee_extension(played: Played) -> float:
    """Return the largest moment that stretches a knee, N m per kg of body mass."""
    run = played.run
    settled = (run.time >= run.time[0] + SETTLING) & (run.time <= played.times[-1] - SETTLING)
    rows = np.flatnonzero(settled)[:: round(_EVERY / STEP)]
    parts = Parts(played.model, played.motion)
    moments = joint_moments(parts, movement_of(parts, run, rows), run.foot_position[rows], run.snow_moment[rows])
    knees = [PRESCRIBED.index(f"knee_angle_{side}") for side in "lr"]
    return float(np.max(-moments[:, knees])) / played.model.skier.mass


def beyond(asked: RunFigures, recorded: RunFigures, sex: str) -> list[str]:
    """Return which loads of a run are beyond their limits, each as a clause."""
    figures = (
        (
            "his legs bear {:.1f} body weights",
            asked.peak_force_bodyweights,
            recorded.peak_force_bodyweights,
            FORCE,
        ),
        (
            "a knee is stretched with {:.1f} N m/kg",
            asked.peak_knee_extension_Nm_per_kg,
            recorded.peak_knee_extension_Nm_per_kg,
            KNEE_EXTENSION[sex],
        ),
    )
    return [
        f"{clause.format(value)} (limit {max(shown, limit):.3g})"
        for clause, value, shown, limit in figures
        if value > max(shown, limit)
    ]


def out_of_balance(asked: Imbalance) -> list[str]:
    """Return the clause for a skier who is beyond ``BALANCE``, if he is."""
    if asked.moment_Nm <= BALANCE:
        return []
    return [
        f"he falls {asked.falls} at {asked.at_s:.1f} s ({asked.moment_Nm:.0f} N m over {BALANCE_TIME:g} s hold him "
        f"no longer, limit {BALANCE:g})"
    ]
