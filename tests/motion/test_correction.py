"""A correction of the posture: added to the angles, kept in a file, refused where the file is another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from a_run import a_run
from bundled import bundled

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.files import sha256
from sssi_exudyn.model.toml import model_files, model_to_dict, read_model
from sssi_exudyn.motion.correction import PostureCorrection, correct_posture
from sssi_exudyn.motion.correction_file import FILE, correction_bytes

KNEE = PRESCRIBED.index("knee_angle_l")


def correction() -> PostureCorrection:
    """Return a correction of the left knee by up to 2°, swelling over two seconds."""
    time = np.linspace(0.0, 6.0, 61)
    angles = np.zeros((61, len(PRESCRIBED)))
    angles[:, KNEE] = np.radians(2.0) * np.sin(np.pi * time / 2.0) ** 2
    return PostureCorrection(time, angles)


def test_the_angles_are_added() -> None:
    _, motion = bundled("beginner")
    time = np.linspace(1.0, 5.0, 200)
    before, after = motion.evaluate(time)[0], correct_posture(motion, correction()).evaluate(time)[0]
    # The motion's knots are 1/60 s apart, the correction's period 2 s: (π/60)²/2 ~ 1e-3 of it.
    np.testing.assert_allclose(after - before, correction().at(time), atol=2e-3 * np.radians(2.0))
    assert correct_posture(motion, None) is motion


def test_beyond_its_ends_it_stays() -> None:
    angles = correction().at(np.array([-1.0, 7.0]))
    np.testing.assert_allclose(angles, correction().angles[[0, -1]], atol=1e-12)


def test_its_size_by_coordinate() -> None:
    assert correction().rms() == pytest.approx({"knee_angle_l": np.radians(2.0) * np.sqrt(3.0 / 8.0)}, rel=0.02)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write a model with a correction."""
    model = replace(a_run().model, posture=correction())
    (tmp_path / "model.toml").write_text(tomli_w.dumps(model_to_dict(model)))
    for name, content in model_files(model).items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def test_a_model_keeps_it(folder: Path) -> None:
    posture = read_model(folder / "model.toml").posture
    assert posture is not None
    np.testing.assert_array_equal(posture.angles, correction().angles)
    assert posture.digest == correction().digest


def test_its_hash_is_that_of_the_file_or_as_older_models_have_it_of_the_numbers(folder: Path) -> None:
    path, of_file = folder / "model.toml", sha256(folder / FILE).removeprefix("sha256:")
    text = path.read_text()
    assert of_file in text
    path.write_text(text.replace(of_file, correction().digest))
    assert read_model(path).posture is not None


def test_another_file_is_refused(folder: Path) -> None:
    other = PostureCorrection(correction().time, 2.0 * correction().angles)
    (folder / FILE).write_bytes(correction_bytes(other))
    with pytest.raises(InputError, match="not the correction that the model was written with"):
        read_model(folder / "model.toml")


@pytest.mark.parametrize(
    ("time", "angle", "message"),
    [
        ([0.0], 0.0, "fewer than two instants"),
        ([0.0, 0.0, 1.0], 0.0, "time does not rise"),
        ([0.0, 1.0, 2.0], np.nan, "not a number"),
        ([0.0, 1.0, 2.0], 57.3, "corrected by more than"),
    ],
)
def test_a_file_that_is_no_correction_is_refused(folder: Path, time: list[float], angle: float, message: str) -> None:
    angles = np.zeros((len(time), len(PRESCRIBED)))
    angles[-1, KNEE] = angle
    (folder / FILE).write_bytes(correction_bytes(PostureCorrection(np.array(time), angles)))
    with pytest.raises(InputError, match=message) as caught:
        read_model(folder / "model.toml")
    assert FILE in str(caught.value)


def test_a_missing_file_is_refused(folder: Path) -> None:
    (folder / FILE).unlink()
    with pytest.raises(InputError, match=FILE):
        read_model(folder / "model.toml")
