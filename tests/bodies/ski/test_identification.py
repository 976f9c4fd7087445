"""A ski identified from synthetic bench tests with noise."""

import csv
import dataclasses
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from sssi_exudyn.bodies.ski.bench_tests import Measurements, read_measurements
from sssi_exudyn.bodies.ski.identification import identify_ski
from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import frame_matrices, modal_ski
from sssi_exudyn.bodies.ski.ski import Ski, integrate_pieces, read_ski, ski_from_table, ski_to_table
from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError

TRUE = dataclasses.replace(read_ski("slalom_165", "nowhere"), shear_modulus=8.37e9 / 2.6)
LEFT, LOAD, RIGHT = 0.2, 0.5, 0.8  # of the length


@cache
def deflection_per_newton(ski: Ski) -> float:
    """Return the deflection in three-point bending on a fine linear frame, which identification does not use."""
    cut = mesh(dataclasses.replace(ski, height=dataclasses.replace(ski.height, value=(0.0,) * 5)), 400)
    stiffness, _ = frame_matrices(cut)
    node = {place: round(place * 400) for place in (LEFT, LOAD, RIGHT)}
    fixed = [6 * node[LEFT] + axis for axis in (0, 1, 2, 3, 5)] + [6 * node[RIGHT] + axis for axis in (1, 2)]
    free = np.delete(np.arange(len(stiffness)), fixed)
    force = np.zeros(len(stiffness))
    force[6 * node[LOAD] + 2] = 1.0
    return float(np.linalg.solve(stiffness[np.ix_(free, free)], force[free])[np.searchsorted(free, 6 * node[LOAD] + 2)])


MODES = modal_ski(mesh(TRUE), 2)
TIP = int(np.argmax(np.abs(MODES.shape[:, -1, 2])))


def measurements(random: np.random.Generator, noise: float = 1.0) -> Measurements:
    """Draw bench tests of TRUE with 0.2 mm of dial gauge, 1 % of the vibration's start, and calipers off by 0.05 mm."""
    place = np.linspace(0.0, 1.65, 331)
    s = place / 1.65
    thickness = TRUE.thickness(s) + noise * 5e-5 * random.standard_normal()
    force = np.tile(np.linspace(20.0, 200.0, 10), 3)
    time = np.arange(0.0, 1.5, 1e-3)
    zeta, omega = MODES.damping_ratio[TIP], 2 * np.pi * MODES.frequency[TIP]
    slow = np.exp(-zeta * omega * time) * np.cos(omega * np.sqrt(1 - zeta**2) * time)
    quick = 0.2 * np.exp(-0.22 * 330.0 * time) * np.cos(320.0 * time)  # the second bending, soon gone
    return Measurements(
        name="found",
        scan_place=place,
        width=TRUE.width(s),
        thickness=thickness,
        height=TRUE.height(s),
        force=force,
        deflection=0.001 + deflection_per_newton(TRUE) * force + noise * 2e-4 * random.standard_normal(len(force)),
        time=time,
        signal=3.0 + slow + quick + noise * 0.01 * random.standard_normal(len(time)),
        mass=1.75 + noise * 0.005 * random.standard_normal(),
        left=LEFT * 1.65,
        load=LOAD * 1.65,
        right=RIGHT * 1.65,
    )


def true_density() -> float:
    area = integrate_pieces(TRUE, np.array([0.0, 1.0]), lambda s: TRUE.width(s) * TRUE.thickness(s)).item()
    return 1.75 / (1.65 * area)


def test_without_noise_the_ski_comes_back() -> None:
    identified = identify_ski(measurements(np.random.default_rng(1), noise=0.0))
    # Straight lines between scan points 5 mm apart, and the frame's even sections of 4 mm: 1e-4 each.
    assert identified.young_modulus.value == pytest.approx(8.37e9, rel=5e-4)
    assert identified.density.value == pytest.approx(true_density(), rel=5e-4)
    # After three periods 1e-8 of the second bending is left in the signal.
    assert identified.ski.damping_ratio == pytest.approx(0.05, rel=1e-3)
    assert identified.predicted_frequency == pytest.approx(identified.frequency.value, rel=1e-3)


@pytest.mark.long
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    runs = 100
    random = np.random.default_rng(2)
    hits = {"density": 0, "young_modulus": 0, "damping_ratio": 0, "frequency": 0}
    truth = {
        "density": true_density(),
        "young_modulus": 8.37e9,
        "damping_ratio": MODES.damping_ratio[TIP],
        "frequency": MODES.frequency[TIP],
    }
    for _ in range(runs):
        identified = identify_ski(measurements(random))
        for name, value in truth.items():
            estimate = getattr(identified, name)
            hits[name] += estimate.low <= value <= estimate.high
    # 95 % intervals: the number of hits is binomial, 95 ± 2.2; three and a half of these, and 100 at most.
    for name, count in hits.items():
        assert 87 <= count <= 100, name


def test_wrong_calipers_are_in_the_interval_of_the_modulus() -> None:
    sharp = dataclasses.replace(measurements(np.random.default_rng(3)), thickness_sigma=0.0)
    blunt = dataclasses.replace(sharp, thickness_sigma=2e-4)
    narrow, wide = (identify_ski(m).young_modulus for m in (sharp, blunt))
    # E goes with 1/t³: 0.2 mm of some 15 mm are 4 % of E.
    assert wide.se > 3 * narrow.se
    assert wide.se / wide.value == pytest.approx(3 * 0.2 / 15.0, rel=0.3)


def write_folder(folder: Path, measured: Measurements) -> None:
    tables = {
        "scan.csv": {
            "from_tail_mm": 1e3 * measured.scan_place,
            "width_mm": 1e3 * measured.width,
            "thickness_mm": 1e3 * measured.thickness,
            "height_mm": 1e3 * measured.height,
        },
        "bending.csv": {"force_N": measured.force, "deflection_mm": 1e3 * measured.deflection},
        "vibration.csv": {"time_s": measured.time, "signal": measured.signal},
    }
    for name, columns in tables.items():
        with (folder / name).open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(columns)
            writer.writerows(zip(*columns.values(), strict=True))
    settings = {
        "name": "found",
        "mass_kg": measured.mass,
        "mass_sigma_kg": 0.005,
        "boot_centre_m": 0.76,
        "scan": {"file": "scan.csv", "thickness_sigma_mm": 0.05},
        "bending": {"file": "bending.csv", "left_m": measured.left, "load_m": measured.load, "right_m": measured.right},
        "vibration": {"file": "vibration.csv"},
    }
    (folder / "bench.toml").write_text(tomli_w.dumps(settings))


def test_a_folder_of_tests_becomes_a_ski_file(tmp_path: Path) -> None:
    measured = measurements(np.random.default_rng(4))
    write_folder(tmp_path, measured)
    by_file = identify_ski(read_measurements(tmp_path))
    direct = identify_ski(measured)
    assert by_file.young_modulus.value == pytest.approx(direct.young_modulus.value, rel=1e-9)  # decimal text and back
    again = ski_from_table("found", ski_to_table(by_file.ski), "found.toml")
    assert again.young_modulus == by_file.ski.young_modulus
    assert again.width(0.3) == pytest.approx(by_file.ski.width(0.3), rel=1e-9)


def test_the_command_leaves_a_ski_that_recordings_can_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench = tmp_path / "bench"
    bench.mkdir()
    write_folder(bench, measurements(np.random.default_rng(5)))
    with pytest.raises(SystemExit) as end:
        main(["ski", "identify", str(bench), "--out", str(tmp_path / "mine.toml"), "--json"])
    assert end.value.code == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["young_modulus"]["low"] < rows["young_modulus"]["value"] < rows["young_modulus"]["high"]
    ski = read_ski("mine.toml", tmp_path)
    assert ski.young_modulus == pytest.approx(rows["young_modulus"]["value"])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("mass_kg = ", "weight_kg = ", "mass_kg: is missing"),
        ("left_m = 0.33", "left_m = 1.0", "not in order"),
        ('file = "scan.csv"', 'file = "../scan.csv"', "out of"),
        ('file = "scan.csv"', 'file = "bending.csv"', "column from_tail_mm is missing"),
        ("[vibration]", "[vibrations]", "table is missing"),
        ("mass_sigma_kg = 0.005", 'mass_sigma_kg = "small"', "not a number"),
        ("boot_centre_m = 0.76", "boot_centre_m = 76", "outside"),
        ("[bending]", "[bending", "not TOML"),
    ],
)
def test_a_wrong_bench_gets_one_clear_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    write_folder(tmp_path, measurements(np.random.default_rng(5)))
    text = (tmp_path / "bench.toml").read_text()
    assert old in text
    (tmp_path / "bench.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=says):
        read_measurements(tmp_path)


def test_tests_that_show_nothing_are_refused() -> None:
    good = measurements(np.random.default_rng(6))
    with pytest.raises(InputError, match="does not grow"):
        identify_ski(dataclasses.replace(good, deflection=-good.deflection))
    with pytest.raises(InputError, match="too short"):
        identify_ski(dataclasses.replace(good, time=good.time[:300], signal=good.signal[:300]))
    noise = 0.01 * np.random.default_rng(7).standard_normal(len(good.time))
    steady = np.cos(2 * np.pi * 12.0 * good.time) + noise
    with pytest.raises(InputError, match="no decay"):
        identify_ski(dataclasses.replace(good, signal=steady))
