"""Models, skis, benches, sweeps and muscles from others: every fault in their files gives one clear line."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import osim_example
import pytest
import tomli_w
from limited import run_limited
from tiny import TOML, Tiny

from sssi_exudyn.bodies.muscles.osim import read_osim
from sssi_exudyn.bodies.ski.bench_tests import read_measurements
from sssi_exudyn.bodies.ski.ski import read_ski, ski_to_table
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict, read_model
from sssi_exudyn.recording.inspection_plot import plot_inspection
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Equipment, Skier
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.sweeps.file import read_sweep

DOTS = ".".join(["a"] * 40_000)


def model_text() -> str:
    model = Model(
        name="run",
        skier=Skier(),
        equipment=Equipment(),
        ski=read_ski("slalom_165", "."),
        inclination=0.2,
        fall_line_azimuth=1.0,
    )
    return tomli_w.dumps(model_to_dict(model))


MODELS: dict[str, tuple[Callable[[str], str], str]] = {
    "dotted": (lambda t: f"{DOTS} = 1\n{t}", "too many parts"),
    "nested": (lambda t: "x = " + "[" * 300 + "]" * 300 + f"\n{t}", "more tables within tables"),
    "bottomless": (lambda t: "x = " + "[" * 50_000 + t, "not TOML"),
    "nan": (lambda t: t.replace("mass_kg = 75.0", "mass_kg = nan"), "not a number"),
    "slope nan": (lambda t: t.replace("inclination_deg = ", "inclination_deg = nan #"), "not a number"),
    "slope of a wall": (lambda t: t.replace("inclination_deg = ", "inclination_deg = 89 #"), "outside"),
    "huge": (lambda t: t.replace("mass_kg = 75.0", f"mass_kg = {'7' * 400}"), "too large"),
    "figured": (lambda t: t.replace("mass_kg = 75.0", f"mass_kg = {'7' * 5000}"), "not TOML"),
    "heading as text": (lambda t: t.replace("heading_offset_deg = 0.0", 'heading_offset_deg = "x"'), "not a number"),
    "heading missing": (
        lambda t: t.replace("heading_offset_deg = 0.0", ""),
        r"\[start\] heading_offset_deg: the key is missing; give it in degrees",
    ),
    "slope missing": (
        lambda t: t.replace("fall_line_azimuth_deg", "# fall_line_azimuth_deg"),
        r"\[slope\] fall_line_azimuth_deg: the key is missing; give it in degrees",
    ),
    "heading as a truth": (
        lambda t: t.replace("heading_offset_deg = 0.0", "heading_offset_deg = true"),
        "not a number",
    ),
    "mass missing": (lambda t: t.replace("mass_kg = 75.0", ""), r"mass: the number is missing; give it in kg"),
    "two skis": (lambda t: f"{t}\n[ski.a]\n[ski.b]\n", r"\[ski\]: 2 skis; keep exactly one"),
    "no ski": (lambda t: f"{t}\n[ski]\n", r"\[ski\]: 0 skis"),
    "a ski that is none": (lambda t: f"{t}\n[ski]\na = 1\n", r"\[a\]: is not a table"),
    "a ski without profiles": (lambda t: f"{t}\n[ski.a]\nmass_kg = 1.0\n", "is missing; add it"),
    "table of another name": (
        lambda t: f"{t}\n[[terms]]\nname = 'air'\n",
        r"toml: terms: unknown key; did you mean 'term'",
    ),
    "another format": (lambda t: t.replace("format = 1", "format = 2"), "2 is not known"),
    "mass without unit": (
        lambda t: t.replace("mass_kg = 75.0", "mass_kg = 75.0\nmass = 75.0"),
        "did you mean 'mass_kg'",
    ),
    "slope misspelt": (lambda t: t.replace("inclination_deg", "inclinaton_deg"), "did you mean 'inclination_deg'"),
    "start in radians": (
        lambda t: t.replace("[start]", "[start]\nheading_offset = 0.1"),
        "did you mean 'heading_offset_deg'",
    ),
    "solver misspelt": (lambda t: t.replace("spectral_radius", "spectral_radios"), "did you mean 'spectral_radius'"),
    "term misspelt": (lambda t: t.replace('"friction"', '"fricton"'), "did you mean 'friction'"),
    "number of a term misspelt": (lambda t: t.replace("mu_t =", "mu_tt ="), "did you mean 'mu_t'"),
    "sensor misspelt": (
        lambda t: t.replace("sensor = []", 'sensor = [{name = "gps_jumps"}]'),
        "did you mean 'gps_jump'",
    ),
    "unknown ski": (
        lambda t: t.replace("slalom_165", "slalom_166"),
        r"model.toml: \[equipment\] skis: .*use one of .*slalom_165",
    ),
    "terms as numbers": (lambda t: t.replace("term = [", "term = [1,"), "must be tables"),
    "sensor as text": (lambda t: t.replace("sensor = []", 'sensor = "gps"'), "must be tables"),
    "thousands of terms": (lambda t: t.replace("term = [", "term = [" + '{name = "air"},' * 2000), "more than any"),
    "sex": (lambda t: t.replace('sex = "male"', 'sex = "x"'), "anthropometric"),
    "skis as number": (lambda t: t.replace('skis = "slalom_165"', "skis = 3"), "not a text"),
    "skis lighter than the ski": (lambda t: t.replace("ski_mass_kg = 2.4", "ski_mass_kg = 0.9"), "less than"),
}


@pytest.mark.parametrize("fault", MODELS)
def test_a_hostile_model_is_one_clear_line(tmp_path: Path, fault: str) -> None:
    change, problem = MODELS[fault]
    whole = model_text()
    path = tmp_path / "model.toml"
    path.write_text(change(whole), encoding="utf-8")
    assert change(whole) != whole
    with pytest.raises(InputError, match=problem):
        read_model(path)


def test_a_model_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(model_text(), encoding="utf-8")
    assert tomli_w.dumps(model_to_dict(read_model(path))) == model_text()


def own_ski(mass: float = 1.9) -> dict[str, object]:
    return {"mine": ski_to_table(read_ski("slalom_165", ".")) | {"mass_kg": mass}}


@pytest.mark.parametrize("skis", ["mine.toml", "skis/mine.toml", "slalom_165"])
def test_a_model_holds_a_ski_that_is_not_the_catalogues(tmp_path: Path, skis: str) -> None:
    (tmp_path / "mine.toml").write_text(tomli_w.dumps(own_ski()), encoding="utf-8")
    ski = read_ski("mine.toml", tmp_path)
    equipment = Equipment(skis=skis)
    model = Model("run", Skier(), equipment, ski, inclination=0.2, fall_line_azimuth=1.0)
    path = tmp_path / "alone" / "model.toml"
    path.parent.mkdir()
    path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
    assert read_model(path).ski == ski
    assert read_model(path).equipment == equipment
    heavy = model_to_dict(model) | {"ski": own_ski(2.5)}
    path.write_text(tomli_w.dumps(heavy), encoding="utf-8")
    with pytest.raises(InputError, match=r"ski_mass_kg: 2.4 kg with the binding is less than 2.5 kg"):
        read_model(path)


def test_models_with_other_skis_have_other_keys(tmp_path: Path) -> None:
    models = []
    for mass in (1.9, 2.0):
        (tmp_path / "mine.toml").write_text(tomli_w.dumps(own_ski(mass)), encoding="utf-8")
        ski = read_ski("mine.toml", tmp_path)
        model = Model("run", Skier(), Equipment(skis="mine.toml"), ski, inclination=0.2, fall_line_azimuth=1.0)
        models.append(model_to_dict(model))
    assert fingerprint(models[0]) != fingerprint(models[1])  # else a fit would go on with the other ski's runs


@pytest.mark.parametrize("text", [f"{DOTS} = 1\n", f"[{DOTS}]\n", "x = " + "[" * 50_000, f"x = {'1' * 5000}\n"])
@pytest.mark.parametrize("kind", ["bench", "sweep", "ski"])
def test_every_toml_is_read_within_bounds(tmp_path: Path, kind: str, text: str) -> None:
    (tmp_path / f"{kind}.toml").write_text(text, encoding="utf-8")
    readers: dict[str, Callable[[], object]] = {
        "bench": lambda: read_measurements(tmp_path),
        "sweep": lambda: read_sweep(tmp_path / "sweep.toml"),
        "ski": lambda: read_ski("ski.toml", tmp_path),
    }
    outcome = run_limited(readers[kind])
    assert outcome.verdict == "refused", outcome


@pytest.mark.parametrize("kind", ["model", "sweep", "osim"])
def test_pipes_are_no_files(tmp_path: Path, kind: str) -> None:
    path = tmp_path / kind
    os.mkfifo(path)
    with pytest.raises(InputError, match="this is not a file"):
        {"model": read_model, "sweep": read_sweep, "osim": read_osim}[kind](path)


@pytest.mark.parametrize("shape", ["<!--{}-->", "<?x {}?>", '<a b="{}"/>'])
def test_markup_that_evades_a_search_for_long_tags(tmp_path: Path, shape: str) -> None:
    path = tmp_path / "model.osim"
    text = osim_example.version_3().replace("</Model>", shape.format(">a" * 4_000_000) + "</Model>")
    path.write_text(text, encoding="utf-8")
    outcome = run_limited(lambda: read_osim(path))
    assert outcome.verdict == "refused", outcome
    assert outcome.seconds < 5.0, outcome  # of computing: read again with every piece, 8 MB would take minutes


def test_a_ski_that_is_heavier_than_with_its_binding(tmp_path: Path) -> None:
    own = ski_to_table(read_ski("slalom_165", ".")) | {"mass_kg": 2.5}
    folder = Tiny(toml=TOML.replace('"slalom_165"', '"own.toml"')).write(tmp_path)
    (folder / "own.toml").write_text(tomli_w.dumps({"own": own}), encoding="utf-8")
    with pytest.raises(InputError, match=r"ski_mass_kg: 2.4 kg with the binding is less than 2.5 kg of 'own.toml'"):
        read_recording(folder)


def test_a_picture_is_not_drawn_over_a_folder(tmp_path: Path) -> None:
    recording = read_recording(Tiny().write(tmp_path / "run"))
    (tmp_path / "folder.png").mkdir()
    for out, problem in (("folder.png", "this is a folder"), ("picture", "no picture format")):
        with pytest.raises(InputError, match=problem):
            plot_inspection(recording, tmp_path / out)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.png", "run"]
