"""Skis computed in less detail than the program does, for tests that are not about where a ski bears and vibrates."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from sssi_exudyn.bodies.ski.mesh import BeamMesh, mesh
from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.model.model import PRESETS

CONTACTS, MODES = 20, 6


def coarse_mesh(ski: Ski, elements: int, contacts: int, *, cutting: bool) -> BeamMesh:
    """Cut a ski into as few elements as ``fast`` settings do; where its edges do not cut they have few points, too."""
    few = min(elements, PRESETS["fast"].elements)
    return mesh(ski, few, contacts if cutting else CONTACTS, cutting=cutting)


@contextmanager
def in_less_detail() -> Iterator[None]:
    """Have skis touch the snow at 20 points of every edge instead of 50, in the world that makes a recording as in the
    models that explain it, and vibrate in 6 modes instead of 12 in the reduced model.

    Its runs and their derivatives take a third of the time, and those of the full model half.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sssi_exudyn.simulation.assembly.mesh", coarse_mesh)
        for modes in ("MODES", "COARSE_MODES"):
            patch.setattr(f"sssi_exudyn.simulation.reduced.prepared.{modes}", MODES)
        yield
