"""The choice of one of Exudyn's two builds for a process."""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stdout
from importlib import import_module


def take_fast_build() -> None:
    """Take Exudyn's build without range checks, a tenth faster, for programs whose models are tested with the checks.

    It has no effect once Exudyn is imported, where ``sys.exudynFast`` has been set, and on processors without AVX2.
    Exudyn prints its choice; stdout is kept clean of that.
    """
    if "exudyn" in sys.modules or hasattr(sys, "exudynFast"):
        return
    sys.exudynFast = True  # type: ignore[attr-defined]
    with redirect_stdout(io.StringIO()):
        import_module("exudyn")
