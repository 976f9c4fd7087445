"""Random states of motion, for rules that must hold in any state."""

from collections.abc import Sequence

import numpy as np

from sssi_exudyn.bodies.skier.chain import COORDINATES
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.choices import Backend
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces import Forces
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.system import instant
from sssi_exudyn.simulation.ski_on_snow.structs import Carrier, Instant

TREE = len(COORDINATES)
EXPOSED = 4
"""Number of segments in the air."""


def random_state(parts: Parts, seed: int) -> tuple[np.ndarray, np.ndarray, Instant]:
    """Return coordinates, rates and posture of skis bent and moving at random, their feet near the snow."""
    generator = np.random.default_rng(seed)
    cut = parts.mesh
    n = len(cut.node_s)
    q, v = generator.normal(size=(2, TREE + 2 * NODE * n))
    q[:TREE] *= 0.1
    posture = parts.posture(np.array([0.2]))
    q[2] = -posture.foot_place[0, :, 2].mean() - 0.01
    nodes = q[TREE:].reshape(2, n, NODE)
    nodes[:, :, :3] = cut.node_position + parts.ski_in_foot + 0.002 * nodes[:, :, :3]
    turn = 0.02 * generator.normal(size=(2, n, 3))
    nodes[:, :, 3], nodes[:, :, 4:] = np.sqrt(1.0 - np.sum(turn**2, axis=-1)), turn
    v *= 0.3
    at = instant(posture, 0)
    moving = {name: generator.normal(size=(2, 3)) for name in ("foot_spin", "foot_velocity")}
    shape = (EXPOSED, 3, at.com_jacobian.shape[-1])
    exposed = {"exposed_velocity": generator.normal(size=shape[:2]), "exposed_jacobian": generator.normal(size=shape)}
    root = 0.2 * generator.normal(size=(EXPOSED, 3, 3))
    exposed["exposed_facing"] = root @ np.swapaxes(root, 1, 2)
    return q, v, at._replace(**moving, **exposed)


def forces_of(parts: Parts, terms: Sequence[Term], backend: Backend = "fastest") -> Forces:
    """Return the forces of ``terms`` on such states."""
    gravity, area = np.array([0.0, 0.0, -9.0]), np.full(EXPOSED, 0.05)
    sign = np.where(np.arange(TREE) % 2, -1.0, 1.0)
    ref = np.zeros(TREE + 2 * NODE * len(parts.mesh.node_s))
    return Forces(terms, parts.sections, Carrier(sign, area, gravity), ref, backend)
