"""Every back end gives the reference's forces and the reference's runs, and simulating needs no compiler."""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gliding import model, standing
from random_states import forces_of, random_state
from term_examples import Everything, Ridge, UniformWind

from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.body_forces import PolePlant
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import SnowCompaction, SnowPatch
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.core.choices import BACKENDS, Backend
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces_kernel import LOAD
from sssi_exudyn.simulation.full.run import simulate

PUBLISHED = (HuntCrossley(), AnisotropicFriction())
REGISTERED = (
    *PUBLISHED,
    AirDrag(),
    Gust(w_f=-4.0, w_l=2.0, t0=-1.0, t1=1.0),
    SnowPatch(delta_mu_t=0.05, f0=-5.0, f1=5.0, delta_mu_n=-0.1),
    SnowCompaction(c=2e4, power=1.5),
    SlopeChange(delta=0.05, f0=0.1, width=2.0),
    TerrainBump(rise=-0.05, f0=-0.2, width=1.0),
    PolePlant(forward=20.0, up=10.0, t=0.25),
)
"""A term of every place, each at work in the states below."""
EXAMPLES = (*PUBLISHED, AirDrag(), UniformWind(w_f=3.0, w_n=1.0), Ridge(height_m=0.05, at=0.0), Everything())
"""All functions that a term may use, and laws of which some components are plain numbers."""
ABOVE = {"on the snow": -0.08, "in the air": 2.0}


@pytest.fixture(scope="module")
def parts() -> Parts:
    return Parts(model(PUBLISHED), standing(0.5, heading=0.4, pelvis_list=0.2, hip_adduction_l=0.2))


def hold_to_reference(parts: Parts, terms: Sequence[Term], backend: Backend, above: float) -> None:
    reference, other = (forces_of(parts, terms, kind) for kind in ("python", backend))
    for seed in range(3):
        q, v, at = random_state(parts, seed)
        q[2] += above
        expected = reference.evaluate(q, v, at)
        # 1e-12 of the largest force: the same operations, but for fused multiply-adds and the order of sums
        np.testing.assert_allclose(other.evaluate(q, v, at), expected, atol=1e-12 * np.abs(expected).max())
        for name in ("seen", "drag", "body"):
            given, same = getattr(other, name), getattr(reference, name)
            np.testing.assert_allclose(given, same, rtol=1e-9, atol=1e-12 * np.abs(same).max())
        assert (reference.seen[:, LOAD] > 0.0).all() == (above < 0.0)
        for side in range(2):
            place, frame = q[:3] + at.foot_place[side], at.foot_rotation[side]
            for given, same in zip(other.foot_axes(place, frame), reference.foot_axes(place, frame), strict=True):
                np.testing.assert_allclose(given, same, atol=1e-14)  # rounding of numbers below 3


@pytest.mark.parametrize("above", ABOVE.values(), ids=ABOVE)
@pytest.mark.parametrize("backend", [backend for backend in BACKENDS if backend != "python"])
@pytest.mark.long
def test_every_back_end_is_the_reference(parts: Parts, backend: Backend, above: float) -> None:
    hold_to_reference(parts, REGISTERED, backend, above)


@pytest.mark.parametrize("backend", [backend for backend in BACKENDS if backend != "python"])
@pytest.mark.long
def test_every_back_end_lets_legs_give(parts: Parts, backend: Backend) -> None:
    soft = Parts(parts.model.with_values({"legs.compliance": 4e-5}), parts.motion)
    hold_to_reference(soft, PUBLISHED, backend, ABOVE["on the snow"])


@pytest.mark.parametrize("above", ABOVE.values(), ids=ABOVE)
@pytest.mark.parametrize("backend", [backend for backend in BACKENDS if backend != "python"])
@pytest.mark.long
def test_every_back_end_takes_any_law(parts: Parts, backend: Backend, above: float) -> None:
    hold_to_reference(parts, EXAMPLES, backend, above)


@pytest.mark.parametrize("backend", ["numpy", "symbolic"])
def test_no_law_at_all(parts: Parts, backend: Backend) -> None:
    hold_to_reference(parts, (), backend, ABOVE["in the air"])


@pytest.mark.long
def test_the_jacobian_is_the_same_in_every_back_end(parts: Parts) -> None:
    q, v, at = random_state(parts, 0)
    matrices = []
    for backend in BACKENDS:
        forces = forces_of(parts, REGISTERED, backend)
        forces.evaluate(q, v, at)
        rows, columns, values = forces.triplets(q, v, at, 1.0, 50.0).T
        matrices.append(np.zeros((len(q), len(q))))
        np.add.at(matrices[-1], (rows.astype(int), columns.astype(int)), values)
    largest = np.abs(matrices[0]).max()
    for matrix in matrices[1:]:
        np.testing.assert_allclose(matrix, matrices[0], atol=1e-12 * largest)  # rounding


@pytest.mark.long
def test_a_run_is_the_same_with_every_back_end() -> None:
    ahead = (SlopeChange(delta=0.05, f0=0.7, width=0.5), TerrainBump(rise=0.01, f0=0.5, width=0.2))
    terms = (*(term for term in REGISTERED if term.kind != "terrain"), *ahead)
    start, motion = model(terms), standing(0.5, heading=0.1, pelvis_list=0.1)
    start = replace(start, solver=replace(start.solver, elements=20))  # fewer than usual, for speed
    runs = {backend: simulate(start, motion, stop=0.2, backend=backend) for backend in BACKENDS}
    reference = runs.pop("python")
    assert np.ptp(reference.foot_load, axis=0).min() > 50.0  # N; the contact is at work
    for backend, run in runs.items():
        # rounding of 1e-16 m, through 40 steps of a Newton's method that stops where differences of 1e-9 m are left
        np.testing.assert_allclose(run.pelvis, reference.pelvis, rtol=0.0, atol=1e-9)
        assert run.statistics["backend"] == ("compiled" if backend == "fastest" else backend)


RUN = """
import sys

if "missing" in sys.argv:
    sys.modules["numba"] = None
from dataclasses import replace

from gliding import model, standing

from sssi_exudyn.simulation.full.forces import choose_backend
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.simulation.full.run import simulate

start = model(PAPER_TERMS)
start = replace(start, solver=replace(start.solver, elements=10))  # as the test's own run
run = simulate(start, standing(0.5), stop=0.02)
print(run.statistics["backend"], repr(float(run.pelvis[-1, 2])))
try:
    choose_backend("compiled")
except InputError as error:
    print(error)
"""


@pytest.mark.parametrize("ailment", ["missing", "broken"])
@pytest.mark.long
def test_without_numba_the_arrays_take_over(tmp_path: Path, ailment: str) -> None:
    path = list(sys.path)
    if ailment == "broken":
        (tmp_path / "numba").mkdir()
        (tmp_path / "numba" / "__init__.py").write_text("raise OSError('no libLLVM')", encoding="utf-8")
        path.insert(0, str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-c", RUN, ailment],
        env=os.environ | {"SSSI_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(path)},
        check=True,
        capture_output=True,
        text=True,
    )
    first, second = done.stdout.splitlines()
    backend, height = first.split()
    assert backend == "numpy"
    start = model()
    start = replace(start, solver=replace(start.solver, elements=10))  # few, as the Jacobian is interpreted
    run = simulate(start, standing(0.5), stop=0.02)
    assert float(height) == pytest.approx(float(run.pelvis[-1, 2]), abs=1e-9)  # rounding, through four steps
    assert "Numba does not work" in second
