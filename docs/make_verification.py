"""Makes ``docs/notebook/verification.md``: the checks, their references, and the results.

Run it as ``python docs/make_verification.py``; it takes a few minutes.  The tests named in the tables compare the same
figures, with the tolerances and reasons given there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import modal_ski
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.fitting.first_fit import fit_reduced, problem_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.reference import simulate_flat

ROOT = Path(__file__).parents[1]
SECONDS = 4.0
NAMES = ("beginner", "intermediate")

HEAD = """# Verification

Made by `python docs/make_verification.py`. Lengths are the antenna's largest distance over {seconds:g} s of run unless
said otherwise; each example starts from its fit.

"""

COVERED = """## Which test proves what

| what | against | test |
|---|---|---|
| tip deflection, three-point bending, free-free and held frequencies, torsion, roll-up, camber and shovel | Timoshenko, closed forms, eigenvalues | `tests/bodies/ski/test_ski.py`, `test_ski_beam.py` |
| order in the number of elements | 10, 20, 50, 100 elements | `tests/convergence/test_ski_convergence.py` |
| damping as declared | decay of a free vibration | `tests/bodies/ski/test_beam.py` |
| a ski from bench tests, with intervals | synthetic tests with noise | `tests/bodies/ski/test_identification.py` |
| forces of all terms at random states, every back end | NumPy with matrix logarithms, 1e-9; each other, 1e-12 | `tests/simulation/full/test_forces_kernel.py` |
| derivatives of every law by its state and its numbers | complex step, 1e-12 | `tests/conformance/test_conformance.py` |
| a reduced run's derivatives by every number, start, capture errors, mass | extrapolated differences of runs, 3e-4 of the path's | `tests/simulation/reduced/test_tangents.py` |
| the same where edges cut, the groove's memory included | differences of runs, 3e-5 where nothing yields between them | `tests/simulation/reduced/test_carved_tangents.py` |
| rebound, off the snow, number of contact points | reference equation, nothing, each other | `tests/simulation/full/test_forces_kernel.py`, `tests/convergence` |
| block on a slope, side slip, terminal speed, power of friction | g(sin α − μ cos α), closed forms | `tests/simulation/full/test_full.py`, `tests/properties` |
| joint moments from multipliers | Newton-Euler recursion that shares nothing | `tests/bodies/skier/test_inverse_dynamics.py` |
| the model without the tree | the full tree: path and all 28 moments | `tests/simulation/full/test_without_tree.py` |
| masses, inertias, free fall, pendulum | de Leva 1996, closed forms | `tests/bodies/skier/test_anthropometry.py`, `test_skeleton.py` |
| symmetric posture, symmetric loads | each other | `tests/simulation/full/test_full.py` |
| step, elements, heading, clock | each other, with the observed order | `tests/convergence/test_run_convergence.py` |
| the whole model | a flat one in one file, other beams and integrator | `tests/validation/test_reference.py` |
| torsional stiffness matters little; a carved turn needs more resistance across | halved and doubled GJ; μ_n | `tests/convergence/test_run_convergence.py` |
"""


def given(name: str) -> tuple[Model, Motion]:
    """Return an example, fitted by the reduced model."""
    recording = read_recording(ROOT / "examples" / name)
    motion = motion_from_recording(recording)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    return problem.model_at(fit_reduced(problem, prepare(problem.model, motion)).values), motion


def apart(one: SimulationResult, other: SimulationResult) -> float:
    """Return the largest distance (mm) between two antennas."""
    assert one.antenna is not None
    assert other.antenna is not None
    antenna = np.stack([np.interp(one.time, other.time, column) for column in other.antenna.T], axis=1)
    return 1e3 * float(np.max(np.linalg.norm(one.antenna - antenna, axis=1)))


def run(model: Model, motion: Motion, **solver: float) -> SimulationResult:
    """Simulate the first seconds with other choices of the solver."""
    return simulate(replace(model, solver=replace(model.solver, **solver)), motion, stop=motion.start + SECONDS)


def solver_choices(models: dict[str, tuple[Model, Motion]]) -> Iterator[str]:
    """Show the effect of each choice of the solver on the path."""
    yield "## What the solver's choices do\n\nAgainst steps of 1 ms (for the steps) and against the defaults (for all else).\n"
    yield "| choice | " + " | ".join(f"{name} (mm)" for name in NAMES) + " |\n|---|" + "---|" * len(NAMES)
    usual = {name: run(*case) for name, case in models.items()}
    fine = {name: run(*case, step=1e-3) for name, case in models.items()}
    for step in (0.0025, 0.005, 0.01):
        cells = [f"{apart(run(*models[name], step=step), fine[name]):.2f}" for name in NAMES]
        yield f"| steps of {1e3 * step:g} ms | " + " | ".join(cells) + " |"
    choices: list[tuple[str, dict[str, float]]] = [
        *((f"{n} elements a ski", {"elements": n}) for n in (20, 100)),
        *((f"spectral radius {r}", {"spectral_radius": r}) for r in (0.5, 0.9)),
        ("relative tolerance 1e-6", {"relative_tolerance": 1e-6}),
        ("absolute tolerance 1e-6", {"absolute_tolerance": 1e-6}),
    ]
    for label, choice in choices:
        cells = [f"{apart(run(*models[name], **choice), usual[name]):.2f}" for name in NAMES]
        yield f"| {label} | " + " | ".join(cells) + " |"


def second_models(models: dict[str, tuple[Model, Motion]]) -> Iterator[str]:
    """Compare the full model with the reduced, the flat and the tree-less one, and show its energy balance."""
    yield "\n## Against other formulations\n"
    yield "| | " + " | ".join(NAMES) + " |\n|---|" + "---|" * len(NAMES)
    rows: dict[str, list[str]] = {}
    for model, motion in models.values():
        stop = motion.start + SECONDS
        bare = simulate(model, motion, stop=stop)
        reduced = simulate_reduced(model, prepare(model, motion, stop=stop))
        assert bare.antenna is not None
        antenna = np.stack([np.interp(bare.time, reduced.time, column) for column in reduced.antenna.T], axis=1)
        distance = np.max(np.linalg.norm(antenna - bare.antenna, axis=1))
        rows.setdefault("reduced model (linear modal skis), mm", []).append(f"{1e3 * distance:.1f}")
        full = simulate(model, motion, stop=stop, tree=True)
        rows.setdefault("without the skeleton's tree, mm", []).append(f"{apart(bare, full):.2g}")
        peak = np.max(np.abs(full.joint_moments), axis=0)
        gap = np.abs(bare.joint_moments - full.joint_moments)[1:]  # the first state has no multipliers
        worst = np.max(np.max(gap, axis=0) / peak)
        rows.setdefault("its joint moments, worst of 28, share of the peak", []).append(f"{100 * worst:.2f} %")
        i = int(np.searchsorted(full.time, motion.start + 2.0))
        j = int(np.searchsorted(full.time, motion.start + 2.6))
        flat = simulate_flat(
            model, motion, float(full.time[i]), float(full.time[j]), full.pelvis[i], full.pelvis_velocity[i]
        )
        end = flat["pelvis"][-1] - full.pelvis[j]
        rows.setdefault("flat model in one file, over 0.6 s, mm", []).append(f"{1e3 * np.linalg.norm(end):.1f}")
        rows.setdefault("energy balance, gap over energy turned over", []).append(f"{full.closure_percent:.4f} %")
    for label, cells in rows.items():
        yield f"| {label} | " + " | ".join(cells) + " |"


def skis(model: Model) -> Iterator[str]:
    """Show held frequencies by the number of elements, and the observed order."""
    yield "\n## The ski, held at its boot centre\n\n| elements | first three frequencies (Hz) |\n|---|---|"
    frequencies: list[Array] = []
    for count in (10, 20, 50, 100, 200):
        frequencies.append(modal_ski(mesh(model.ski, count), 3).frequency)
        yield f"| {count} | " + ", ".join(f"{f:.3f}" for f in frequencies[-1]) + " |"
    order = np.log2(np.abs(frequencies[0] - frequencies[-1]) / np.abs(frequencies[1] - frequencies[-1]))
    yield (
        "\nOrder from 10 to 20 elements: "
        + ", ".join(f"{o:.1f}" for o in order)
        + "; what is held is the node nearest to the boot centre, whose place changes with the number."
    )


def main() -> None:
    models = {name: given(name) for name in NAMES}
    lines = [HEAD.format(seconds=SECONDS), *solver_choices(models), *second_models(models)]
    lines += [*skis(models["beginner"][0]), f"\ng = {GRAVITY} m/s².\n", COVERED]
    (ROOT / "docs" / "notebook" / "verification.md").write_text(
        "\n".join(lines).replace("\n\n\n", "\n\n"), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
