"""The cache: equal content has the same key everywhere, other content has another key, and no entry is half written."""

import os
import pickle
import subprocess
import sys
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from limited import run_limited

from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.model.faults import GpsJump
from sssi_exudyn.model.model import Start
from sssi_exudyn.recording.recording import Equipment, Skier
from sssi_exudyn.runtime.cache import Cache, fingerprint


@dataclass(frozen=True)
class Inner:
    mu: float
    names: tuple[str, ...]


@dataclass(frozen=True)
class Outer:
    inner: Inner
    table: np.ndarray
    note: str | None = None


OUTER = Outer(Inner(0.1, ("a", "b")), np.arange(6.0).reshape(2, 3))


def test_equal_content_has_one_key() -> None:
    same = Outer(Inner(0.1, ("a", "b")), np.arange(6.0).reshape(2, 3))
    assert fingerprint(OUTER, {"b": 1, "a": 2}) == fingerprint(same, {"a": 2, "b": 1})
    # Memory order is no content.
    assert fingerprint(np.asfortranarray(OUTER.table)) == fingerprint(OUTER.table)


@pytest.mark.parametrize(
    "other",
    [
        replace(OUTER, inner=Inner(np.nextafter(0.1, 1.0), ("a", "b"))),
        replace(OUTER, inner=Inner(0.1, ("ab",))),
        replace(OUTER, table=np.arange(6.0)),
        replace(OUTER, table=np.arange(6).reshape(2, 3)),
        replace(OUTER, note=""),
    ],
    ids=["last bit", "joined names", "shape", "type", "empty note"],
)
def test_any_difference_is_another_key(other: Outer) -> None:
    assert fingerprint(other) != fingerprint(OUTER)


def test_neighbouring_parts_do_not_run_together() -> None:
    assert fingerprint("ab", "c") != fingerprint("a", "bc")
    assert fingerprint((1,), 2) != fingerprint((1, 2))
    assert len({fingerprint(value) for value in (1, 1.0, "1", b"1", True)}) == 5


def test_key_is_the_same_in_another_process() -> None:
    # Python's own hash of strings is not the same: each process salts it differently.
    script = "from sssi_exudyn.runtime.cache import fingerprint; print(fingerprint('friction', 0.1, {'b': (1, None)}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == fingerprint("friction", 0.1, {"b": (1, None)})


def test_keys_of_models_outlive_moves_of_their_modules() -> None:
    # Made when each of these classes stood in a module of another name; sweeps and fits begun then go on.
    parts = (Skier(70.0, 1.65, "female"), Equipment(), AnisotropicFriction(0.06, 0.55), Start(), GpsJump())
    assert fingerprint(*parts) == "4f2a8fb5ac9b736dfd238a8a46d43c3b517c9ff019369f4db92421d306b7649d"


@pytest.mark.parametrize("value", [lambda: 0, Path("here"), np.array([object()])], ids=["function", "path", "objects"])
def test_what_has_no_content_is_refused(value: object) -> None:
    with pytest.raises(TypeError, match="no content"):
        fingerprint(value)


def test_entries_come_back_bit_for_bit(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "made")
    arrays = {"x": np.array([0.1, np.nan, -0.0]), "n": np.array(3)}
    assert cache.get("k") is None
    cache.put("k", arrays)
    back = cache.get("k")
    assert back is not None
    assert {name: value.tobytes() for name, value in back.items()} == {k: v.tobytes() for k, v in arrays.items()}
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["k.npz"]


@pytest.mark.parametrize("keep", [0, 1, 40, -10], ids=["empty", "one byte", "head only", "tail lost"])
def test_a_torn_entry_is_computed_again(tmp_path: Path, keep: int) -> None:
    cache = Cache(tmp_path)
    cache.put("k", {"x": np.arange(1000.0)})
    path = tmp_path / "k.npz"
    path.write_bytes(path.read_bytes()[:keep])
    assert cache.get("k") is None
    cache.put("k", {"x": np.arange(2.0)})
    back = cache.get("k")
    assert back is not None
    np.testing.assert_array_equal(back["x"], [0.0, 1.0])


def _archive(path: Path, header: bytes, data: bytes, compression: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(path, "w", compression) as parts:
        parts.writestr("x.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data)


_HEADER = "{{'descr': '{}', 'fortran_order': False, 'shape': ({},), }}\n"
POISON: dict[str, tuple[str, int, bytes, int]] = {
    "promises more than it has": ("<f8", 10**12, b"12345678", zipfile.ZIP_STORED),
    "swells": ("<f8", 10**6, bytes(8 * 10**6), zipfile.ZIP_DEFLATED),
    "objects": ("|O", 1, pickle.dumps([1]), zipfile.ZIP_STORED),
    "code for a header": ("__import__('os')", 1, b"12345678", zipfile.ZIP_STORED),
}


@pytest.mark.parametrize("kind", POISON)
def test_poisoned_entries_are_computed_again(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sssi_exudyn.runtime.cache.MAX_ENTRY", 4 * 10**6)
    dtype, count, data, compression = POISON[kind]
    _archive(tmp_path / "key.npz", _HEADER.format(dtype, count).encode(), data, compression)
    outcome = run_limited(lambda: Cache(tmp_path).get("key"))
    assert (outcome.verdict, Cache(tmp_path).get("key")) == ("taken", None)
    kept = Cache(tmp_path).get_or_make("key", lambda: {"x": np.arange(3.0)}, {"x": (3,)})
    again = Cache(tmp_path).get("key")
    assert again is not None
    np.testing.assert_array_equal(kept["x"], again["x"])


def test_arrays_come_back_as_they_were_kept(tmp_path: Path) -> None:
    arrays = {
        "rows": np.arange(6.0).reshape(2, 3),
        "columns": np.asfortranarray(np.eye(3)[:, :2]),
        "word": np.array("a"),
        "none": np.zeros((0, 3)),
        "flags": np.array([True, False]),
    }
    Cache(tmp_path).put("key", arrays)
    back = Cache(tmp_path).get("key")
    assert back is not None
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)
        assert back[name].dtype == array.dtype
        assert back[name].flags.writeable


def test_entries_of_another_key_and_without_a_check_are_computed_again(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.put("one", {"x": np.arange(3.0)})
    (tmp_path / "one.npz").rename(tmp_path / "other.npz")
    assert cache.get("other") is None
    np.savez(tmp_path / "old.npz", x=np.arange(3.0))
    assert cache.get("old") is None


def test_a_pipe_is_no_entry(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "key.npz")
    assert Cache(tmp_path).get("key") is None
