"""Memory of the program's own processes."""

from __future__ import annotations

import subprocess
import sys

import pytest

PAGES = 10 * 512
"""Of ten arrays of 2 MB, in pages of 4 kB."""
COUNT = """
import resource
import sys
import numpy as np
from sssi_exudyn.runtime.process_memory import prepare_memory

if sys.argv[1] == "prepared":
    prepare_memory()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    [np.ones(2**18) for _ in range(10)]
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def pages_had_from_the_system(how: str) -> int:
    """While ten arrays of 2 MB come and go, 20 times."""
    done = subprocess.run([sys.executable, "-c", COUNT, how], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the setting is of Linux' C library")
def test_freed_memory_serves_the_next_arrays() -> None:
    # their pages are had once; the system gives or takes some others, and larger pages count as one
    assert pages_had_from_the_system("prepared") < 1.2 * PAGES
