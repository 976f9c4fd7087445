"""Figures of technique against synthetic runs whose figures are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flat_snow import flat_snow
from gliding import model, standing

from sssi_exudyn.analysis.biomechanics import (
    WHOLE,
    Biomechanics,
    biomechanics,
    label_turns,
    residual_moment,
    technique,
    turn_figures,
)
from sssi_exudyn.bodies.skier.chain import COORDINATE, COORDINATES, PRESCRIBED, average_geometry, forward_kinematics
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL, read_storage
from sssi_exudyn.results.opensim import coordinates, markers_text, opensim_texts
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.result import SimulationResult

PARTS = Parts(model(), standing(1.0))
"""A skier with 15 degrees of slope, for files that need lengths and masses."""
MASS = 80.0
SPEED = 8.0
TURN = 2.0
WEDGE, SLIP = np.radians(10.0), np.radians(6.0)
STANCE, LEAN = 0.30, np.radians(35.0)
LATE_LOAD, LATE_POSTURE = 0.25, 0.10
OUTSIDE = 0.7
"""The skis are STANCE apart in a wedge and slip by SLIP; the skier leans up to LEAN and shifts the load too late."""


def skier() -> SimulationResult:
    """Return five linked turns with sine-shaped course, left first, at constant speed."""
    time = np.arange(0.0, 5.0 * TURN, 0.005)
    n = len(time)
    course = -np.radians(35.0) * np.cos(np.pi * time / TURN)
    tangent = np.stack([np.cos(course), np.sin(course), 0.0 * course], axis=1)
    aside = np.stack([-np.sin(course), np.cos(course), 0.0 * course], axis=1)
    ground = np.cumsum(tangent, axis=0) * SPEED * 0.005
    lean = LEAN * np.sin(np.pi * time / TURN)
    height = 0.9
    feet = np.stack([ground + 0.5 * STANCE * aside, ground - 0.5 * STANCE * aside], axis=1)
    inwards = np.sin(np.pi * (time - LATE_LOAD) / TURN)  # left turn: the right ski is the outside one
    right = 0.5 + (OUTSIDE - 0.5) * np.clip(3.0 * inwards, -1.0, 1.0)
    share = np.stack([1.0 - right, right], axis=1)
    middle = np.einsum("ns,nsk->nk", share, feet)
    com = middle + height * (np.tan(lean)[:, None] * aside + np.array([0.0, 0.0, 1.0]))
    ski_course = course[:, None] + SLIP + np.array([-0.5, 0.5]) * WEDGE
    forward = np.stack([np.cos(ski_course), np.sin(ski_course), np.zeros((n, 2))], axis=-1)
    angles = np.zeros((n, len(COORDINATES)))
    swing = np.radians(20.0) * np.sin(np.pi * (time - LATE_POSTURE) / TURN)
    angles[:, COORDINATE["hip_flexion_l"]] = np.radians(40.0) + swing
    angles[:, COORDINATE["hip_flexion_r"]] = np.radians(40.0) - swing
    moments = np.zeros((n, len(PRESCRIBED)))
    moments[:, PRESCRIBED.index("knee_angle_l")] = -100.0
    moments[:, PRESCRIBED.index("knee_angle_r")] = -160.0
    moments[:, PRESCRIBED.index("pelvis_list")] = 30.0
    moments[:, PRESCRIBED.index("pelvis_tilt")] = 40.0
    none = np.zeros((n, 3))
    return SimulationResult(
        coordinate_names=COORDINATES,
        moment_names=PRESCRIBED,
        time=time,
        pelvis=com,
        pelvis_velocity=SPEED * tangent,
        com=com,
        com_velocity=SPEED * tangent,
        antenna=None,
        coordinates=angles,
        foot_load=1.2 * MASS * GRAVITY * share,
        sole_force=np.zeros((n, 2)),
        foot_friction=np.zeros((n, 2, 3)),
        foot_position=feet,
        foot_velocity=np.repeat(SPEED * tangent[:, None], 2, axis=1),
        foot_forward=forward,
        snow=flat_snow(1.2 * MASS * GRAVITY * share, np.zeros((n, 2, 3))),
        edge_angle=np.radians([-20.0, -30.0]) * np.ones((n, 1)),
        penetration=np.zeros((n, 2)),
        drag=none,
        joint_moments=moments,
        ski_deflection=np.zeros((n, 2, 2)),
        energy={"friction": -500.0 * time},
        energy_closure=np.zeros(n),
        statistics={},
    )


@pytest.fixture(scope="module")
def run() -> SimulationResult:
    return skier()


@pytest.fixture(scope="module")
def turn_by_turn(run: SimulationResult) -> Biomechanics:
    return biomechanics(run, MASS, 0.0)


def of_ground(result: SimulationResult) -> SimulationResult:
    """Return the run with its centre of mass over its feet, so that its path is the one whose turns are known."""
    return replace(result, com=result.foot_position.mean(axis=1) + [0.0, 0.0, 0.9])


def test_technique_along_the_run(run: SimulationResult) -> None:
    series = technique(run)
    assert series.speed == pytest.approx(SPEED)
    assert series.ski_angle == pytest.approx(WEDGE)
    assert series.steering_angle[:, 0] == pytest.approx(SLIP - 0.5 * WEDGE)
    assert series.steering_angle[:, 1] == pytest.approx(SLIP + 0.5 * WEDGE)
    lean = LEAN * np.sin(np.pi * run.time / TURN)
    inner = slice(200, -200)  # the filter's ends
    # The share is filtered at 6 Hz, which rounds the corners of its clipped sine: 2 % of 0.3 m of stance at 0.9 m.
    assert series.inclination[inner] == pytest.approx(lean[inner], abs=np.radians(0.5))
    assert series.total_force == pytest.approx(1.2 * MASS * GRAVITY)


def test_a_wedge_is_positive_and_opened_tips_are_not(run: SimulationResult) -> None:
    assert np.all(technique(replace(run, foot_forward=run.foot_forward[:, ::-1])).ski_angle < 0.0)


def test_shifts_come_as_late_as_they_were_made(run: SimulationResult) -> None:
    rows = biomechanics(of_ground(run), MASS, 0.0).table
    whole_turns = rows[rows["phase"] == WHOLE]
    linked = whole_turns[whole_turns["turn"] > 1]
    assert np.isnan(whole_turns["load_shift_s"].iloc[0])  # the run begins with it: no transition is seen
    assert linked["load_shift_s"].to_numpy() == pytest.approx(LATE_LOAD, abs=0.03)  # turns are found on a 0.02 s grid
    assert linked["postural_shift_s"].to_numpy() == pytest.approx(LATE_POSTURE, abs=0.03)
    assert linked["load_shift_percent"].to_numpy()[:3] == pytest.approx(100.0 * LATE_LOAD / TURN, abs=2.0)


@pytest.mark.filterwarnings("error")
def test_a_foot_that_stands_has_no_steering_angle(run: SimulationResult) -> None:
    standing = run.foot_velocity.copy()
    standing[:, 0] = 0.0
    rows = biomechanics(replace(of_ground(run), foot_velocity=standing), MASS, 0.0).table
    whole = rows[rows["phase"] == WHOLE]
    left = np.where(
        whole["side"] == "left", whole["steering_angle_inside_mean_deg"], whole["steering_angle_outside_mean_deg"]
    )
    assert np.all(np.isnan(left))
    assert np.all(np.isfinite(whole["steering_angle_mean_deg"]))


def test_rows_know_outside_from_inside(run: SimulationResult) -> None:
    rows = biomechanics(of_ground(run), MASS, 0.0).table
    control = rows[rows["phase"] == "control"]
    # The share is on its plateau in the control phase but for the shift's delay at one end.
    assert control["outside_force_share"].to_numpy() == pytest.approx(OUTSIDE, abs=0.02)
    assert control["total_force_bodyweights"].to_numpy() == pytest.approx(1.2, rel=1e-6)
    assert control["snow_force_bodyweights"].to_numpy() == pytest.approx(1.2, rel=1e-6)
    left, right = (rows[(rows["side"] == side) & (rows["phase"] == WHOLE)] for side in ("left", "right"))
    assert left["knee_angle_outside_moment_min_Nm_per_kg"].to_numpy() == pytest.approx(-2.0)
    assert right["knee_angle_outside_moment_min_Nm_per_kg"].to_numpy() == pytest.approx(-1.25)
    assert left["edge_angle_outside_peak_deg"].to_numpy() == pytest.approx(30.0)
    assert right["edge_angle_outside_peak_deg"].to_numpy() == pytest.approx(20.0)
    assert rows["work_friction_J"].to_numpy() / rows["duration_s"].to_numpy() == pytest.approx(-500.0, rel=0.02)
    assert rows["power_friction_W"].to_numpy() == pytest.approx(-500.0)


def test_crossover(run: SimulationResult) -> None:
    rows = biomechanics(of_ground(run), MASS, 0.0).table
    assert np.all(rows["com_inside_one_share"] == 1.0)  # between the skis all the time
    leaning = biomechanics(run, MASS, 0.0).table
    control = leaning[leaning["phase"] == "control"]
    assert np.all(control["com_inside_both_share"] == 1.0)  # 0.6 m to the inside of feet 0.3 m apart


def test_figures_of_turns_are_the_mean_of_complete_turns(turn_by_turn: Biomechanics) -> None:
    figures = turn_figures(turn_by_turn)
    complete_turns = turn_by_turn.table[(turn_by_turn.table["phase"] == WHOLE) & turn_by_turn.table["complete"]]
    assert figures.complete == len(complete_turns) == sum(turn.complete for turn in turn_by_turn.turns.turns)
    assert figures.each is not None
    assert figures.peak_moments is not None
    assert figures.each["turn_radius_m"].mean == pytest.approx(complete_turns["turn_radius_m"].mean())
    assert figures.peak_moments["knee_angle_outside_moment_min_Nm_per_kg"] == pytest.approx(-2.0)


def test_a_run_without_turns_says_so(run: SimulationResult) -> None:
    straight = replace(run, com=run.com * [1.0, 0.0, 1.0])
    figures = turn_figures(biomechanics(straight, MASS, 0.0))
    assert figures.count == 0
    assert figures.each is None
    assert [stretch.kind for stretch in figures.stretches or ()] == ["traverse"]


def test_residual_moment_is_graded(run: SimulationResult) -> None:
    moment = residual_moment(run)
    assert moment.peak_Nm == pytest.approx(50.0)  # 30 and 40 N m about axes square to each other
    assert moment.verdict == "okay"  # 50 is good as a peak and too much as a mean square
    assert residual_moment(replace(run, joint_moments=0.5 * run.joint_moments)).verdict == "good"
    assert residual_moment(replace(run, joint_moments=2.0 * run.joint_moments)).verdict == "bad"
    stronger = np.where(np.arange(len(run.time)) == 7, 3.0, 1.0)[:, None] * run.joint_moments
    assert residual_moment(replace(run, joint_moments=stronger)).peak_at_s == run.time[7]


def test_series_carry_turn_and_phase(run: SimulationResult, turn_by_turn: Biomechanics) -> None:
    series = label_turns(run.to_frame(np.eye(3)), turn_by_turn.turns)
    for number, turn in enumerate(turn_by_turn.turns.turns, 1):
        rows = series[series["turn"] == number]
        assert rows["time_s"].min() == pytest.approx(turn.start, abs=0.006)
        assert set(rows["turn_side"]) == {turn.side}
        assert set(rows["turn_phase"]) == {"initiation", "control", "completion"}


def swung(run: SimulationResult) -> SimulationResult:
    """Replace all angles by sines of up to 40°."""
    rng = np.random.default_rng(4)
    amplitude, lag = rng.uniform(0.1, 0.7, len(COORDINATES)), rng.uniform(0.0, 6.0, len(COORDINATES))
    angles = amplitude * np.sin(run.time[:, None] + lag)
    angles[:, :3] = run.pelvis
    return replace(run, coordinates=angles)


def test_opensim_files_come_back(run: SimulationResult) -> None:
    moving = swung(run)
    for name, text in opensim_texts(moving, PARTS).items():
        if name.endswith((".mot", ".sto")):
            table = read_storage(Path(name), text)
            assert table.values[:, 0] == pytest.approx(run.time)
            assert table.in_degrees == (name == "coordinates.mot")


def test_the_pelvis_turns_the_same_in_opensims_order(run: SimulationResult) -> None:
    """Compare Rz(tilt) Rx(list) Ry(rotation), by plain matrices, with the chain's own pelvis."""
    moving, slope = swung(run), 0.27
    table = coordinates(moving, slope)
    tilt, list_, rotation = (
        np.radians(table.values[:, table.columns.index(f"pelvis_{name}")]) for name in ("tilt", "list", "rotation")
    )
    product = matrix(2, tilt) @ matrix(0, list_) @ matrix(1, rotation)
    poses = forward_kinematics(average_geometry(1.75), moving.coordinates, 0.0)  # the level frame's own
    own = GROUND_FROM_LEVEL @ poses.rotation[:, 0] @ GROUND_FROM_LEVEL.T
    assert product == pytest.approx(own, abs=1e-8)  # rounding of three turns


def matrix(axis: int, angle: Array) -> Array:
    """Return the matrices (n, 3, 3) of a turn about one axis."""
    turn = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[:, axis, axis] = 1.0
    turn[:, i, i] = turn[:, j, j] = np.cos(angle)
    turn[:, j, i] = np.sin(angle)
    turn[:, i, j] = -np.sin(angle)
    return turn


def test_markers_are_the_joint_centres(run: SimulationResult) -> None:
    text = markers_text(run, average_geometry(1.75), 0.0).splitlines()
    names = text[3].split("\t")[2::3]
    first = np.array(text[6].split("\t")[2:], dtype=float).reshape(-1, 3)
    assert text[2].split("\t")[2] == str(len(text) - 6)
    assert first.shape == (len([name for name in names if name]), 3)
    knee, ankle = first[names.index("tibia_r")], first[names.index("talus_r")]
    assert np.linalg.norm(knee - ankle) == pytest.approx(average_geometry(1.75).length("tibia_r"), abs=2e-6)
    assert knee[1] > ankle[1]  # y is up


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("endheader", "end", "endheader"),
        ("nRows=2000", "nRows=7", "nrows is 7"),
        ("\ntime\t", "\nclock\t", "first column"),
        ("\n0\t", "\n0\tx", "not a number"),
        ("\n0\t", "\n0\t1\t", "values where"),
    ],
)
def test_a_broken_table_is_named(run: SimulationResult, old: str, new: str, problem: str) -> None:
    text = opensim_texts(run, PARTS)["joint_moments.sto"]
    assert old in text
    with pytest.raises(InputError, match=problem):
        read_storage(Path("joint_moments.sto"), text.replace(old, new, 1))
