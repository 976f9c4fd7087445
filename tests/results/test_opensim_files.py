"""Whether anyone can check a run's forces from its files for OpenSim alone: Newton, Euler, inverse dynamics."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from bundled import bundled
from osim_dynamics import Files

from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.body_forces import PolePlant
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.storage import Storage, read_storage
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.results.opensim import opensim_texts
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.terrain.surface import Surface, surface_over

STEP, SECONDS = 0.002, 0.6
"""s"""
ENDS = slice(20, -20)
"""Samples at which splines know the movement on both sides."""


def hill(path: Array) -> Surface:
    """Waves 9 m and 25 m long under ``path`` (n, 2), up to 8 degrees steeper than the plane."""
    empty = surface_over(path, 1.0, 10.0)
    f, l = empty.nodes().T  # noqa: E741
    height = 0.05 * np.sin(0.7 * f + 0.3 * l) + 0.4 * np.sin(0.25 * f - 0.1 * l + 1.0)
    return replace(empty, mean=height.reshape(empty.mean.shape))


@cache
def texts_and_run(ground: str) -> tuple[dict[str, str], SimulationResult]:
    """A stretch of a turn on a ``plane``, on a ``hill`` with a pole, or ``carved``: the files, and the run itself."""
    recording, motion = bundled("intermediate")
    model = model_of(recording, motion).with_values({"friction.mu_t": 0.19, "friction.mu_n": 0.9})
    model = replace(model, solver=replace(model.solver, step=STEP))
    if ground == "hill":
        start = np.array([model.start.f, model.start.l])
        pole = PolePlant(forward=-8.0, up=20.0, t=motion.start + 0.5 * SECONDS, width=0.08, side=1.0)
        model = replace(model, surface=hill(start + [[-5.0, -10.0], [20.0, 10.0]]), terms=(*model.terms, pole))
    if ground == "carved":
        model = replace(model, terms=combine_terms(model.terms, [Carving()]))
    run = simulate(model, motion, stop=motion.start + SECONDS)
    return opensim_texts(run, Parts(model, correct_motion(model, motion))), run


def rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values[ENDS] ** 2, axis=0)))


def differences(moments: Storage, of_opensim: dict[str, Array]) -> dict[str, float]:
    return {
        name: float(rms(of_opensim[name.removesuffix("_moment")] - moments.values[:, i]))
        for i, name in enumerate(moments.columns)
        if name != "time"
    }


def residual(files: Files, moments: Storage) -> Array:
    """(n, 3) N m: the vector whose parts along the pelvis' three axes are the moments in the file."""
    names = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
    axes = np.stack([files.axes[name].direction for name in names], axis=1)
    parts = np.stack([moments.values[:, moments.columns.index(f"{name}_moment")] for name in names], axis=1)
    return np.asarray(np.linalg.solve(axes, parts[..., None])[..., 0])


@pytest.mark.long(seconds=20)
@pytest.mark.parametrize(
    ("ground", "newtons", "newton_metres"),
    # edges that bite and let go within a few steps shake the skier faster than skis on the paper's snow do
    [("plane", 0.5, 0.3), ("hill", 0.5, 0.3), ("carved", 1.5, 0.5)],
)
def test_newton_euler_and_joint_moments_follow_from_the_files(
    ground: str, newtons: float, newton_metres: float
) -> None:
    texts, run = texts_and_run(ground)
    files = Files(texts)
    moments = read_storage(Path("joint_moments.sto"), texts["joint_moments.sto"])
    force, moment = files.left_over()
    moment -= residual(files, moments)  # a posture that is prescribed: nothing in nature holds the pelvis
    # What is left is the time step: the solver knows accelerations to its second order, splines know them by places,
    # and a skier on snow vibrates at some 15 Hz: (2 pi 15 Hz 2 ms)²/12 is 0.3 % of the tens of newtons that this takes.
    assert np.all(rms(force) < newtons)
    assert np.all(rms(moment) < newton_metres)
    # forces that are 1 % wrong would not pass
    assert rms(run.snow.force.sum(axis=1)).max() > 100.0 * newtons
    assert set(moments.columns[1:]) == {f"{name}_moment" for name in files.axes if name[-3:-1] != "_t"}
    for name, difference in differences(moments, files.inverse_dynamics()).items():
        assert difference < newton_metres, name  # as of the whole


@pytest.mark.long(seconds=1)
def test_on_a_hill_the_force_is_not_along_the_planes_normal() -> None:
    """What stood in the files before: load along the plane's normal, no moment."""
    texts, run = texts_and_run("hill")
    tilt = np.degrees(np.arccos(run.snow.normal[..., 2]))
    assert tilt.max() > 4.0
    files = Files(texts)
    names = [name for name in files.forces.columns if "_snow_torque_" in name]
    without = files.forces.values.copy()
    without[:, [files.forces.columns.index(name) for name in names]] = 0.0
    files.forces = replace(files.forces, values=without)
    _, moment = files.left_over()
    assert rms(moment).max() > 3.0  # N m: the free moments


@pytest.mark.long
def test_the_centre_of_pressure_carries_the_whole_moment() -> None:
    _, run = texts_and_run("plane")
    about_foot = np.cross(run.snow.pressure_arm, run.snow.force) + run.snow.free_moment
    np.testing.assert_allclose(about_foot, run.snow.moment, atol=1e-9)
    across = np.cross(run.snow.free_moment, run.snow.normal)
    pressing = np.sum(run.snow.force * run.snow.normal, axis=-1) > 20.0
    np.testing.assert_allclose(across[pressing], 0.0, atol=1e-9)
    assert np.all(np.abs(np.einsum("nsk,nsk->ns", run.snow.pressure_arm, run.foot_forward)) < 0.9)  # within the ski
    along_normal = run.foot_load[..., None] * run.snow.normal
    np.testing.assert_allclose(run.snow.force, along_normal + run.foot_friction, atol=1e-6)  # of one plane


@pytest.mark.skipif(find_spec("opensim") is None, reason="OpenSim is not installed: pip install sssi_exudyn[opensim]")
@pytest.mark.parametrize("ground", ["plane", "hill"])
def test_opensims_own_inverse_dynamics_gives_the_joint_moments(ground: str, tmp_path: Path) -> None:
    texts, _ = texts_and_run(ground)
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    code = "import opensim; opensim.InverseDynamicsTool('inverse_dynamics.xml').run()"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "inverse_dynamics.sto").read_text(encoding="utf-8").splitlines()
    head = lines.index("endheader")
    values = np.array([line.split() for line in lines[head + 2 :]], dtype=float)
    of_opensim = dict(zip((name.removesuffix("_moment") for name in lines[head + 1].split()), values.T, strict=True))
    moments = read_storage(Path("joint_moments.sto"), texts["joint_moments.sto"])
    np.testing.assert_allclose(of_opensim["time"], moments.values[:, 0], atol=1e-9)
    for name, difference in differences(moments, of_opensim).items():
        assert difference < 0.3, name  # as from the files by hand
