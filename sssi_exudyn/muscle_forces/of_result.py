"""The muscles of a result: from its series to muscle forces, and from these to columns, figures and files."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from sssi_exudyn.analysis.boots import cuff_column
from sssi_exudyn.bodies.muscles.muscles import LUMBAR_GROUPS, SIDES, SkierMuscles, leg_groups, skier_muscles
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.choices import MuscleSet
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.io.storage import Storage, storage_text
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.muscle_forces import loads
from sssi_exudyn.muscle_forces.bands import Errors, Nominal, errors_of, half_widths
from sssi_exudyn.muscle_forces.forces import JOINTS, LACKS, MUSCLED, MuscleForces, muscle_forces
from sssi_exudyn.muscle_forces.loads import Movement
from sssi_exudyn.results.draws import draws_of
from sssi_exudyn.results.folder import MUSCLES, SERIES, SKELETON
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import LackingJoint, MuscleFigures, Reserve
from sssi_exudyn.simulation.assembly import Parts

LEAST_SAMPLES: Final = 6
"""Least samples of a result: a quintic spline needs as many."""
RESERVE_SHARE: Final = 5.0
"""Largest reserve in per cent of the largest moment: J. L. Hicks et al., J. Biomech. Eng. 137 (2015) 020905."""


@dataclass(frozen=True)
class MuscleRun:
    """The muscles of a result.

    time : (n,) s
    chosen : the set of muscles
    body_weight : N, of the skier without equipment
    power : exponent of the activations in the minimised sum
    wall : s of computing paths and optimisation
    errors : draws from the uncertainty of the estimate; None where nothing was estimated
    """

    time: Array
    skier: SkierMuscles
    chosen: MuscleSet
    forces: MuscleForces
    body_weight: float
    power: int
    wall: float
    errors: Errors | None = None


def muscles_of(run: StoredRun, folder: Path, power: int = 2, chosen: MuscleSet = "full") -> MuscleRun:
    """Compute the forces of the ``chosen`` muscles of a result, which ``folder`` holds.

    Raises InputError where the result has no skeleton or too few samples, SssiError where no activations are found.
    """
    if run.geometry is None:
        raise InputError(folder / SKELETON, "", "the result did not keep the skier's lengths", "run it again")
    if len(run.time) < LEAST_SAMPLES:
        raise InputError(folder / SERIES, "", f"fewer than {LEAST_SAMPLES} samples", "simulate a longer run")
    skier = skier_muscles(run.geometry, (run.model.skier.mass, run.model.skier.height), chosen)
    moments = run.series[[f"{name}_moment_Nm" for name in PRESCRIBED]].to_numpy(dtype=float, copy=True)
    for side in ("left", "right"):  # older results have no cuffs
        if cuff_column(side, "flexion") in run.series.columns:
            cuff = run.series[cuff_column(side, "flexion")].to_numpy(dtype=float)
            moments[:, PRESCRIBED.index(f"ankle_angle_{side[0]}")] -= cuff
    angles = np.radians(run.series[[f"{name}_deg" for name in PRESCRIBED]].to_numpy(dtype=float))
    motion = spline_motion(run.geometry, run.model.inclination, run.time, angles)
    _, rates, accelerations = motion.evaluate(run.time)
    between = joint_forces(run, Parts(run.model, motion), angles, rates, accelerations)
    begin = clock.perf_counter()
    forces = muscle_forces(skier, run.geometry, run.time, angles, rates, moments, between, power)
    wall = clock.perf_counter() - begin
    nominal = Nominal(run.model, run.geometry, run.time, angles, moments, between)
    errors = errors_of(skier, nominal, draws_of(run, folder), power)
    return MuscleRun(run.time, skier, chosen, forces, run.model.skier.mass * GRAVITY, power, wall, errors)


def joint_forces(run: StoredRun, parts: Parts, angles: Array, rates: Array, accelerations: Array) -> Array:
    """Compute ``loads.joint_forces`` of a result."""
    velocity, sides = run.slope("pelvis_velocity", "mps"), ("left", "right")
    skis = [CubicSpline(run.time, run.slope(f"{side}_foot_velocity", "mps"))(run.time, 1) for side in sides]
    movement = Movement(
        time=run.time,
        q=np.hstack([run.slope("pelvis", "m"), angles]),
        rates=np.hstack([velocity, rates]),
        accelerations=np.hstack([CubicSpline(run.time, velocity)(run.time, 1), accelerations]),
        com=run.com,
        com_velocity=CubicSpline(run.time, run.com)(run.time, 1),
        snow=np.stack([run.snow_force(side) for side in sides], axis=1),
        ski_acceleration=np.stack(skis, axis=1),
    )
    return loads.joint_forces(parts, movement)


def group_activation(run: MuscleRun, side: str, region: str, group: str, forces: MuscleForces | None = None) -> Array:
    """Return the mean activation (n,) of a group, each muscle weighted with its greatest force.

    ``forces``, where given, are other forces of the same muscles.

    The leg's psoas major is the iliacus and the psoas' fascicles, which belong to the trunk too.
    """
    indices = [
        k
        for k, named in enumerate(run.skier.named)
        if named.side == side
        and named.group == group
        and (named.region == region or (region == "leg" and group == "psoas_major"))
    ]
    weight = np.array([run.skier.model.muscles[k].max_isometric_force for k in indices])
    return np.asarray((forces or run.forces).activation[:, indices] @ weight / weight.sum())


def contact_weights(run: MuscleRun) -> dict[str, Array]:
    """Return the load (n,) of each joint, in body weights."""
    return dict(zip(JOINTS, _sizes(run, run.forces).T, strict=True))


def _sizes(run: MuscleRun, forces: MuscleForces) -> Array:
    """Return the loads (n, 7) of the joints in body weights."""
    return np.asarray(np.linalg.norm(forces.contact, axis=2) / run.body_weight)


def contact_bands(run: MuscleRun) -> dict[str, Array]:
    """Return the half width (n,) of the band of each joint's load, in body weights; empty without draws."""
    if run.errors is None:
        return {}
    widths = half_widths(run.errors, lambda forces: _sizes(run, forces), run.time)
    return dict(zip(JOINTS, widths.T, strict=True))


def group_column(region: str, group: str, side: str) -> str:
    """Return the name of the column with a muscle group's activation."""
    return f"muscles_{region}_{group}_{side}_activation"


def contact_column(joint: str) -> str:
    """Return the name of the column with a joint's load."""
    return f"muscles_{joint}_contact_bodyweights"


def contact_band_column(joint: str) -> str:
    """Return the name of the column with the half width of the band of a joint's load."""
    return f"muscles_{joint}_contact_band_bodyweights"


def add_muscles(series: pd.DataFrame, run: MuscleRun) -> pd.DataFrame:
    """Add to the series columns of every muscle, every group, the reserves and the joints' loads; older ones go."""
    forces = run.forces
    columns: dict[str, Array] = {}
    for k, muscle in enumerate(run.skier.model.muscles):
        columns[f"muscle_{muscle.name}_activation"] = forces.activation[:, k]
        columns[f"muscle_{muscle.name}_force_N"] = forces.force[:, k]
    for side in SIDES:
        for region, groups in (("leg", leg_groups(run.chosen)), ("lumbar", LUMBAR_GROUPS)):
            for group in groups:
                columns[group_column(region, group, side)] = group_activation(run, side, region, group)
    for k, name in enumerate(MUSCLED):
        columns[f"muscles_{name}_wanted_Nm"] = forces.wanted[:, k]
        columns[f"muscles_{name}_reserve_Nm"] = forces.reserve[:, k]
    for name, weights in contact_weights(run).items():
        columns[contact_column(name)] = weights
    for name, widths in contact_bands(run).items():
        columns[contact_band_column(name)] = widths
    columns |= _other_bands(run)
    kept = [name for name in series.columns if not name.startswith(("muscle_", "muscles_"))]
    return pd.concat([series[kept], pd.DataFrame(columns, index=series.index)], axis=1)


def _other_bands(run: MuscleRun) -> dict[str, Array]:
    """Return half widths of the bands of groups' activations and of wanted moments, by column; none without draws."""
    if run.errors is None:
        return {}
    groups = [
        (side, region, group)
        for side in SIDES
        for region, names in (("leg", leg_groups(run.chosen)), ("lumbar", LUMBAR_GROUPS))
        for group in names
    ]

    def activations(forces: MuscleForces) -> Array:
        return np.stack([group_activation(run, *group, forces) for group in groups], axis=1)

    of_groups = half_widths(run.errors, activations, run.time)
    of_moments = half_widths(run.errors, lambda forces: forces.wanted, run.time)
    names = [f"{group_column(region, group, side)}_band" for side, region, group in groups]
    names += [f"muscles_{name}_wanted_band_Nm" for name in MUSCLED]
    return dict(zip(names, np.hstack([of_groups, of_moments]).T, strict=True))


def storage_texts(run: MuscleRun) -> dict[str, str]:
    """Return activations and tendon forces (N) as OpenSim's static optimisation writes them, by file name."""
    names = ("time", *(muscle.name for muscle in run.skier.model.muscles))
    return {
        file: storage_text(Storage(title, names, np.column_stack([run.time, values]), in_degrees=False))
        for file, title, values in (
            (MUSCLES[0], "Static Optimization activations", run.forces.activation),
            (MUSCLES[1], "Static Optimization forces", run.forces.force),
        )
    }


def muscle_figures(run: MuscleRun) -> MuscleFigures:
    """Return the summary's group ``muscles``."""
    forces = run.forces
    reserve: dict[str, Reserve] = {}
    lacking: list[LackingJoint] = []
    for k, name in enumerate(MUSCLED):
        size = np.abs(forces.reserve[:, k])
        largest = float(np.max(np.abs(forces.wanted[:, k])))
        worst = int(np.argmax(size))
        share = 100.0 * float(size[worst]) / largest if largest > 0.0 else 0.0
        reserve[name] = Reserve(
            peak_Nm=float(size[worst]),
            percent_of_peak_moment=share,
            verdict="good" if share <= RESERVE_SHARE else "bad",
        )
        if size[worst] > LACKS:
            lacking.append(
                LackingJoint(
                    coordinate=name,
                    share_of_samples=float(np.mean(size > LACKS)),
                    worst_Nm=float(forces.reserve[worst, k]),
                    wanted_then_Nm=float(forces.wanted[worst, k]),
                    at_s=float(run.time[worst]),
                )
            )
    enough = np.all(np.abs(forces.reserve) <= LACKS, axis=1)
    return MuscleFigures(
        count=len(run.skier.named),
        power=run.power,
        samples=len(run.time),
        wall_s=run.wall,
        strong_enough_share=float(np.mean(enough)),
        reserve=reserve,
        lacking=tuple(lacking),
        contact_peak_bodyweights={name: float(weights.max()) for name, weights in contact_weights(run).items()},
        muscle_set=run.chosen,
        draws=0 if run.errors is None else len(run.errors.drawn),
        contact_peak_band_bodyweights={
            name: float(widths[np.argmax(contact_weights(run)[name])]) for name, widths in contact_bands(run).items()
        },
    )
