"""A surface written next to a model is read back bit for bit; a file that is no surface is refused with one line."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from gliding import model

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.files import sha256
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict, read_model
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.terrain.file import FILE, surface_bytes
from sssi_exudyn.terrain.surface import Surface


def on_hill() -> Model:
    rng = np.random.default_rng(1)
    surface = Surface(
        (-3.0, 2.5), 2.0, rng.normal(size=(6, 5)), np.ones((6, 5)), rng.normal(size=(2, 6, 5)), (0.0, -1.5)
    )
    return replace(model(), surface=surface)


def written(folder: Path) -> Path:
    hill = on_hill()
    assert hill.surface is not None
    (folder / FILE).write_bytes(surface_bytes(hill.surface))
    path = folder / "model.toml"
    path.write_text(tomli_w.dumps(model_to_dict(hill)), encoding="utf-8")
    return path


def test_a_model_on_a_surface_is_read_back(tmp_path: Path) -> None:
    hill, again = on_hill(), read_model(written(tmp_path))
    assert hill.surface is not None
    assert again.surface is not None
    np.testing.assert_array_equal(again.surface.heights, hill.surface.heights)
    np.testing.assert_array_equal(again.surface.modes, hill.surface.modes)
    assert model_to_dict(again) == model_to_dict(hill)
    assert again.value("surface.mode_2") == -1.5


def test_another_surface_is_another_model() -> None:
    hill = on_hill()
    assert hill.surface is not None
    keys = {
        fingerprint(model_to_dict(variant))
        for variant in (
            hill,
            replace(hill, surface=None),
            hill.with_values({"surface.mode_1": 0.5}),
            replace(hill, surface=replace(hill.surface, mean=hill.surface.mean + 1e-9)),
        )
    }
    assert len(keys) == 4


def array_file(array: object, **options: bool) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.asarray(array), **options)
    return stream.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"no array",
        array_file(np.zeros((4, 6, 5)))[:-8],
        array_file(np.zeros((6, 5))),
        array_file(np.zeros((4, 1, 5))),
        array_file(np.zeros((4, 6, 5), dtype=np.float32)),
        array_file(np.full((4, 6, 5), np.nan)),
        array_file(np.full((4, 6, 5), 1e9)),
        array_file(np.array([{}], dtype=object), allow_pickle=True),
        array_file(np.zeros((4, 6, 5))).replace(b"(4, 6, 5)", b"(4, 9**9)"),
        array_file(np.zeros((4, 6, 5))).replace(b"(4, 6, 5)", b"(9999999,"),
    ],
)
def test_what_is_no_surface_is_refused(tmp_path: Path, content: bytes) -> None:
    path = written(tmp_path)
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(InputError, match=r"surface\.npy"):
        read_model(path)


def test_its_hash_is_that_of_the_file_or_as_older_models_have_it_of_the_numbers(tmp_path: Path) -> None:
    path, surface = written(tmp_path), on_hill().surface
    assert surface is not None
    text, of_file = path.read_text(), sha256(tmp_path / FILE).removeprefix("sha256:")
    assert of_file in text
    path.write_text(text.replace(of_file, surface.digest))
    assert read_model(path).surface is not None


def test_another_file_in_its_place_is_noticed(tmp_path: Path) -> None:
    path = written(tmp_path)
    (tmp_path / FILE).write_bytes(array_file(np.ones((4, 6, 5))))
    with pytest.raises(InputError, match="sha256"):
        read_model(path)


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("spacing_m = 0.0", "spacing_m"),
        ("spacing_m = true", "spacing_m"),
        ("origin_f_m = inf", "origin_f_m"),
        ('file = "../surface.npy"', "file"),
        ("amounts = [1.0]", "amounts"),
        ('amounts = ["a", 1.0]', "amounts"),
        ("colour = 1", "colour"),
    ],
)
def test_wrong_numbers_are_refused(tmp_path: Path, line: str, place: str) -> None:
    path = written(tmp_path)
    key = line.partition(" ")[0]
    lines = path.read_text(encoding="utf-8").split("\n")
    begin = lines.index("[surface]")
    end = len(lines)
    kept = [entry for entry in lines[begin:end] if not entry.startswith(f"{key} =")]
    if key == "amounts":  # an array over several lines
        kept = [entry for entry in kept if not entry.strip().startswith(("0.0", "-1.5", "]"))]
    path.write_text("\n".join([*lines[:begin], *kept, line, ""]), encoding="utf-8")
    with pytest.raises(InputError, match=rf"model\.toml.*{place}"):
        read_model(path)
