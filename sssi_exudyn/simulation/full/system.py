"""The model as an Exudyn system: the skier, two flexible skis clamped to the feet, and the forces on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    CoordinateSpringDamper,
    MarkerNodeCoordinate,
    NodePointGround,
)

from sssi_exudyn.bodies.ski.beam import add_ski_beam
from sssi_exudyn.bodies.skier.skeleton import CarriedMass, Skeleton, add_carried_mass, add_skeleton
from sssi_exudyn.core.choices import Backend
from sssi_exudyn.core.frames import Array, gravity_in_slope
from sssi_exudyn.model.legs import Legs
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.carved_forces_kernel import GIVING
from sssi_exudyn.simulation.full.forces import CarvedForces, CoupledMass, Forces, add_forces
from sssi_exudyn.simulation.posture_table import PostureTable
from sssi_exudyn.simulation.result import SIDES
from sssi_exudyn.simulation.ski_on_snow.structs import Carrier, Instant

_OF_MOVEMENT: Final = (
    "foot_velocity", "foot_acceleration", "foot_spin", "foot_spin_rate", "com_velocity", "exposed_velocity"
)  # fmt: skip


def instant(posture: PostureTable, row: int, *, standing: bool = False) -> Instant:
    """Return one row of a posture table as the force kernel takes it; ``standing``: the same posture at rest."""
    at = Instant(float(posture.time[row]), *(getattr(posture, name)[row] for name in Instant._fields[1:]))
    return at._replace(**{name: 0.0 * getattr(at, name) for name in _OF_MOVEMENT}) if standing else at


HELD: Final = (0, 1, 2, 4, 5, 6)
"""Coordinates of the node at the boot that are clamped."""
_HELD_NAMES: Final = ("x", "y", "z", "roll", "pitch", "yaw")
FREE: Final = -1
_RISE: Final = (2,)
"""Coordinates of that node which legs that give leave to a spring."""


@dataclass
class System:
    """An assembled Exudyn system, with the posture of the step that is being solved.

    clamps : (2, 6) item numbers of the constraints that hold each ski's node at the boot centre: three places, three
        quaternion components; FREE where a ski gives against its foot
    object : item number of the object through which the forces act
    ref : (n,) reference coordinates
    """

    container: Any
    mbs: Any
    skeleton: Skeleton | CarriedMass
    clamps: tuple[tuple[int, ...], ...]
    object: int
    forces: Forces
    mass: CoupledMass
    ref: Array
    now: Instant

    @property
    def first_node(self) -> int:
        """Index of the first coordinate of the skis' nodes: the skeleton's come before."""
        return len(self.skeleton.sign)

    def release(self) -> None:
        """Give the system's memory back.  Its callbacks refer to the system and it to them: no collector sees that
        ring.
        """
        mbs = self.mbs
        for take in (
            mbs.SetPreStepUserFunction, mbs.SetPostStepUserFunction, mbs.SetPreNewtonResidualUserFunction
        ):  # fmt: skip
            take(0)
        mbs.SetObjectParameter(self.object, "jacobianUserFunction", 0)
        self.container.Reset()

    def press(self, force: float) -> None:
        """Press the standing skier on the snow with ``force`` (N) along the normal."""
        assert isinstance(self.skeleton, CarriedMass)
        self.skeleton.pull(self.mbs, np.array([0.0, 0.0, -force]))

    def advance(self, posture: PostureTable, row: int) -> None:
        """Bring the prescribed motion to the end of the step that is to be solved."""
        self.now = instant(posture, row)
        self.skeleton.prescribe(self.mbs, posture.angles[row], posture.com_acceleration[row])
        self.mbs.SetObjectParameter(self.object, "massMatrix", self.mass.matrix(self.now.foot_rotation))


def build(
    parts: Parts,
    posture: PostureTable,
    pelvis: Array,
    *,
    tree: bool = False,
    standing: bool = False,
    backend: Backend = "fastest",
) -> System:
    """Assemble the model in the posture of row 0 with the pelvis at ``pelvis`` (3,) m, all at rest.

    ``tree``: the whole skeleton, or its mass carried by the pelvis.  ``standing``: nothing moves but the skis and the
    pelvis' height; friction, movement and gravity are left out, so that a force in its place finds how the run starts.
    """
    exu.special.beams.geometricallyExactLumpedMass = True
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    gravity = np.zeros(3) if standing else gravity_in_slope(parts.model.inclination)
    skeleton: Skeleton | CarriedMass
    if tree:
        q = np.concatenate([pelvis, posture.angles[0]])
        skeleton = add_skeleton(
            mbs, parts.motion.geometry, parts.inertias, gravity, parts.model.inclination, q, np.zeros(31)
        )
    else:
        skeleton = add_carried_mass(mbs, parts.body_mass, gravity, pelvis)
    fixed = mbs.AddNode(NodePointGround(name="ground_of_skis"))
    ground = mbs.AddMarker(MarkerNodeCoordinate(name="ground_of_skis", nodeNumber=fixed, coordinate=0))
    nodes, clamps = [skeleton.node], []
    frame = np.eye(4)
    frame[:3, 3] = parts.ski_in_foot
    for side in SIDES:
        still = np.zeros(3)
        ski = add_ski_beam(mbs, parts.mesh, frame, still, still, damped=False, name=f"{side}_ski")
        middle = ski.nodes[parts.mesh.clamped]
        giving = GIVING if parts.is_carved else _RISE if parts.model.legs.give else ()
        names = {c: f"{side}_binding_{word}" for c, word in zip(HELD, _HELD_NAMES, strict=True)}
        clamps.append(tuple(FREE if c in giving else _fix(mbs, ground, (middle, c), 0.0, names[c]) for c in HELD))
        if parts.model.legs.give:
            _spring(mbs, ground, (middle, _RISE[0]), parts.model.legs, f"{side}_leg")
        nodes += ski.nodes
    if standing:
        for coordinate, axis in enumerate("fl"):
            _fix(mbs, ground, (skeleton.node, coordinate), float(pelvis[coordinate]), f"pelvis_{axis}")
    ref = np.concatenate([np.asarray(mbs.GetNode(node)["referenceCoordinates"], dtype=np.float64) for node in nodes])
    terms = [term for term in parts.model.terms if not standing or term.kind in ("point", "edge", "terrain")]
    carrier = Carrier(skeleton.sign, np.array(list(parts.areas.values())), gravity)
    forces: Forces
    if parts.is_carved:
        forces = CarvedForces(terms, parts.sections, parts.edges, carrier, ref)
        mass = CoupledMass(parts.sections, len(ref), (parts.mesh.clamped, parts.leg_inertia))
    else:
        forces = Forces(terms, parts.sections, carrier, ref, backend)
        mass = CoupledMass(parts.sections, len(ref))
    now = instant(posture, 0, standing=standing)
    system = System(container, mbs, skeleton, tuple(clamps), -1, forces, mass, ref, now)
    system.object = add_forces(mbs, nodes, forces, mass.matrix(now.foot_rotation), lambda: system.now)
    mbs.Assemble()
    if standing:  # what lies flat from the start stays so while it is let down
        still = np.zeros(len(ref))
        system.forces.evaluate(still, still, now)
        system.forces.accept()
    return system


def _spring(mbs: Any, ground: int, held: tuple[int, int], legs: Legs, name: str) -> None:
    """Hold one coordinate of a node by the leg's spring and damper; ``held`` is the node and the coordinate."""
    marker = mbs.AddMarker(MarkerNodeCoordinate(name=name, nodeNumber=held[0], coordinate=held[1]))
    spring = CoordinateSpringDamper(
        name=name, markerNumbers=[ground, marker], stiffness=legs.stiffness, damping=legs.damping
    )
    mbs.AddObject(spring)


def _fix(mbs: Any, ground: int, held: tuple[int, int], value: float, name: str) -> int:
    """Hold one coordinate of a node, reference not counted, at ``value``; ``held`` is the node and the coordinate."""
    marker = mbs.AddMarker(MarkerNodeCoordinate(name=name, nodeNumber=held[0], coordinate=held[1]))
    return int(mbs.AddObject(CoordinateConstraint(name=name, markerNumbers=[ground, marker], offset=value)))
