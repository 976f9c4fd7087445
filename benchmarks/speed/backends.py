"""Costs of one pass over all forces by back end, and the contact's part of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np
from naive import contact

from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.core.choices import BACKENDS, Backend
from sssi_exudyn.core.frames import Array, gravity_in_slope
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.full.forces import Forces
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.run import FullRun, integrate
from sssi_exudyn.simulation.ski_on_snow.structs import Carrier, Sections

PASSES: Final[dict[Backend, int]] = {"compiled": 1000, "numpy": 100, "symbolic": 100, "python": 5}
REPEATS: Final = 7


def microseconds(work: Callable[[], Any], count: int) -> float:
    """Return the microseconds of one call, the best of some repeats of ``count``: other processes only add to it."""
    walls = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        for _ in range(count):
            work()
        walls.append(time.perf_counter() - begin)
    return 1e6 * min(walls) / count


def forces_of(run: FullRun, sections: Sections, backend: Backend) -> Forces:
    """Return the forces of a run, with other sections and by another back end."""
    model, system = run.parts.model, run.system
    area = np.array(list(run.parts.areas.values()))
    carrier = Carrier(system.skeleton.sign, area, gravity_in_slope(model.inclination))
    return Forces(model.terms, sections, carrier, system.ref, backend)


def without_contact(sections: Sections) -> Sections:
    """Return the same ski with nothing that touches the snow."""
    none = {name: getattr(sections, name)[:0] for name in ("element", "share", "offset", "length")}
    return sections._replace(**none)


def backends(model: Model, motion: Motion) -> dict[str, Any]:
    """Return microseconds of a pass and of its contact a second into the run, ratios, and the largest difference.

    The contact's part is the pass less the same pass without points of contact; ``naive`` has no other part.
    """
    run, _ = integrate(model, motion, stop=motion.start + 1.0)
    q, v, now, sections = run.record.q[-1], run.record.v[-1], run.system.now, run.parts.sections
    all_forces: dict[str, float] = {}
    contact_part: dict[str, float] = {}
    forces: dict[str, Array] = {}
    for backend, count in PASSES.items():
        full, without_points = (forces_of(run, points, backend) for points in (sections, without_contact(sections)))
        forces[backend] = full.evaluate(q, v, now).copy()
        all_forces[backend] = microseconds(partial(full.evaluate, q, v, now), count)
        contact_part[backend] = all_forces[backend] - microseconds(partial(without_points.evaluate, q, v, now), count)
        without = without_points.out
    law = model.term(HuntCrossley.name)
    assert isinstance(law, HuntCrossley)
    head, total = len(q) - 2 * NODE * len(sections.node_mass), q + run.system.ref
    contact_part["naive"] = microseconds(lambda: contact(law, sections, total, v, head, now), 1)
    naive = np.ravel(contact(law, sections, total, v, head, now))
    return {
        "microseconds_all_forces": all_forces,
        "microseconds_contact": contact_part,
        "contact_ratios": {
            f"{slow}_over_{quick}": contact_part[slow] / contact_part[quick]
            for slow in ("python", "naive")
            for quick in BACKENDS[1:4]
        },
        "largest_relative_difference": {
            **{backend: _apart(result, forces["python"]) for backend, result in forces.items()},
            "naive": _apart(naive, (forces["python"] - without)[head:]),
        },
    }


def _apart(actual: Array, expected: Array) -> float:
    return float(np.max(np.abs(actual - expected)) / np.max(np.abs(expected)))
