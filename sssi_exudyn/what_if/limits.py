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
from sssi_exudyn.what_if.intent import MOMENT, MOMENT_SIGMA, SETTLING
from sssi_exudyn.what_if.question import STEP, Played

FAR: Final = 1.0
"""m off the recorded path beyond which it is not kept: chosen, half of a ski's length and the width of a stance."""
FORCE: Final = 5.0
"""Body weights of the snow's force on both skis: the largest that races have shown (Supej, Holmberg, Front. Physiol. 10
(2019) 111)."""
KNEE_EXTENSION: Final[Mapping[str, float]] = {"male": 3.45, "female": 2.74}
"""N m per kg of body mass, isometric, at middle knee angles: upper ends of the 95 % intervals of adults' means over 411
studies (Šarabon, Kozinc, Perman, Front. Physiol. 12 (2021) 767941)."""
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
    """Return the residual moment at the pelvis, rms over the run, N m."""
    times = played.times
    settled = (times >= times[0] + SETTLING) & (times <= times[-1] - SETTLING)
    return float(np.sqrt(np.mean(np.sum(played.figures[settled, MOMENT] ** 2, axis=1))))


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
    """Return what of a run is beyond its limits, each as a clause."""
    least = RESIDUAL_MOMENT["rms"][1]
    figures = (
        ("{:.1f} body weights on the skis", asked.peak_force_bodyweights, recorded.peak_force_bodyweights, FORCE),
        (
            "{:.1f} N m/kg to stretch a knee",
            asked.peak_knee_extension_Nm_per_kg,
            recorded.peak_knee_extension_Nm_per_kg,
            KNEE_EXTENSION[sex],
        ),
        (
            "{:.0f} N m (rms) that nothing holds",
            asked.residual_moment_rms_Nm,
            recorded.residual_moment_rms_Nm + MOMENT_SIGMA,
            least,
        ),
    )
    return [
        f"{clause.format(value)} are beyond {max(shown, limit):.3g}"
        for clause, value, shown, limit in figures
        if value > max(shown, limit)
    ]
