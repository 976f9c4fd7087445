"""The user's own folder: its secret is the same in every process of the user, and no other user has it."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from sssi_exudyn.runtime.private_folder import cache_folder, secret


def test_a_folder_that_cannot_be_is_replaced_by_one_for_this_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert cache_folder().is_dir()
    assert cache_folder() == cache_folder()


def test_a_folder_for_this_process_goes_with_it(tmp_path: Path) -> None:
    for name in ("shared", "temporary"):
        (tmp_path / name).mkdir()
    (tmp_path / "shared").chmod(0o777)
    program = "from sssi_exudyn.runtime.private_folder import cache_folder as f; (f() / 'kept').mkdir(); print(f())"
    environment = os.environ | {"SSSI_CACHE_DIR": str(tmp_path / "shared"), "TMPDIR": str(tmp_path / "temporary")}
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, env=environment)
    assert Path(done.stdout.strip()).parent == tmp_path / "temporary"
    assert list((tmp_path / "temporary").iterdir()) == []


def test_every_process_of_the_user_has_the_same_secret(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path))
    script = "from sssi_exudyn.runtime.private_folder import secret; print(secret().hex())"
    other = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert other.stdout.strip() == secret().hex()
    (kept,) = tmp_path.iterdir()
    assert kept.read_bytes() == secret()
    assert len(secret()) == 32
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600


def test_another_user_has_another_secret(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path / "one"))
    script = "from sssi_exudyn.runtime.private_folder import secret; print(secret().hex())"
    other = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path / "other"))
    assert secret().hex() != other.stdout.strip()


@pytest.mark.parametrize("kept", [b"", b"short", b"x" * 33])
def test_a_damaged_secret_is_not_used(tmp_path: Path, kept: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path))
    (tmp_path / "secret").write_bytes(kept)
    assert secret() == secret() != kept
    assert len(secret()) == 32
