"""Skis as data: profiles by hand, the catalogue, and ski files with the errors that they may hold."""

import pickle
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.ski import Profile, catalogue, read_ski, ski_from_table, ski_to_table, uniform_ski
from sssi_exudyn.core.errors import InputError

ROUNDING = 1e-12  # relative; a few products of doubles


@pytest.fixture(name="slalom")
def _slalom():
    return read_ski("slalom_165", "nowhere")


def test_slalom_widths_by_hand(slalom) -> None:
    # w = 0.066 + (w_end - 0.066)(2q - 1)^2, q = (s - 0.04)/0.89: at s = 0.2 q = 0.16/0.89, 2q - 1 = -0.57/0.89
    behind = 0.066 + 0.034 * (0.57 / 0.89) ** 2
    ahead = 0.066 + 0.051 * (0.63 / 0.89) ** 2  # s = 0.8: 2q - 1 = 0.63/0.89
    widths = slalom.width([0.0, 0.02, 0.04, 0.2, 0.485, 0.8, 0.93, 0.965, 1.0])
    expected = [0.085, 0.0925, 0.100, behind, 0.066, ahead, 0.117, 0.1035, 0.090]
    assert widths == pytest.approx(expected, rel=ROUNDING)


def test_slalom_thickness_by_hand(slalom) -> None:
    expected = np.array([7.0, 7.75, 8.5, 11.75, 18.0, 17.25, 12.5, 6.0]) * 1e-3
    assert slalom.thickness([0.0, 0.06, 0.12, 0.235, 0.5, 0.56, 0.735, 1.0]) == pytest.approx(expected, rel=ROUNDING)


def test_slalom_running_surface_by_hand(slalom) -> None:
    camber_at_middle = 0.004 * (1.0 - (0.03 / 0.89) ** 2)  # s = 0.5: 2q - 1 = 0.03/0.89
    expected = [0.012, 0.003, 0.0, 0.004, camber_at_middle, 0.0, 0.0125, 0.050]
    heights = slalom.height([0.0, 0.02, 0.04, 0.485, 0.5, 0.93, 0.965, 1.0])
    assert heights == pytest.approx(expected, rel=ROUNDING, abs=1e-15)


def test_slalom_stiffness_by_hand(slalom) -> None:
    # At the boot centre, the middle of the skier's ski, EI is the reference's 235 N m² to its three digits.
    assert slalom.bending_stiffness(slalom.s_of_x(0.0)) == pytest.approx(235.0, abs=0.5)
    assert slalom.bending_stiffness(0.485) == pytest.approx(8.37e9 * 0.066 * 0.0177**3 / 12, rel=ROUNDING)
    assert slalom.torsional_stiffness(0.0) == pytest.approx(2.31e9 * 0.085 * 0.007**3 / 3, rel=ROUNDING)


def test_slalom_mass_is_spread_as_width_times_thickness(slalom) -> None:
    x = np.linspace(0.0, 1.65, 200_001)
    density = slalom.mass_per_length(x / 1.65)
    # The trapezoidal rule with steps of 8 µm is right to 1e-9 here.
    assert np.trapezoid(density, x) == pytest.approx(1.75, rel=1e-8)
    ratio = density / (slalom.width(x / 1.65) * slalom.thickness(x / 1.65))
    assert np.ptp(ratio) < ROUNDING * ratio.mean()


def test_places_along_the_ski(slalom) -> None:
    assert slalom.s_of_x(0.0) == pytest.approx(0.76 / 1.65, rel=ROUNDING)
    assert slalom.x_of_s([0.0, 1.0]) == pytest.approx([-0.76, 0.89], rel=ROUNDING)


def test_slope_of_a_profile_is_its_derivative_and_the_mean_at_a_kink() -> None:
    profile = Profile((0.0, 0.3, 0.6, 1.0), (0.0, 3.0, 1.0, 2.0), ("linear", "flat_at_end", "flat_at_start"))
    s = np.array([0.1, 0.4, 0.55, 0.8])
    step = 1e-6
    numeric = (profile(s + step) - profile(s - step)) / (2 * step)
    assert profile.slope(s) == pytest.approx(numeric, rel=1e-8)  # central differences of parabolas: rounding alone
    assert profile.slope(0.3) == pytest.approx(0.5 * (10.0 - 2 * 2.0 / 0.3), rel=ROUNDING)
    assert profile.slope(0.6) == pytest.approx(0.0, abs=1e-12)
    assert profile(np.zeros((2, 3))).shape == (2, 3)


@pytest.mark.parametrize("name", catalogue())
def test_every_ski_of_the_catalogue_is_a_ski(name: str) -> None:
    ski = read_ski(name, "nowhere")
    s = np.linspace(0.0, 1.0, 1001)
    waist = s[200 + np.argmin(ski.width(s[200:800]))]
    assert 0.4 < waist < 0.6
    assert ski.width(waist) < min(ski.width(s).max(), ski.width(s[:300]).max())
    assert ski.thickness(0.5) > ski.thickness(0.0)
    assert ski.height(1.0) > ski.height(0.5) > 0.0
    assert len(ski.source) > 20
    assert pickle.loads(pickle.dumps(ski)) == ski


@pytest.mark.parametrize("name", catalogue())
def test_a_ski_survives_its_own_file(name: str, tmp_path: Path) -> None:
    ski = read_ski(name, "nowhere")
    (tmp_path / "mine.toml").write_text(tomli_w.dumps({name: ski_to_table(ski)}))
    assert read_ski("mine.toml", tmp_path) == ski


@pytest.mark.parametrize("elements", [10, 50])
def test_mesh_has_the_mass_and_the_edges_of_the_ski(slalom, elements: int) -> None:
    cut = mesh(slalom, elements)
    assert cut.element_mass.sum() == pytest.approx(1.75, rel=ROUNDING)
    assert cut.node_position[cut.clamped, 0] == pytest.approx(0.0, abs=1e-12)  # where the binding holds it
    points = cut.contact_positions(cut.node_position, cut.node_rotation)
    s = (np.arange(50) + 0.5) / 50
    left = np.stack([slalom.x_of_s(s), 0.5 * slalom.width(s), slalom.height(s)], axis=1)
    assert points[:, 0] == pytest.approx(left, abs=1e-14)
    assert points[:, 1] == pytest.approx(left * [1, -1, 1], abs=1e-14)
    assert cut.contact_length.sum() == pytest.approx(1.65, rel=ROUNDING)


def test_contact_points_follow_a_rigid_motion(slalom) -> None:
    cut = mesh(slalom, 20)
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    shift = np.array([3.0, -2.0, 1.0])
    still = cut.contact_positions(cut.node_position, cut.node_rotation)
    moved = cut.contact_positions(cut.node_position @ turn.T + shift, turn @ cut.node_rotation)
    assert moved == pytest.approx(still @ turn.T + shift, abs=1e-14)


def test_uniform_mesh_by_hand() -> None:
    bar = uniform_ski("bar", length=2.0, width=0.1, thickness=0.01, young_modulus=1e10, mass=4.0, shear_modulus=3e9)
    cut = mesh(bar, 4)
    area, shear = 1e-3, 13.0 / 15.3 / 2.6 * 1e10 * 1e-3
    row = [1e10 * area, shear, shear, 3e9 * 0.1 * 1e-6 / 3, 1e10 * 0.1 * 1e-6 / 12, 1e10 * 0.01 * 1e-3 / 12]
    assert cut.stiffness == pytest.approx(np.tile(row, (4, 1)), rel=ROUNDING)
    inertia = np.array([0.1**2 + 0.01**2, 0.01**2, 0.1**2]) * 2.0 / 12
    assert cut.section_inertia == pytest.approx(np.tile(inertia, (4, 1)), rel=ROUNDING)
    assert cut.element_length == pytest.approx([0.5] * 4, rel=ROUNDING)


@pytest.mark.parametrize("elements", [0, 1])
def test_mesh_needs_a_node_to_clamp(slalom, elements: int) -> None:
    with pytest.raises(ValueError, match="at least 2"):
        mesh(slalom, elements)


def _spoiled(table: dict, path: str, value: object) -> dict:
    *parents, last = path.split(".")
    inner = table
    for key in parents:
        inner = inner[key]
    inner[last] = value
    return table


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("mass_kg", "heavy", "mass"),
        ("mass_kg", float("nan"), "mass"),
        ("length_m", 165.0, "length"),
        ("boot_centre_m", 1.9, "boot_centre"),
        ("colour", "red", "unknown key"),
        ("width.mm", [0.085, 0.1, 0.066, 0.117, 0.09], "numbers from 20 to 300"),
        ("width.s", [0.0, 0.5, 0.4, 0.93, 1.0], "rise strictly"),
        ("width.s", "none", "list of numbers"),
        ("width.between", "wavy", "between"),
        ("width.between", 3, "between"),
        ("width.between", ["linear"], "4 words"),
        ("width", 66, "profile"),
        ("height.s", [0.0, 1.0], "2 points"),
    ],
)
def test_a_wrong_ski_gets_one_clear_line(slalom, path: str, value: object, says: str) -> None:
    table = _spoiled(ski_to_table(slalom), path, value)
    with pytest.raises(InputError, match=says) as caught:
        ski_from_table("mine", table, "mine.toml")
    assert str(caught.value).startswith("mine.toml: [mine")
    assert "\n" not in str(caught.value)


def test_a_missing_number_is_named(slalom) -> None:
    table = ski_to_table(slalom)
    del table["mass_kg"]
    with pytest.raises(InputError, match="mass_kg is missing"):
        ski_from_table("mine", table, "mine.toml")
    with pytest.raises(InputError, match="not a table"):
        ski_from_table("mine", 3, "mine.toml")


def test_a_wrong_name_or_file_gets_one_clear_line(slalom, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no ski is called 'slalom'.*slalom_165"):
        read_ski("slalom", tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        read_ski("missing.toml", tmp_path)
    (tmp_path / "run").mkdir()
    (tmp_path / "ski.toml").write_text(tomli_w.dumps({"mine": ski_to_table(slalom)}))
    with pytest.raises(InputError, match="out of the recording"):
        read_ski("../ski.toml", tmp_path / "run")
    (tmp_path / "two.toml").write_text(tomli_w.dumps({name: ski_to_table(slalom) for name in "ab"}))
    with pytest.raises(InputError, match="2 skis"):
        read_ski("two.toml", tmp_path)
    (tmp_path / "text.toml").write_text("a ski of wood")
    with pytest.raises(InputError, match="not TOML"):
        read_ski("text.toml", tmp_path)
