"""The fast settings of the full model give the track and the forces of fine ones, on a plane and over a roll."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from bundled import bundled

from sssi_exudyn.contact.terms.terrain import TerrainBump
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import PRESETS, Model, Solver
from sssi_exudyn.model.toml import model_to_dict, read_model
from sssi_exudyn.simulation.full.run import simulate

SECONDS = 1.2


@pytest.mark.long(seconds=12)
@pytest.mark.parametrize("name", ["beginner", "intermediate"])
def test_fast_is_within_2_mm_and_1_newton_of_fine_steps_and_beams(name: str) -> None:
    recording, motion = bundled(name)
    model = model_of(recording, motion)
    if name == "intermediate":
        ahead = model.start.f + 6.0
        model = replace(model, terms=(*model.terms, TerrainBump(rise=0.3, f0=ahead, width=4.0)))
    stop = motion.start + SECONDS
    fast, fine = (
        simulate(replace(model, solver=solver), motion, stop=stop) for solver in (PRESETS["fast"], Solver(step=0.001))
    )
    assert fast.antenna is not None
    assert fine.antenna is not None

    def at(series: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(fast.time, fine.time, column) for column in series.T], axis=1)

    apart = np.linalg.norm(fast.antenna - at(fine.antenna), axis=1)
    assert apart.max() < 2e-3  # m, as promised for whole runs
    forces = (fast.sole_force - at(fine.sole_force))[1:]  # the start has no multipliers of its own
    assert np.sqrt(np.mean(forces**2)) < 1.0


def written(folder: Path, model: Model, **solver: object) -> Path:
    path = folder / "model.toml"
    path.write_text(tomli_w.dumps({**model_to_dict(model), "solver": solver}), encoding="utf-8")
    return path


def test_a_model_names_its_preset_and_what_differs_from_it(tmp_path: Path) -> None:
    recording, motion = bundled("beginner")
    model = model_of(recording, motion)
    assert read_model(written(tmp_path, model)).solver == PRESETS["paper"]
    assert read_model(written(tmp_path, model, preset="fast")).solver == PRESETS["fast"]
    own = read_model(written(tmp_path, model, preset="fast", elements=20)).solver
    assert own == replace(PRESETS["fast"], elements=20)
    with pytest.raises(InputError, match=r"\[solver\] preset.*'quick' is not known.*paper, fast"):
        read_model(written(tmp_path, model, preset="quick"))
