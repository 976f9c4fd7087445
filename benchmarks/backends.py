"""What one pass over all forces costs by back end, and what the contact's part of it is."""

from __future__ import annotations

import time
from collections.abc import Callable
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
    """Of one call, in the best of some repeats of ``count``: what other processes do can only add to it."""
    walls = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        for _ in range(count):
            work()
        walls.append(time.perf_counter() - begin)
    return 1e6 * min(walls) / count


def forces_of(run: FullRun, sections: Sections, backend: Backend) -> Forces:
    """The forces of a run, with other sections and by another back end."""
    model, system = run.parts.model, run.system
    area = np.array(list(run.parts.areas.values()))
    carrier = Carrier(system.skeleton.sign, area, gravity_in_slope(model.inclination))
    return Forces(model.terms, sections, carrier, system.ref, backend)


def without_contact(sections: Sections) -> Sections:
    """The same ski with nothing that touches the snow."""
    none = {name: getattr(sections, name)[:0] for name in ("element", "share", "offset", "length")}
    return sections._replace(**none)


def backends(model: Model, motion: Motion) -> dict[str, Any]:
    """Microseconds of a pass and of its contact a second into the run; ratios, and the largest relative difference.

    The contact's part is the pass less the same pass without points of contact; ``naive`` has no other part.
    """
    run, _ = integrate(model, motion, stop=motion.start + 1.0)
    q, v, at, sections = run.record.q[-1], run.record.v[-1], run.system.now, run.parts.sections
    whole, part, forces = {}, {}, {}
    for backend, count in PASSES.items():
        full, rest = (forces_of(run, some, backend) for some in (sections, without_contact(sections)))
        forces[backend] = full.evaluate(q, v, at).copy()
        whole[backend] = microseconds(lambda full=full: full.evaluate(q, v, at), count)
        part[backend] = whole[backend] - microseconds(lambda rest=rest: rest.evaluate(q, v, at), count)
        without = rest.out
    law = model.term(HuntCrossley.name)
    assert isinstance(law, HuntCrossley)
    head, total = len(q) - 2 * NODE * len(sections.node_mass), q + run.system.ref
    part["naive"] = microseconds(lambda: contact(law, sections, total, v, head, at), 1)
    naive = np.ravel(contact(law, sections, total, v, head, at))
    return {
        "microseconds_all_forces": whole,
        "microseconds_contact": part,
        "contact_ratios": {
            f"{slow}_over_{quick}": part[slow] / part[quick] for slow in ("python", "naive") for quick in BACKENDS[1:4]
        },
        "largest_relative_difference": {
            **{backend: _apart(found, forces["python"]) for backend, found in forces.items()},
            "naive": _apart(naive, (forces["python"] - without)[head:]),
        },
    }


def _apart(found: Array, expected: Array) -> float:
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))
