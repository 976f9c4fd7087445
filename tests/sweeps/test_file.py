"""A sweep's file: what it may state, what is refused, and the runs that it describes."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.sweeps.design import Axis, Design, points_of
from sssi_exudyn.sweeps.file import read_sweep, sweep_from
from sssi_exudyn.sweeps.parameters import Parameter, change, numbers_of, parameters_of
from sssi_exudyn.sweeps.plan import Plan, plan_sweep

EXAMPLES = Path(__file__).parents[2] / "examples"
MU_T = {"name": "friction.mu_t", "values": [0.05, 0.1]}
DRAWN = {"name": "skier.mass", "low": 60.0, "high": 80.0}
MASS = {"name": "skier.mass", "low": 60.0, "high": 80.0, "count": 3}


@pytest.fixture(scope="module")
def base() -> tuple[Recording, Motion, Model]:
    recording, motion = bundled("beginner")
    return recording, motion, model_of(recording, motion)


def plan_of(settings: Mapping[str, Any]) -> Plan:
    return plan_sweep(sweep_from({"format": 1, "recordings": ["beginner"], **settings}, EXAMPLES / "swept.toml"))


def test_examples_are_valid() -> None:
    for path in sorted(EXAMPLES.glob("sweep*.toml")):
        assert len(plan_sweep(read_sweep(path)).keys) > 1


def test_grid_goes_through_recordings_and_points_in_order() -> None:
    plan = plan_of({"recordings": ["beginner", "intermediate"], "parameter": [MU_T, MASS]})
    values = [(run.recording, *(value for _, value in run.values)) for run in plan.runs()]
    assert values == [(r, mu, mass) for r in (0, 1) for mu in (0.05, 0.1) for mass in (60.0, 70.0, 80.0)]
    assert len(set(plan.keys)) == 12


def test_keys_hang_on_inputs_alone() -> None:
    plain = plan_of({"parameter": [MU_T]})
    assert plan_of({"name": "another", "parameter": [MU_T]}).keys == plain.keys
    assert set(plan_of({"tier": "full", "parameter": [MU_T]}).keys).isdisjoint(plain.keys)
    assert set(plan_of({"duration_s": 2.0, "parameter": [MU_T]}).keys).isdisjoint(plain.keys)
    assert set(plan_of({"recordings": ["intermediate"], "parameter": [MU_T]}).keys).isdisjoint(plain.keys)


def test_a_heading_goes_with_snow_that_edges_cut() -> None:
    cut = {"term": [{"name": "carving"}], "parameter": [{"name": "carving.mu", "values": [0.1]}]}
    plain, free = plan_of(cut), plan_of({**cut, "heading": "free"})
    assert free.job.heading == "free"
    assert set(free.keys).isdisjoint(plain.keys)


def test_equal_points_are_run_once() -> None:
    plan = plan_of({"design": {"kind": "list"}, "parameter": [{"name": "friction.mu_t", "values": [0.1, 0.05, 0.1]}]})
    assert len(plan.keys) == 3
    assert [run.row for run in plan.runs()] == [0, 1]


@pytest.mark.parametrize(
    ("settings", "place", "part"),
    [
        ({"parameter": [{"name": "friction.mu_x", "values": [0.1]}]}, "[[parameter]] 1 name", "friction.mu_"),
        ({"parameter": [{"name": "snow.mu_t", "values": [0.1]}]}, "[[parameter]] 1 name", "friction"),
        ({"parameter": [MASS, {"name": "friction.mu_t", "values": [0.1, 1.5]}]}, "[[parameter]] 2 values", "0.99"),
        ({"parameter": [{"name": "skier.mass", "low": 60.0, "high": 900.0, "count": 2}]}, "[[parameter]] 1 high", "kg"),
        ({"parameter": [{"name": "skier.mass", "low": 60.0, "high": 70.0}]}, "[[parameter]] 1 count", "whole"),
        ({"parameter": [MU_T, MU_T]}, "[[parameter]] 2 name", "twice"),
        ({"parameter": [{"name": "solver.step", "values": [0.01]}]}, "[[parameter]] 1 name", "full"),
        ({"parameter": [{"name": "solver.elements", "values": [10.5]}]}, "[[parameter]] 1 values", "whole"),
        ({"parameter": [{"name": "equipment.skis", "values": ["barrel"]}]}, "[[parameter]] 1 values", "slalom_165"),
        ({"task": "fit", "parameter": [MU_T]}, "[[parameter]] 1 name", "fit"),
        ({"method": "paper", "parameter": [MU_T]}, "method", "fit"),
        ({"heading": "free", "parameter": [MU_T]}, "heading", "edges cut"),
        ({"heading": "loose", "parameter": [MU_T]}, "heading", "replay, track, free"),
        ({"task": "fit", "heading": "free"}, "heading", "captured heading"),
        ({"design": {"kind": "list"}, "parameter": [MU_T, {"name": "skier.mass", "values": [60.0]}]}, "values", "mass"),
        ({"design": {"kind": "sobol", "size": 100}, "parameter": [MASS]}, "[design] size", "128"),
        ({"design": {"kind": "sobol", "size": 8}, "parameter": [MU_T]}, "[[parameter]] 1 values", "unknown"),
        ({"design": {"kind": "spiral"}}, "[design] kind", "morris"),
        ({"design": {"kind": "morris", "size": 4}}, "[[parameter]]", "draw"),
        ({"recordings": ["missing"]}, "", "does not exist"),
        ({"recordings": ["x*"]}, "recordings", "x*"),
        ({"recordings": ["beginner\0"]}, "recordings", "printable"),
        ({"recordings": ["begin\nner"]}, "recordings", "printable"),
        ({"recordings": ["**x"]}, "recordings", "pattern"),
        ({"recordings": ["x" * 300]}, "recordings", "too long"),
        ({"recordings": ["*" + "x" * 5000]}, "recordings", "1000"),
        ({"model": "model\0.toml"}, "model", "printable"),
        ({"model": "x" * 5000}, "model", "1000"),
        ({"model": "x" * 300}, "", "name too long"),
        ({"recordings": ["["]}, "recordings", "matches"),
        ({"design": {"kind": "latin_hypercube", "size": 10_000_001}, "parameter": [DRAWN]}, "[design] size", "whole"),
        ({"design": {"kind": "sobol_indices", "size": 2**22}, "parameter": [DRAWN]}, "[[parameter]]", "points"),
        ({"outputs": ["beauty"]}, "outputs", "mean_speed_mps"),
        ({"duration_s": -1.0}, "duration_s", "seconds"),
        ({"term": [{"name": "magnet"}]}, "[[term]] 1", "wind"),
        ({"parameters": []}, "parameters", "parameter"),
    ],
)
def test_mistakes_are_reported_with_their_place_before_anything_runs(
    settings: dict[str, Any], place: str, part: str
) -> None:
    with pytest.raises(InputError) as error:
        plan_of(settings)
    assert place in error.value.place
    assert part in str(error.value)


@pytest.mark.parametrize("special", ["pipe", "/dev/zero", "folder"])
def test_what_is_no_regular_file_is_refused_at_once(special: str, tmp_path: Path) -> None:
    """Name them as the sweep's file and as its model: a pipe without a writer or a device would never end."""
    path = Path(special) if special.startswith("/") else tmp_path / special
    if special == "pipe":
        os.mkfifo(path)
    elif special == "folder":
        path.mkdir()
    with pytest.raises(InputError, match="file"):
        read_sweep(path)
    with pytest.raises(InputError, match="file"):
        plan_of({"model": str(path), "parameter": [MU_T]})


def test_copy_in_another_folder_is_the_same_sweep(tmp_path: Path) -> None:
    first = plan_of({"parameter": [MU_T]})
    again = plan_sweep(sweep_from(first.file.portable(tmp_path), tmp_path / "sweep.toml"))
    assert again.job.identity == first.job.identity


def axis(name: str, *values: float) -> Axis:
    return Axis(Parameter(name, "1", 0.0, 10.0, ""), values)


@pytest.mark.parametrize(
    ("kind", "count"), [("latin_hypercube", 8), ("sobol", 8), ("sobol_indices", 8 * 6), ("morris", 8 * 3)]
)
def test_drawn_designs_lie_within_their_bounds_and_repeat_with_their_seed(kind: Any, count: int) -> None:
    axes = [axis("a", 1.0, 2.0), axis("b", 4.0, 8.0)]
    points = points_of(Design(kind, 8, 3), axes)
    assert len(points) == count
    assert points == points_of(Design(kind, 8, 3), axes)
    assert points != points_of(Design(kind, 8, 4), axes)
    table = np.array(points, dtype=float)
    assert np.all(table >= [1.0, 4.0])
    assert np.all(table <= [2.0, 8.0])
    # more than a half of each range: the points spread over it
    assert np.all(np.ptp(table, axis=0) > [0.5, 2.0])


def test_latin_hypercube_has_one_point_in_every_row() -> None:
    points = np.array(points_of(Design("latin_hypercube", 10, 0), [axis("a", 0.0, 1.0), axis("b", 0.0, 1.0)]), float)
    for column in points.T:
        assert sorted(np.floor(10 * column)) == list(range(10))


def _content(parts: tuple[object, ...]) -> str:
    """Return the parts with all that they hold, which their own texts leave out."""
    return repr([vars(part) for part in parts])


@pytest.mark.long
def test_every_declared_number_can_be_changed(base: tuple[Recording, Motion, Model]) -> None:
    recording, motion, model = base
    untouched = _content(change(recording, motion, None, (), {}))
    for name, parameter in parameters_of(model.terms).items():
        middle = 0.5 * (parameter.low + parameter.high)
        value = 20.0 if parameter.whole else middle + 0.01 * (parameter.high - parameter.low)
        if name == "ski.boot_centre":  # the bounds' middle is ahead of a short ski
            value = 0.7
        ((key, number),) = numbers_of({name: value}).items()
        assert number == pytest.approx(value * parameter.factor)
        part = key.partition(".")[0]
        if part in ("skier", "equipment", "slope", "ski", "solver", "posture"):
            changed = change(recording, motion, None, (), {key: number})
            assert _content(changed) != untouched or not np.array_equal(changed[1].coefficients, motion.coefficients)
        else:
            assert model.with_values({key: float(number)}).value(key) == pytest.approx(float(number))


def test_posture_offset_turns_one_joint_by_a_constant(base: tuple[Recording, Motion, Model]) -> None:
    recording, motion, _ = base
    _, moved, _ = change(recording, motion, None, (), numbers_of({"posture.knee_angle_r_deg": 5.0}))
    time = np.linspace(motion.start, motion.stop, 50)
    angles, rates, accelerations = (
        after - before for after, before in zip(moved.evaluate(time), motion.evaluate(time), strict=True)
    )
    expected = np.zeros(len(PRESCRIBED))
    expected[PRESCRIBED.index("knee_angle_r")] = np.radians(5.0)
    # rounding of splines of angles up to π, of their derivatives at knots 1/60 s apart
    assert np.allclose(angles, expected, atol=1e-12)
    assert np.allclose(rates, 0.0, atol=1e-9)
    assert np.allclose(accelerations, 0.0, atol=1e-7)


def test_shape_changes_what_hangs_on_it(base: tuple[Recording, Motion, Model]) -> None:
    recording, motion, model = base
    shape = {"slope.inclination": model.inclination + 0.05, "ski.width_scale": 1.2, "skier.mass": 90.0}
    recorded, turned, heavier = change(recording, motion, None, (), shape)
    assert turned.inclination == heavier.inclination == model.inclination + 0.05
    assert heavier.start != model.start  # the same fixes lie elsewhere on another slope
    assert heavier.skier.mass == recorded.skier.mass == 90.0
    assert np.allclose(heavier.ski.width([0.5]), 1.2 * model.ski.width([0.5]))
    # a model that is given keeps its start
    kept_start = change(recording, motion, replace(model, name="given"), (), shape)[2]
    assert kept_start.start == model.start
    assert kept_start.inclination == heavier.inclination
    with pytest.raises(ValueError, match="boot centre"):
        change(recording, motion, None, (), {"ski.boot_centre": 1.9})
