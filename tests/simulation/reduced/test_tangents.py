"""Exact derivatives of the reduced model's runs against differences of runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.term import parameters
from sssi_exudyn.contact.terms.body_forces import PolePlant, UnexplainedForce
from sssi_exudyn.contact.terms.friction_corrections import (
    EdgeDependentFriction,
    LoadDependentFriction,
    SnowCompaction,
    SnowPatch,
    SpeedDependentFriction,
    UnexplainedDrag,
    UnexplainedFriction,
)
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import DragArea, Gust, Wind
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.observations import insole_loads, predict_fixes
from sssi_exudyn.model.faults import (
    BootCuff,
    GpsJump,
    HeadingDrift,
    InsoleDelay,
    InsoleGain,
    InsoleOffset,
    LeverArm,
    insole_readings,
    values_of,
)
from sssi_exudyn.model.from_recording import first_guess, model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.reduced.derivatives import TableChange, host_of, run_tangents, skier_mass_change
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import responses_to_additions, sensitivities, simulate_each
from sssi_exudyn.terrain.surface import surface_over
from sssi_exudyn.validation.capture_error import CaptureError, with_error

SECONDS = 2.4
"""All that begins and ends in ``everything`` does so before."""
FIELDS = (
    "pelvis", "pelvis_velocity", "antenna", "com", "foot_load", "sole_force", "foot_friction", "edge_angle",
    "snow_force", "snow_moment",
)  # fmt: skip
STEPS = {"m": 3e-4, "s": 3e-4, "m/s": 3e-4, "rad": 3e-5, "rad/s": 3e-5}
"""Largest of the differences by the number's unit; for other units 3e-4 of the value.  With steps three times as long
the run's curvature leaves up to 4e-4 of a derivative, with these 2e-4."""
TOLERANCES = {"pelvis": 3e-4, "pelvis_velocity": 3e-4, "antenna": 3e-4, "com": 3e-4, "snow_moment": 1e-2}
"""Of a derivative's greatest value in the run, 3e-3 for forces and angles.  The differences are only as good: Newton's
method leaves 10⁻¹⁰ m of a change of some 10⁻⁶ m, and a point of the edge that touches down between two of the runs
bends the loads' course, most the moments', as tips are far from the foot.  A term that is left out of a derivative
would show by some per cent."""


@cache
def example() -> tuple[Model, Motion]:
    """The start of the beginner's run: a turn with one ski coming off the snow."""
    recording, motion = bundled("beginner")
    model = model_of(recording, motion)
    assert recording.gps is not None
    start = first_guess(recording.gps, motion, model.inclination, model.fall_line_azimuth)
    # exponents off the end of their range: differences go both ways
    return replace(model, start=start).with_values({"penetration.m2": 1.2, "start.heading_offset": 0.01}), motion


@cache
def everything() -> tuple[Model, Prepared]:
    """All laws and all faults of the instruments at once, none of them at its default."""
    model, motion = example()
    f = model.start.f
    terms = (
        *PAPER_TERMS,
        Wind(1.0, 2.0),
        Gust(3.0, 2.0, 0.5, 2.1, 0.7),
        DragArea(0.2),
        SnowPatch(0.05, f + 3.0, f + 8.0, 1.0),
        SpeedDependentFriction(0.005, 6.0),
        EdgeDependentFriction(0.05, 0.3),
        LoadDependentFriction(0.05),
        UnexplainedFriction(-0.02),
        UnexplainedDrag(3.0, 2.0, 1.1, 1.9, 0.1, -0.9),
        SnowCompaction(2e3, 1.01),  # from its lowest power there are differences on one side alone
        SlopeChange(0.05, f + 10.0, 5.0),
        TerrainBump(0.2, f + 6.0, 4.0),
        PolePlant(20.0, 10.0, 1.2, 0.1),
        UnexplainedForce(30.0, 20.0, -10.0, 1.0, 2.0, 0.1),
    )
    sensors = (
        GpsJump(0.3, -0.2, 1.03, 2.04, 0.6), HeadingDrift(0.02, 0.4), LeverArm(0.1, -0.1, 0.05), InsoleGain(0.1, -0.1),
        BootCuff(0.1), InsoleOffset(20.0, -10.0), InsoleDelay(0.0317),
    )  # fmt: skip
    model = replace(model, terms=terms, sensors=sensors).with_values({"penetration.m2": 1.2})
    return model, prepare(model, motion, stop=motion.start + SECONDS)


def richardson(run_at: Callable[[float], Array], step: float) -> Array:
    """Derivative at 0 by central differences with two steps, extrapolated: an error of the fourth order."""
    wide = (run_at(step) - run_at(-step)) / (2.0 * step)
    narrow = (run_at(0.5 * step) - run_at(-0.5 * step)) / step
    return np.asarray((4.0 * narrow - wide) / 3.0)


def step_of(model: Model, name: str) -> float:
    return STEPS.get(model.about(name).unit, 3e-4 * max(abs(model.value(name)), 0.1))


def stacked(run: ReducedRun) -> Array:
    """(columns, n) all that is compared of a run."""
    return np.concatenate([np.moveaxis(getattr(run, name), 0, -1).reshape(-1, len(run.time)) for name in FIELDS])


def stacked_slopes(slopes: ReducedRun, index: int) -> Array:
    parts = [getattr(slopes, name)[..., index] for name in FIELDS]
    return np.concatenate([np.moveaxis(part, 0, -1).reshape(-1, part.shape[0]) for part in parts])


def assert_equal_slopes(given: Array, expected: Array, what: str) -> None:
    """Row by row, each to its tolerance of the greatest of rows of its kind, which stand in threes or twos."""
    scale = np.max(np.abs(expected), axis=1)
    kinds = np.repeat(range(len(FIELDS)), (3, 3, 3, 3, 2, 2, 6, 2, 6, 6))
    for kind, name in enumerate(FIELDS):
        rows = kinds == kind
        allowed = TOLERANCES.get(name, 3e-3) * max(float(np.max(scale[rows])), 1e-9)
        worst = float(np.max(np.abs(given[rows] - expected[rows])))
        assert worst <= allowed, f"{what}: {name} differs by {worst:.3g} of {np.max(scale[rows]):.3g}"


@pytest.mark.long(seconds=17)
def test_by_every_number_of_every_law() -> None:
    model, prepared = everything()
    names = [f"{term.name}.{key}" for term in model.terms for key in parameters(term)]
    run, slopes = run_tangents(model, prepared, names)
    np.testing.assert_array_equal(run.antenna, simulate_reduced(model, prepared).antenna)
    for i, name in enumerate(names):
        expected = richardson(
            lambda x, name=name: stacked(simulate_reduced(model.with_values({name: model.value(name) + x}), prepared)),
            step_of(model, name),
        )
        assert_equal_slopes(stacked_slopes(slopes, i), expected, name)


@pytest.mark.long
def test_by_the_start_and_the_capture() -> None:
    model, prepared = everything()
    names = [f"start.{key}" for key in ("f", "l", "velocity_f", "velocity_l", "heading_offset", "clock_offset")]
    names += [
        f"{s.name}.{key}" for s in model.sensors if isinstance(s, HeadingDrift | LeverArm) for key in values_of(s)
    ]
    slopes = run_tangents(model, prepared, names)[1]
    for i, name in enumerate(names):
        expected = richardson(
            lambda x, name=name: stacked(simulate_reduced(model.with_values({name: model.value(name) + x}), prepared)),
            step_of(model, name),
        )
        assert_equal_slopes(stacked_slopes(slopes, i), expected, name)


@pytest.mark.parametrize("kind", ["roll", "pitch", "yaw", "height"])
@pytest.mark.long
def test_by_errors_of_the_feet_that_stay_or_wander(kind: str) -> None:
    model, prepared = everything()
    errors = [CaptureError(kind, 0, None), CaptureError(kind, 1, (1.2, 0.8))]
    changes = [
        TableChange(partial(lambda error, tables, size: with_error(tables, error, size), error)) for error in errors
    ]
    slopes = run_tangents(model, prepared, (), changes)[1]
    for i, change in enumerate(changes):
        expected = richardson(
            lambda x, change=change: stacked(simulate_reduced(model, change.apply(prepared, x))),
            # points a metre ahead of the foot touch down and lift off with every 10 µm; plain differences of the right
            # foot's roll are 3e-6 off the tangent at 1e-5, 1e-5 at 6e-6, and 1e-4 below 3e-6, where the run's own
            # tolerance shows
            6e-6,
        )
        assert_equal_slopes(stacked_slopes(slopes, i), expected, f"{kind} {i}")


@pytest.mark.long
def test_under_legs_that_give() -> None:
    model, prepared = everything()
    model = model.with_values({"legs.compliance": 4e-5, "legs.damping_ratio": 0.5})
    names = [
        "legs.compliance", "legs.damping_ratio", "friction.mu_t", "friction.mu_n", "friction.eps", "penetration.k",
        "penetration.c", "snow_patch.delta_mu_t", "edge_dependent_friction.b", "slope_change.delta", "start.velocity_f",
    ]  # fmt: skip
    error = CaptureError("roll", 1, (1.2, 0.8))
    change = TableChange(lambda tables, size: with_error(tables, error, size))
    slopes = run_tangents(model, prepared, names, [change])[1]
    steps = {"legs.compliance": 1e-7, "roll": 6e-6}  # of 4e-5 m/N

    def run_at(name: str, x: float) -> Array:
        if name == "roll":
            return stacked(simulate_reduced(model, change.apply(prepared, x)))
        return stacked(simulate_reduced(model.with_values({name: model.value(name) + x}), prepared))

    for i, name in enumerate([*names, "roll"]):
        step = steps[name] if name in steps else step_of(model, name)
        assert_equal_slopes(stacked_slopes(slopes, i), richardson(partial(run_at, name), step), name)


def test_by_the_skiers_mass() -> None:
    model, motion = example()
    stop = motion.start + SECONDS
    prepared = prepare(model, motion, stop=stop)
    slopes = run_tangents(model, prepared, (), [skier_mass_change(model, motion, prepared)])[1]

    def heavier(kilograms: float) -> Array:
        skier = replace(model.skier, mass=model.skier.mass + kilograms)
        changed = replace(model, skier=skier)
        return stacked(simulate_reduced(changed, prepare(changed, motion, stop=stop)))

    assert_equal_slopes(stacked_slopes(slopes, 0), richardson(heavier, 0.1), "mass")


@pytest.mark.long
def test_what_instruments_report() -> None:
    """By the numbers that only instruments know too, and beyond the run's ends, where the track is continued."""
    model, prepared = everything()
    fixes = np.arange(prepared.time[0] - 0.05, prepared.time[-1] + 0.1, 0.1) + 0.0031
    windows = np.arange(prepared.time[0] + 0.3, prepared.time[-1] - 0.3, 0.1) + 0.0031

    def observed(model: Model, run: ReducedRun) -> Array:
        readings = insole_loads(model, run.time, run.sole_force, windows)
        return np.concatenate([predict_fixes(model, run.time, run.antenna, fixes).ravel(), readings.ravel()])

    names = ["start.clock_offset", "friction.mu_t", "start.heading_offset", "start.height", "start.velocity_n"]
    names += [f"{s.name}.{key}" for s in model.sensors for key in values_of(s)]
    seen, slopes = sensitivities(model, prepared, names, observed)
    run = simulate_reduced(model, prepared)
    np.testing.assert_array_equal(seen, observed(model, run))
    unseen = [
        name
        for name in names
        if name.partition(".")[0] in ("gps_jump", "insole_gain", "boot_cuff", "insole_offset", "insole_delay")
    ]
    other = model.with_values({name: model.value(name) + step_of(model, name) for name in unseen})
    np.testing.assert_array_equal(stacked(simulate_reduced(other, prepared)), stacked(run))  # so one run serves them
    for i, name in enumerate(names):
        # a skier sinks by centimetres alone
        step = {"start.clock_offset": 1e-4, "start.height": 1e-6}.get(name) or step_of(model, name)

        def run_at(x: float, name: str = name) -> Array:
            changed = model.with_values({name: model.value(name) + x})
            return observed(changed, run if name in unseen else simulate_reduced(changed, prepared))

        expected = richardson(run_at, step)
        places = slice(0, 3 * len(fixes))
        for part, tolerance in ((places, TOLERANCES["antenna"]), (slice(places.stop, None), 3e-3)):
            # points that just touch the snow at rest are lifted from it: a difference has the mean of both sides
            tolerance = max(tolerance, 1e-3 if name == "start.height" else 0.0)
            allowed = tolerance * max(float(np.max(np.abs(expected[part]))), 1e-9)
            np.testing.assert_allclose(slopes[part, i], expected[part], atol=allowed, rtol=0.0, err_msg=name)


def test_runs_side_by_side_are_runs_one_by_one() -> None:
    model, prepared = everything()
    turned = model.with_values({"start.heading_offset": 0.03})
    models = [one.with_values({"friction.mu_t": mu}) for mu in (0.05, 0.08, 0.12) for one in (model, turned)]
    together = simulate_each(models, prepared, lambda _model, run: run.antenna)
    for one, antenna in zip(models, together, strict=True):
        np.testing.assert_array_equal(antenna, simulate_reduced(one, prepared).antenna)


def test_cores_change_no_derivative(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every core linearises the run for its share of the errors; on one core a single pass serves all of them."""
    model, motion = example()
    prepared = prepare(model, motion, stop=motion.start + 0.3)
    errors = [CaptureError("roll", k % 2, (0.005 * k, 0.1)) for k in range(60)]
    changes = [
        TableChange(partial(lambda error, tables, size: with_error(tables, error, size), error)) for error in errors
    ]
    slopes = []
    for cores in (1, 2):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        slopes.append(run_tangents(model, prepared, ["friction.mu_t"], changes)[1])
    for name in FIELDS:
        one, two = (getattr(of_cores, name) for of_cores in slopes)
        np.testing.assert_allclose(two, one, rtol=0.0, atol=1e-12 * np.abs(one).max(), err_msg=name)  # rounding


@pytest.mark.long
def test_a_second_term_of_a_law_needs_no_other_kernel() -> None:
    """Forces and heights add up: where it acts as the first does, its strength does what the first's does."""
    model, prepared = everything()
    strengths = {
        SnowPatch: ("delta_mu_t",), SpeedDependentFriction: ("b",), EdgeDependentFriction: ("b",),
        LoadDependentFriction: ("b",), UnexplainedFriction: ("delta_mu",),
        UnexplainedDrag: ("brake_t", "brake_n"), SnowCompaction: ("c",),
        TerrainBump: ("rise",),
        UnexplainedForce: ("force_n", "force_f", "force_l"), PolePlant: ("up", "forward"), DragArea: ("share",),
    }  # fmt: skip
    additions, names = [], []
    for first in model.terms:
        if keys := strengths.get(type(first), ()):
            second = replace(first, **dict.fromkeys(keys, 0.0))
            additions.append((replace(model, terms=(*model.terms, second)), f"{first.name}#2.{keys[0]}"))
            names.append(f"{first.name}.{keys[0]}")
    assert {len(host_of(addition).terms) for addition in additions} == {len(model.terms)}

    def observed(_model: Model, run: ReducedRun) -> Array:
        return stacked(run)

    expected = sensitivities(model, prepared, names, observed)[1]
    allowed = 1e-9 * np.max(np.abs(expected), axis=(0, 1))  # rounding
    assert np.all(np.abs(responses_to_additions(additions, prepared, observed) - expected) <= allowed)


@pytest.mark.long
def test_additions_share_a_pass_whatever_their_places_and_times() -> None:
    """Beside all other laws and on waves, each is what the derivative by its own number alone is."""
    model, prepared = everything()
    f = model.start.f
    plane = surface_over(np.array([[f - 5.0, model.start.l - 20.0], [f + 40.0, model.start.l + 20.0]]), 1.0, 20.0)
    waves = 0.03 * np.sin(0.5 * plane.nodes() @ [1.0, 0.4])
    surface = replace(plane, mean=waves.reshape(plane.mean.shape))
    kept = tuple(t for t in model.terms if not isinstance(t, Gust | SnowPatch | TerrainBump | PolePlant | DragArea))
    sensors = tuple(sensor for sensor in model.sensors if not isinstance(sensor, HeadingDrift | BootCuff))
    base = replace(model, terms=kept, sensors=sensors, surface=surface)
    parts = (
        *(Gust(0.0, 0.0, t, t + 0.6, 0.8) for t in (0.4, 1.1)),
        *(SnowPatch(0.0, f + x, f + x + 3.0, 0.5) for x in (1.0, 4.0)),
        *(TerrainBump(0.0, f + x, 2.0) for x in (3.0, 8.0)),
        *(PolePlant(0.0, 0.0, t) for t in (0.9, 1.7)),
        DragArea(0.0),
        HeadingDrift(0.0, 1.0),
        BootCuff(0.0),
    )
    keys = ("w_f", "w_l", "delta_mu_t", "rise", "forward", "up", "share", "rate")
    additions = []
    for part in parts:
        fault = isinstance(part, HeadingDrift | BootCuff)
        extended = replace(base, sensors=(*sensors, part)) if fault else replace(base, terms=(*kept, part))
        additions += [(extended, f"{part.name}.{key}") for key in keys if hasattr(part, key)]
    additions.append((base, "start.f"))

    def observed(model: Model, run: ReducedRun) -> Array:
        return np.concatenate([stacked(run)[:17].ravel(), insole_readings(model.sensors, run.sole_force).ravel()])

    together = responses_to_additions(additions, prepared, observed)
    for i, (extended, name) in enumerate(additions):
        alone = sensitivities(extended, prepared, [name], observed)[1][:, 0]
        np.testing.assert_allclose(together[:, i], alone, rtol=0.0, atol=1e-9 * np.max(np.abs(alone)), err_msg=name)
