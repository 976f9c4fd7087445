"""Before any test: is this checkout whole, and are the force laws compiled?  Long tests come first."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from no_plots import without_plots

# a busy machine is slow to draw examples and to run them: no test is timed
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

PACKAGE = Path(__file__).parents[1] / "sssi_exudyn"
COMPILE = Path(__file__).parent / "support" / "models" / "compile_kernels.py"


def pytest_configure(config: pytest.Config) -> None:
    """Stop with one line where the package's links to the model folders are missing or no links; a source distribution,
    which holds none, gets them.  A worker has one core, as others have the rest: threads of its own would only repeat
    what passes over a run share.
    """
    if hasattr(config, "workerinput"):
        os.cpu_count = lambda: 1
    if not (PACKAGE.parent / ".git").exists():
        for name in ("bodies", "contact", "fitting", "validation"):
            if not (PACKAGE / name).exists():
                (PACKAGE / name).symlink_to(Path("..") / name, target_is_directory=True)
    broken = [name for name in ("bodies", "contact", "fitting", "validation") if not (PACKAGE / name).is_dir()]
    if broken:
        raise pytest.UsageError(
            f"sssi_exudyn/{', sssi_exudyn/'.join(broken)}: a symbolic link to the folder of that name is missing; "
            "check out again with: git config core.symlinks true && git checkout -- sssi_exudyn"
        )


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the force laws that most tests use, once, before several workers would each do it.

    Numba keeps them on disk, so that this takes a minute and a half of computing once and nothing after that.
    """
    if not hasattr(session.config, "workerinput") and session.config.getoption("numprocesses", None):
        kernels = ("carved", "others")
        processes = [subprocess.Popen([sys.executable, str(COMPILE), what]) for what in kernels]
        statuses = [process.wait() for process in processes]  # of all, before the first may end the session
        if any(statuses):
            raise pytest.UsageError(f"the force laws cannot be compiled; see: python {COMPILE} carved")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files with long tests first, those with the longest before all others, so that no worker begins a long test
    when the others have finished.  Tests of a file stay together, since they share what is made for them.
    """
    seconds: dict[Path, float] = {}
    for item in items:
        mark = item.get_closest_marker("long")
        own = float(mark.kwargs.get("seconds", 3.0)) if mark else 0.0
        seconds[item.path] = max(seconds.get(item.path, 0.0), own)
    items.sort(key=lambda item: seconds[item.path], reverse=True)


def pytest_collection_finish() -> None:
    """Have memory treated as in the program's own processes, and the garbage collector leave out what lives until the
    end: it took an eighth of the computing of tests that draw plots or read sources.
    """
    from sssi_exudyn.runtime.process_memory import prepare_memory  # here: as below

    prepare_memory()
    gc.collect()
    gc.freeze()


@pytest.fixture
def coarse_skis() -> Iterator[None]:
    """Compute skis in less detail during the test."""
    from coarse_skis import in_less_detail  # here: the package may lack its links until the session is configured

    with in_less_detail():
        yield


@pytest.fixture
def words_only() -> Iterator[None]:
    """Leave the plots of reports empty during the test."""
    with without_plots():
        yield
