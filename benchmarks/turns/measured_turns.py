"""The model's figures next to what others measured on real skiers.

    python benchmarks/turns/measured_turns.py --json docs/notebook/measured_turns.json [--runs results/reproduction]

Fits both bundled recordings, fits each again to fixes of a run whose forces are known, and turns skis in the rig.  Runs
that are already in RUNS are not computed again.  All draws have fixed seeds.  ``docs/make_measured_turns.py`` makes the
table of ``docs/notebook/reproduction.md`` from the JSON.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
from measured_values import MEASURED

import sssi_exudyn
from sssi_exudyn.analysis.biomechanics import WHOLE
from sssi_exudyn.bodies.ski.ski import Ski, read_ski
from sssi_exudyn.bodies.skier.anthropometry import body_inertia
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, average_geometry, forward_kinematics
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import SegmentState
from sssi_exudyn.contact.terms.air import PostureAir, ShownAreas
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise, draw_noise
from sssi_exudyn.fitting.noise import NOISE
from sssi_exudyn.io.writing import to_json, write_atomically
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.uncertainty import Uncertainty
from sssi_exudyn.results.folder import SUMMARY
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.facing import facing
from sssi_exudyn.simulation.turns.steady_turn import TurnCase, edges_of, start_rolling, steady_turn
from sssi_exudyn.sweeps.parameters import reshape

ROOT: Final = Path(__file__).parents[2]
NAMES: Final = ("beginner", "intermediate")
EDGES_DEG: Final = (20.0, 30.0, 40.0, 50.0, 60.0)
LOADS: Final = (500.0, 900.0)
"""N on one ski: what an outside ski bears at the change of turns and in mid-turn."""
PLACES: Final = np.array([-0.6, -0.4, -0.2, 0.2, 0.4, 0.6])
"""m ahead of the boot centre; where Thorwartl's six sensors are is not in the abstract."""
WINDOW: Final = 0.12
"""m to either side, over which a parabola gives the curvature: some ten contact points."""
SIDECUTS: Final = (30.0, 40.0)
"""m; radii of the sidecut of Kröll's and Spörri's skis, the middle one (35 m) left out."""
RACER: Final = (60.0, 18.0)
"""Edge angle (degrees) and speed (m/s) of a giant slalom."""
SEED: Final = 20261126
FELT: Final = 0.94
"""Share of the force square to the soles that the bundled insoles feel:
docs/notebook/decisions/0003-what-insoles-feel.md."""
HEIGHT: Final = 1.75
POSTURES: Final = {
    "upright": dict[str, float](),
    "tuck": {
        "knee_angle": 110.0, "hip_flexion": 135.0, "ankle_angle": 25.0, "lumbar_extension": -30.0,
        "arm_flex": 90.0, "elbow_flex": 110.0, "arm_add": 30.0,
    },
}  # fmt: skip
"""Degrees by which joints of both sides are bent."""


@with_one_thread_for_products
def main(arguments: Sequence[str] | None = None) -> None:
    """Write all figures as JSON, and print each next to what was measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, required=True, help="file for the figures")
    parser.add_argument("--runs", type=Path, default=ROOT / "results" / "reproduction", help="folder that keeps runs")
    chosen = parser.parse_args(arguments)
    figures = {**rig_figures(), **torsion_figures(), **sidecut_figures(), **drag_areas()}
    print("rig: done", flush=True)
    for name in NAMES:
        run = kept(chosen.runs / name, partial(sssi_exudyn.run, ROOT / "examples" / name))
        figures |= run_figures(run, name)
        print(f"{name}: done", flush=True)
        for key, value in errors_from_fixes(run, name, chosen.runs).items():
            figures[f"fixes_{key}_N"] = max(figures.get(f"fixes_{key}_N", 0.0), value, key=abs)
        print(f"{name}, from fixes: done", flush=True)
    write_atomically(chosen.json, to_json({key: round(value, 6) for key, value in sorted(figures.items())}))
    for row in MEASURED:
        verdict = "met" if row.met(figures[row.key]) else "MISSED"
        print(f"{verdict:7}{row.what}: {row.shown(figures)}; measured {row.value}")


def kept(out: Path, make: Callable[[Path], object]) -> StoredRun:
    """Return the run in the folder ``out``, which is made first where there is none."""
    if not (out / SUMMARY).is_file():
        make(out)
    return read_run(out)


def run_figures(run: StoredRun, name: str) -> dict[str, float]:
    """Return the figures of a fitted run: friction, shares of losses, forces by phase, moments."""
    summary, table = run.summary, run.turn_table
    assert summary.losses is not None
    assert summary.energy.work_J is not None
    assert table is not None
    complete = table[table["complete"]]
    by_phase = {str(phase): rows for phase, rows in complete.groupby("phase")}
    whole, control = by_phase[WHOLE], by_phase["control"]
    work = {key: value or 0.0 for key, value in summary.energy.work_J.items()}
    weight = run.model.skier.mass * GRAVITY
    sole = run.series[["left_sole_N", "right_sole_N"]].sum(axis=1).to_numpy(dtype=float) / weight
    lost = summary.losses.energy_lost_J_per_kg_m
    assert lost is not None

    def peak(column: str, sign: float) -> float:
        return float((sign * whole[column]).max())

    def energy(phase: str) -> float:
        return float(by_phase[phase]["energy_lost_J_per_kg"].sum())

    snow = -(work["contact"] + work["friction"] + work.get("skid", 0.0))
    spent = snow - work["air"] - work["posture"]
    return {
        f"mu_t_{name}": summary.friction.mu_t.value or np.nan,
        f"effective_friction_{name}": summary.losses.effective_friction or np.nan,
        f"drag_share_{name}": summary.losses.air_share or np.nan,
        f"snow_share_{name}": snow / spent,
        f"bodies_share_{name}": -work["posture"] / spent,
        f"energy_lost_{name}_J_per_kg_m": lost[WHOLE] or np.nan,
        f"control_loss_ratio_{name}": energy("control") / energy("initiation"),
        f"start_force_{name}_bw": float(np.mean(np.interp(whole["start_s"], run.time, sole))),
        f"control_force_{name}_bw": mean_between(run.time, sole, control[["start_s", "end_s"]].to_numpy(dtype=float)),
        f"outside_share_{name}": float(control["outside_force_share"].mean()),
        f"knee_extension_{name}_nm_kg": peak("knee_angle_outside_moment_min_Nm_per_kg", -1.0),
        f"hip_extension_{name}_nm_kg": peak("hip_flexion_outside_moment_min_Nm_per_kg", -1.0),
        f"plantarflexion_{name}_nm_kg": peak("ankle_angle_outside_moment_min_Nm_per_kg", -1.0),
        f"lumbar_extension_{name}_nm_kg": peak("lumbar_extension_moment_max_Nm_per_kg", 1.0),
        **({"insole_share_largest": insole_share(run)} if name == "beginner" else {}),
    }


def mean_between(time: Array, values: Array, spans: Array) -> float:
    """Return the mean over intervals (m, 2) s of the means of ``values`` (n,) within them."""
    return float(np.mean([values[(time >= begin) & (time <= end)].mean() for begin, end in spans]))


def insole_share(run: StoredRun) -> float:
    """Return what the insoles feel over what presses square to the soles, the largest of the phases' means."""
    assert run.measured is not None
    assert run.turn_table is not None
    felt = run.measured.dropna(subset=["left_insole_N"])
    time = felt["time_s"].to_numpy(dtype=float)
    pressed = run.series[["left_sole_N", "right_sole_N"]].sum(axis=1)
    total = felt[["left_insole_N", "right_insole_N"]].sum(axis=1).to_numpy(dtype=float)
    simulated = np.interp(time, run.time, pressed)
    shares = []
    for _, rows in run.turn_table[run.turn_table["complete"] & (run.turn_table["phase"] != WHOLE)].groupby("phase"):
        spans = rows[["start_s", "end_s"]].to_numpy(dtype=float)
        shares.append(mean_between(time, total, spans) / mean_between(time, simulated, spans))
    return max(shares)


def errors_from_fixes(run: StoredRun, name: str, folder: Path) -> dict[str, float]:
    """Return errors (N) of forces that are fitted to fixes without insoles.

    Their reference is a run of the model as the fit does not know it, and the bundled insoles, which are of another
    world.
    """
    recording = sssi_exudyn.read_recording(ROOT / "examples" / name)
    other = kept(folder / f"{name}-truth", lambda out: sssi_exudyn.simulate(recording, out, model=unlike(run.model)))
    seen, without = fixes_of(other, recording, SEED), replace(recording, insoles=None)
    again = kept(folder / f"{name}-fixes", lambda out: sssi_exudyn.run(seen, out))
    alone = kept(folder / f"{name}-without-insoles", lambda out: sssi_exudyn.run(without, out))
    return {**force_errors(other, again), **insole_errors(alone, recording)}


def unlike(model: Model) -> Model:
    """Return the model with a skier and a drag coefficient that are each a standard deviation off what is stated."""
    usual = Uncertainty()
    heavier = replace(model, skier=replace(model.skier, mass=model.skier.mass + usual.mass))
    return heavier.with_values({"air.c_d": (1.0 + usual.drag) * model.value("air.c_d")})


def insole_errors(run: StoredRun, recording: Recording) -> dict[str, float]:
    """Return offset and standard deviation (N) of the force square to both soles less the insoles' over ``FELT``."""
    insoles = recording.insoles
    assert insoles is not None
    inside = (insoles.time >= run.time[0]) & (insoles.time <= run.time[-1])
    pressed = run.series[["left_sole_N", "right_sole_N"]].sum(axis=1)
    difference = np.interp(insoles.time, run.time, pressed) - (insoles.left + insoles.right) / FELT
    return {
        "insoles_offset": float(np.mean(difference[inside])),
        "insoles_sd": float(np.std(difference[inside])),
    }


def fixes_of(truth: StoredRun, recording: Recording, seed: int) -> Recording:
    """Return the recording with the known run's antenna, seen with the usual noise of fixes, and without insoles."""
    gps = recording.gps
    assert gps is not None
    time = gps.time[gps.between(truth.time[0], truth.time[-1])]
    sigma = float(np.median(gps.sigma))
    rng = np.random.default_rng(seed)
    place = np.column_stack(
        [np.interp(time, truth.time, truth.series[f"antenna_{axis}_m"]) for axis in ("east", "north", "up")]
    )
    for column, noise, scale in ((0, NOISE.gps, 1.0), (1, NOISE.gps, 1.0), (2, NOISE.height, gps.vertical)):
        place[:, column] += draw_noise(rng, time, ExponentialNoise(noise.size * scale * sigma, noise.memory))
    seen = replace(gps, time=time, enu=place, sigma=np.full(len(time), sigma), speed=None, course=None)
    return replace(recording, gps=seen, insoles=None)


def force_errors(truth: StoredRun, estimate: StoredRun) -> dict[str, float]:
    """Return offset and standard deviation (N) of the estimated forces less the true ones, as Gilgien parts them.

    The snow's force is parted along the path of the centre of mass (friction) and across it (reaction).
    """
    errors = {}
    true, estimated = (forces_along_path(run, truth.time) for run in (truth, estimate))
    for key, values in true.items():
        difference = estimated[key] - values
        errors[f"{key}_offset"] = float(np.mean(difference))
        errors[f"{key}_sd"] = float(np.std(difference))
    return errors


def forces_along_path(run: StoredRun, time: Array) -> dict[str, Array]:
    """Return reaction, friction and drag (n,) N of a run at instants (n,) s."""
    path = run.slope("com_velocity", "mps")
    path = path / np.linalg.norm(path, axis=1, keepdims=True)
    snow = run.snow_force("left") + run.snow_force("right")
    along = np.sum(snow * path, axis=1)
    parts = {
        "reaction": np.linalg.norm(snow - along[:, None] * path, axis=1),
        "friction": -along,
        "air": np.linalg.norm(run.slope("drag", "N"), axis=1),
    }
    return {key: np.interp(time, run.time, values) for key, values in parts.items()}


def bending(ski: Ski, edges_deg: Sequence[float], load: float) -> tuple[Array, Array]:
    """Return curvatures (m, 6) 1/m of the ski's bending at ``PLACES``, and radii (m,) m, in steady turns."""
    rolling = start_rolling(edges_of(ski))
    curvatures, radii = [], []
    for edge in edges_deg:
        turn, rolling = steady_turn(TurnCase(edge=float(np.radians(edge)), load=load), rolling)
        edges = rolling.ski
        modes = rolling.state.sought[-len(edges.omega) :]
        up = edges.shape[:, :, 2].mean(axis=1) @ modes
        curvatures.append(
            [
                2.0 * np.polyfit(edges.station[near] - place, up[near], 2)[0]
                for place in PLACES
                for near in [np.abs(edges.station - place) < WINDOW]
            ]
        )
        radii.append(turn.radius or np.inf)
    return np.array(curvatures), np.array(radii)


def rig_figures() -> dict[str, float]:
    """Return how slalom_165 bends by edge angle and load, and its radii at Reid's edge angles."""
    ski = read_ski("slalom_165", Path())
    little, much = (bending(ski, EDGES_DEG, load)[0] for load in LOADS)
    places = np.asarray(np.corrcoef(np.vstack([little, much]).T), dtype=np.float64)
    radii = bending(ski, (60.0, 65.7, 71.0), TurnCase().load)[1]
    front, rear = much[-1, 3:].mean(), much[-1, :3].mean()
    return {
        "curvature_by_edge_1_m_deg": float(np.min(np.diff(np.stack([little, much]), axis=1)) / np.diff(EDGES_DEG)[0]),
        "curvature_by_load_1_m_kN": float(np.min(much - little) / (1e-3 * (LOADS[1] - LOADS[0]))),
        "curvature_rear_r": float(places[1, 2]),
        "curvature_front_r": float(places[3:, 3:].min()),
        "front_over_rear": float(front / rear),
        "radius_65_7_deg_m": float(radii[1]),
        "radius_71_deg_m": float(radii[2]),
    }


def torsion_figures() -> dict[str, float]:
    """Return by which share the radius at 60° changes where the ski is twice as stiff in torsion."""
    ski = read_ski("slalom_165", Path())
    stiff = replace(ski, shear_modulus=2.0 * ski.shear_modulus)
    soft_radius, stiff_radius = (bending(one, (60.0,), TurnCase().load)[1][0] for one in (ski, stiff))
    return {"torsion_radius_change": float(stiff_radius / soft_radius - 1.0)}


def sidecut_figures() -> dict[str, float]:
    """Return radius, force and duration of a turn with a sidecut of 40 m over those with one of 30 m."""
    ski = read_ski("giant_slalom_183", Path())
    edge, speed = RACER
    radii = []
    for sidecut in SIDECUTS:
        shaped = reshape(ski, {"sidecut_scale": sidecut_radius(ski) / sidecut})
        radii.append(bending(shaped, (edge,), TurnCase().load)[1][0])
    force = [float(np.hypot(GRAVITY, speed**2 / radius)) for radius in radii]
    return {
        "sidecut_radius_ratio": float(radii[1] / radii[0]),
        "sidecut_force_ratio": force[1] / force[0],
        "sidecut_time_ratio": float(radii[1] / radii[0]),  # of one arc at one speed
    }


def sidecut_radius(ski: Ski) -> float:
    """Return the radius (m) of the circle through both widest places and the waist, as makers state it."""
    s = np.linspace(0.0, 1.0, 2001)
    width = ski.width(s)
    middle = len(s) // 2
    tail, tip = int(np.argmax(width[:middle])), middle + int(np.argmax(width[middle:]))
    waist = float(width[tail:tip].min())
    length = (s[tip] - s[tail]) * ski.length
    return float(length**2 / (2.0 * (width[tail] + width[tip] - 2.0 * waist)))


def drag_areas() -> dict[str, float]:
    """Return the drag areas (m²) of a skier of 1.75 m, upright and in a tuck, by ``posture_air``."""
    chain, law, areas = average_geometry(HEIGHT), PostureAir(), ShownAreas().of_height(HEIGHT)
    inertias = body_inertia(chain, 75.0, "male", boot_mass=1.9, binding_mass=0.6)
    shown = {name: np.array(parts) for name, parts in areas.items()}
    figures = {}
    for posture, bent in POSTURES.items():
        q = np.zeros((1, 3 + len(PRESCRIBED)))
        for column, name in enumerate(PRESCRIBED, 3):
            q[0, column] = np.radians(bent.get(name[:-2] if name.endswith(("_r", "_l")) else name, 0.0))
        tilt = bent.get("knee_angle", 0.0) - bent.get("hip_flexion", 0.0) - bent.get("ankle_angle", 0.0)
        q[0, 3 + PRESCRIBED.index("pelvis_tilt")] = np.radians(tilt)  # so that the feet are flat
        facing_air = facing(forward_kinematics(chain, q, 0.0), inertias, shown)[0]
        states = (SegmentState((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, tuple(m[np.triu_indices(3)])) for m in facing_air)
        drag = sum(law.force(FloatMath(), state)[0] for state in states)
        figures[f"drag_area_{posture}_m2"] = float(-drag / (0.5 * law.rho))
    return figures


if __name__ == "__main__":
    main()
