"""A cache of compiled terms for these tests alone."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module")  # whatever the worker tests next shall find the kernels of all
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    patch = pytest.MonkeyPatch()
    patch.setenv("SSSI_CACHE_DIR", str(tmp_path_factory.mktemp("compiled")))
    yield
    patch.undo()
