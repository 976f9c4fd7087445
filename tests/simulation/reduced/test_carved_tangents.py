"""Exact derivatives of runs on snow that edges cut, the groove's memory included, against differences of runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from bundled import bundled
from gliding import model, standing

from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.term import parameters
from sssi_exudyn.contact.terms.body_forces import UnexplainedForce
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import SWELLS, Wind
from sssi_exudyn.core.choices import HeadingMode
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.model.faults import LeverArm
from sssi_exudyn.model.from_recording import first_guess, model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.reduced.derivatives import TableChange, run_tangents, skier_mass_change
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.terrain.surface import surface_over
from sssi_exudyn.validation.capture_error import CaptureError, with_error

pytestmark = pytest.mark.long
INCLINATION = 15.0
SECONDS = 1.0
FIELDS = (
    "pelvis", "pelvis_velocity", "antenna", "com", "foot_load", "sole_force", "foot_friction", "edge_angle",
    "foot_forward", "snow_force", "snow_moment", "heading",
)  # fmt: skip
SMOOTH = 1e-5
"""Of a derivative's greatest value: what differences ahead and behind may differ by where no wall begins to yield and
no point touches down between their runs, and what the tangent may then differ by from their mean.  Newton's method
leaves 10⁻¹⁰ m of changes of 10⁻⁶ m and more, hence no less."""
KINKED = 0.05
"""The same everywhere else, of the greatest value too: a point of fifty does what its neighbour does not."""
STEPS = {"m": 1e-6, "m/s": 1e-6, "rad": 1e-7}
"""Of differences by the number's unit; for other units, and for the snow's numbers, 10⁻⁶ of the value, or of 0.1.  With
steps a hundred times as long some point yields in every second instant."""
WEAK = {
    **{f"wind.f_{i}": 2e-5 for i in range(1, 7)},
    "air.c_d": 4e-6,
    "air.c_l": 1e-4,
    "carving.density": 3e-2,
    "carving.yield_offset": 2e-9,
    "unexplained_force.t0": 1e-5,
    "unexplained_force.t1": 1e-5,
    "unexplained_force.rise": 1e-5,
    "unexplained_force.force_f": 2e-4,
    "unexplained_force.force_l": 2e-4,
    "unexplained_force.force_n": 2e-4,
    "wind.w_f": 1e-5,
    "wind.w_l": 1e-5,
}
"""Of numbers that change a run so little that Newton's tolerance would show."""


@cache
def everything() -> tuple[Model, Motion, Prepared]:
    """The start of a run with all that its derivatives may be taken by."""
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    assert recording.gps is not None
    start = first_guess(recording.gps, motion, paper.inclination, paper.fall_line_azimuth)
    f = start.f
    more = (
        Carving(mu=0.1),
        Wind(1.0, 2.0),
        SlopeChange(0.05, f + 3.0, 5.0),
        TerrainBump(0.1, f + 4.0, 4.0),
        UnexplainedForce(30.0, 20.0, -10.0, 0.4, 0.8, 0.1),
    )
    way = np.array([[start.f - 3.0, start.l - 6.0], [start.f + 20.0, start.l + 6.0]])
    level = surface_over(way, 4.0, 6.0)
    rough = np.random.default_rng(3).normal(0.0, 0.02, (1, *level.mean.shape))
    surface = replace(level, modes=rough, amounts=(0.5,))
    tried = replace(
        paper,
        terms=combine_terms(paper.terms, more),
        sensors=(LeverArm(0.1, -0.1, 0.05),),
        start=start,
        surface=surface,
    )
    return tried, motion, prepare(tried, motion, stop=motion.start + SECONDS, step=0.0025)


def stacked(run: ReducedRun) -> list[Array]:
    """(columns, n) of each kind."""
    return [np.moveaxis(getattr(run, name), 0, -1).reshape(-1, len(run.time)) for name in FIELDS]


def assert_derivatives(
    here_run: ReducedRun, slopes: ReducedRun, index: int, run_at: Callable[[float], ReducedRun], step: float
) -> None:
    """That the tangents are the differences where these are smooth, and near them where a kink is between the runs."""
    behind, here, ahead = (stacked(run) for run in (run_at(-step), here_run, run_at(step)))
    parts = list(zip(behind, here, ahead, strict=True))
    differences = [(c - a) / (2.0 * step) for a, _, c in parts]
    scales = [max(float(np.abs(part).max()), 1e-12) for part in differences]
    bends = [np.abs(a + c - 2.0 * b).max(axis=0) / step for a, b, c in parts]
    smooth = np.all([bend < SMOOTH * scale for bend, scale in zip(bends, scales, strict=True)], axis=0)
    assert smooth.sum() > 15, f"smooth are {smooth.sum()} of {len(smooth)} instants"
    for k, name in enumerate(FIELDS):
        field = getattr(slopes, name)[..., index]
        given = np.moveaxis(field, 0, -1).reshape(-1, field.shape[0])
        off = np.abs(given - differences[k]).max(axis=0) / scales[k]
        # in few steps Newton's method alternates between two branches: which of them the run took, no difference tells,
        # and the edge angles remember it for some steps more
        most = np.quantile(off[smooth], 0.9)
        assert most < 3.0 * SMOOTH, f"{name}: {most:.2g} where nothing yields"
        assert off.max() < KINKED, f"{name}: {off.max():.2g}"


@pytest.mark.parametrize("heading", ["replay", "track"])
def test_by_every_number_of_the_laws_the_start_and_the_surface(heading: HeadingMode) -> None:
    tried, motion, prepared = everything()
    # each swell of the wind acts within the run
    swells = {f"wind.{name}": 0.5 * (-1.0) ** i for i, name in enumerate(SWELLS)}
    swelling = {"wind.begin": motion.start, "wind.every": 0.2 * SECONDS, **swells}
    tried = tried.with_heading(heading).with_values(swelling)
    names = [f"{term.name}.{key}" for term in tried.terms for key in parameters(term)]
    names.remove("carving.eps")  # which at 10 m/s changes friction by 10⁻⁴, and that as its square
    for name in ("wind.begin", "wind.every"):  # no estimate seeks them, and differences by them are rounding
        names.remove(name)
    names += [f"start.{key}" for key in ("f", "l", "velocity_f", "velocity_l", "heading_offset")]
    names += ["lever_arm.forward", "lever_arm.up", "surface.mode_1"]
    run, slopes = run_tangents(tried, prepared, names)
    here = simulate_reduced(tried, prepared)
    assert (np.degrees(np.abs(run.heading[:, 0]).max()) > 1.0) == (heading == "track")
    for i, name in enumerate(names):
        value = tried.value(name)
        relative = 1e-6 * (abs(value) or 0.1)
        usual = relative if name.startswith("carving.") else STEPS.get(tried.about(name).unit, relative)
        step = WEAK.get(name, usual)

        def run_at(x: float, name: str = name, value: float = value) -> ReducedRun:
            return simulate_reduced(tried.with_values({name: value + x}), prepared)

        try:
            assert_derivatives(here, slopes, i, run_at, step)
        except AssertionError as error:
            raise AssertionError(f"{name}: {error}") from None


@pytest.mark.parametrize(
    ("kind", "heading"),
    [
        ("roll", "replay"),
        ("pitch", "replay"),
        ("yaw", "replay"),
        ("height", "replay"),
        ("roll", "track"),
        ("yaw", "free"),
    ],
)
def test_by_errors_of_the_feet(kind: str, heading: HeadingMode) -> None:
    tried, _, prepared = everything()
    tried = tried.with_heading(heading)
    errors = [CaptureError(kind, 0, None), CaptureError(kind, 1, (0.5, 0.3))]
    changes = [
        TableChange(partial(lambda error, tables, size: with_error(tables, error, size), error)) for error in errors
    ]
    here, slopes = simulate_reduced(tried, prepared), run_tangents(tried, prepared, (), changes)[1]
    for i, change in enumerate(changes):
        assert_derivatives(
            here, slopes, i, lambda x, change=change: simulate_reduced(tried, change.apply(prepared, x)), 1e-7
        )


@pytest.mark.parametrize("heading", ["replay", "free"])
def test_by_the_skiers_mass(heading: HeadingMode) -> None:
    tried, motion, prepared = everything()
    tried = tried.with_heading(heading)
    heavier = skier_mass_change(tried, motion, prepared)
    here, slopes = simulate_reduced(tried, prepared), run_tangents(tried, prepared, (), [heavier])[1]
    assert_derivatives(here, slopes, 0, lambda x: simulate_reduced(tried, heavier.apply(prepared, x)), 1e-4)


def test_long_runs_do_not_outgrow_their_derivatives() -> None:
    """Over a run of 15 s the tangents are what differences find over a hundredth of what is not known of a number: what
    yields on the way averages out.  With another friction a ski may be about to snap to its other edge, or not; then
    the runs part there, and differences find something else.
    """
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    assert recording.gps is not None
    start = first_guess(recording.gps, motion, paper.inclination, paper.fall_line_azimuth)
    tried = replace(paper, start=start, terms=combine_terms(paper.terms, (Carving(mu=0.1),)))
    prepared = prepare(tried, motion, step=0.0025)
    # they are 0.007 and 0.003 off
    numbers = (("carving.mu", 3e-4, 0.05), ("carving.strength", 1e3, 0.05))
    by_number = run_tangents(tried, prepared, [name for name, _, _ in numbers])[1].com[-1].T
    for slopes, (name, step, tolerance) in zip(by_number, numbers, strict=True):
        ends = [
            simulate_reduced(tried.with_values({name: tried.value(name) + x}), prepared).com[-1] for x in (step, -step)
        ]
        difference = (ends[0] - ends[1]) / (2.0 * step)
        assert np.linalg.norm(slopes - difference) < tolerance * np.linalg.norm(difference), name


def _way(_: Model, run: ReducedRun) -> Array:
    return run.com[-1, :1] - run.com[0, :1]


def test_derivatives_of_a_gliding_skier_are_those_of_its_formula() -> None:
    gliding = model((Carving(mu=0.05),), speed=8.0)
    prepared = prepare(gliding, standing(1.0), step=0.0025)

    heavier = skier_mass_change(gliding, standing(1.0), prepared)
    way, slopes = sensitivities(
        gliding, prepared, ["carving.mu", "start.velocity_f", "start.clock_offset"], _way, [heavier]
    )
    normal = GRAVITY * np.cos(np.radians(INCLINATION))
    assert way[0] == pytest.approx(8.0 + 0.5 * (GRAVITY * np.sin(np.radians(INCLINATION)) - 0.05 * normal), rel=5e-3)
    assert slopes[0, 0] == pytest.approx(-0.5 * normal, rel=0.02)  # the start's settling is in the rest
    assert slopes[0, 1] == pytest.approx(1.0, rel=0.01)
    assert slopes[0, 2] == 0.0  # a clock moves no skier
    assert abs(slopes[0, 3]) < 1e-3  # m/kg: without air a heavier skier glides as far
