"""Caches that someone else filled: results are computed again, and generated code is not run."""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from docs_script import module_from

from sssi_exudyn.contact.codegen.compiled import compile_kernel
from sssi_exudyn.runtime.cache import Cache, fingerprint
from sssi_exudyn.runtime.private_folder import cache_folder

KEY = fingerprint("a key")
SHAPES = {"time": (None,), "antenna": (None, 3)}


def right() -> dict[str, np.ndarray]:
    return {"time": np.arange(4.0), "antenna": np.ones((4, 3))}


def saved(**arrays: object) -> bytes:
    content = io.BytesIO()
    np.savez(content, **{name: np.asarray(value) for name, value in arrays.items()})
    return content.getvalue()


def bomb() -> bytes:
    """Return two gigabytes of zeros in two megabytes, announced as a tenth of that."""
    content = io.BytesIO()
    with (
        zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as parts,
        parts.open("time.npy", "w") as file,
    ):
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (30_000_000,)})
        for _ in range(240):
            file.write(bytes(1_000_000))
    return content.getvalue()


def header(text: str) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as parts:
        parts.writestr("time.npy", b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode())
    return content.getvalue()


OBJECTS = np.array([{"a": 1}], dtype=object)
ENTRIES: dict[str, bytes | Callable[[], bytes]] = {
    "plausible": saved(time=np.arange(4.0), antenna=np.zeros((4, 3))),
    "with a check": saved(time=np.arange(4.0), antenna=np.zeros((4, 3)), check=fingerprint(KEY, right())),
    "with a check that is a table": saved(**right(), check=np.zeros(4)),
    "objects": saved(time=OBJECTS, antenna=np.ones((4, 3))),
    "bytes": saved(time=np.zeros(4, "V8"), antenna=np.ones((4, 3)), check=""),
    "dates": saved(time=np.zeros(4, "M8[s]"), antenna=np.ones((4, 3)), check=""),
    "truncated": saved(**right())[:-30],
    "bomb": bomb,  # made when it is needed: the tests are collected by every worker
    "huge header": header("{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999,)}\n"),
    "negative lengths": header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -1)}\n"),
    "code": header("__import__('os').mkdir('pwned')\n"),
    "no archive": b"PK\x03\x04" + bytes(1000),
}
OTHERS: dict[str, dict[str, np.ndarray]] = {
    "wrong shape": {"time": np.arange(4.0), "antenna": np.ones((4, 2))},
    "a number for a table": {"time": np.arange(4.0), "antenna": np.array(1.0)},
    "another name": {"time": np.arange(4.0), "place": np.ones((4, 3))},
    "a name too many": {**right(), "more": np.array(1.0)},
    "NaN": {"time": np.arange(4.0), "antenna": np.full((4, 3), np.nan)},
    "infinite": {"time": np.full(4, np.inf), "antenna": np.ones((4, 3))},
}


@pytest.mark.parametrize("name", ENTRIES)
def test_a_poisoned_entry_is_made_again(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    entry = ENTRIES[name]
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache" / f"{KEY}.npz").write_bytes(entry() if callable(entry) else entry)
    check_made_again(Cache(tmp_path / "cache"))
    assert not (tmp_path / "pwned").exists()


@pytest.mark.parametrize("name", OTHERS)
def test_an_entry_with_other_arrays_is_made_again(tmp_path: Path, name: str) -> None:
    Cache(tmp_path).put(KEY, OTHERS[name])
    check_made_again(Cache(tmp_path))


def test_an_entry_of_another_user_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path / "another user"))
    Cache(tmp_path).put(KEY, {"time": np.arange(4.0), "antenna": np.zeros((4, 3))})
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path / "this user"))
    check_made_again(Cache(tmp_path))


def check_made_again(cache: Cache) -> None:
    """Check that the right arrays are made, and kept."""
    arrays = cache.get_or_make(KEY, right, SHAPES)
    np.testing.assert_array_equal(arrays["antenna"], np.ones((4, 3)))
    again = cache.get_or_make(KEY, lambda: pytest.fail("the right entry is kept"), SHAPES)
    np.testing.assert_array_equal(again["time"], arrays["time"])


def test_a_pipe_in_place_of_an_entry_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / f"{KEY}.npz")
    assert Cache(tmp_path).get(KEY) is None


def test_removing_a_cache_leaves_what_the_program_did_not_write(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "cache")
    cache.put(KEY, right())
    cache.remove()
    assert not cache.folder.exists()
    cache.put(KEY, right())
    half = cache.folder / f".{KEY}.npz.123"
    half.write_bytes(b"half")
    thesis = cache.folder / "thesis.tex"
    thesis.write_text("years", encoding="utf-8")
    within = cache.folder / "more"
    within.mkdir()
    (within / f"{KEY}.npz").write_bytes(b"")
    cache.remove()
    assert sorted(path.name for path in cache.folder.iterdir()) == ["more", "thesis.tex"]
    assert (within / f"{KEY}.npz").exists()


def test_removing_a_cache_follows_no_link(tmp_path: Path) -> None:
    elsewhere = Cache(tmp_path / "elsewhere")
    elsewhere.put(KEY, right())
    (tmp_path / "cache").symlink_to(elsewhere.folder)
    Cache(tmp_path / "cache").remove()
    assert elsewhere.get(KEY) is not None
    other = Cache(tmp_path / "other")
    other.folder.mkdir()
    (other.folder / f"{fingerprint('b')}.npz").symlink_to(elsewhere.folder / f"{KEY}.npz")
    other.remove()
    assert elsewhere.get(KEY) is not None


def test_generated_code_is_kept_in_a_folder_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "own"
    monkeypatch.setenv("SSSI_CACHE_DIR", str(own))
    assert cache_folder() == own
    assert stat.S_IMODE(own.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777, 0o702])
def test_a_folder_that_others_may_write_is_not_run_from(
    tmp_path: Path, mode: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(mode)
    monkeypatch.setenv("SSSI_CACHE_DIR", str(shared))
    assert cache_folder() not in (shared, tmp_path)
    assert stat.S_IMODE(cache_folder().stat().st_mode) == 0o700


def test_a_folder_of_another_user_or_behind_a_link_is_not_run_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = tmp_path / "own"
    own.mkdir(mode=0o700)
    (tmp_path / "link").symlink_to(own)
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path / "link"))
    assert cache_folder() != tmp_path / "link"
    monkeypatch.setenv("SSSI_CACHE_DIR", str(own))
    mine = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: mine + 1)
    assert cache_folder() != own


def template(path: Path) -> ModuleType:
    """Return a template of a kernel, a module with one number, written to ``path``."""
    path.write_text("number = 1\n", encoding="utf-8")
    return module_from(path)


def test_code_that_others_may_write_is_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    monkeypatch.setenv("SSSI_CACHE_DIR", str(shared))
    assert Path(str(compile_kernel(template(tmp_path / "first.py")).__file__)).is_relative_to(shared)
    shared.chmod(0o777)
    kernel = compile_kernel(template(tmp_path / "second.py"))
    assert not Path(str(kernel.__file__)).is_relative_to(shared)
    assert kernel.number == 1
