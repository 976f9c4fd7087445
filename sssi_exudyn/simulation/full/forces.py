"""Force terms in Exudyn: one object over all coordinates, whose force and Jacobian are one pass of ``kernel``.

``compiled``  machine code, the laws generated from the terms; needs Numba
``numpy``     the pass over arrays, the laws in NumPy's arithmetic
``symbolic``  the pass over arrays, the laws recorded as Exudyn's expressions and evaluated by Exudyn
``python``    the pass by the interpreter, the laws called as they are written: the reference
``fastest``   the first of these that is installed

All give the same forces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import ObjectGenericODE2

from sssi_exudyn.contact.codegen.compiled import compile_kernel, law_parameters
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.choices import Backend
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import FAULT
from sssi_exudyn.simulation.full import carved_forces_kernel
from sssi_exudyn.simulation.full import forces_kernel as kernel
from sssi_exudyn.simulation.full.carved_forces_kernel import EITHER, LASTING, CarvedSkis, FlatSections
from sssi_exudyn.simulation.full.forces_numpy import ArrayKernel, ArrayLaws
from sssi_exudyn.simulation.full.forces_python import interpreted_kernel
from sssi_exudyn.simulation.full.forces_symbolic import SymbolicLaws
from sssi_exudyn.simulation.ski_on_snow import edge as edge_kernel
from sssi_exudyn.simulation.ski_on_snow import edge_point, point
from sssi_exudyn.simulation.ski_on_snow import groove as groove_kernel
from sssi_exudyn.simulation.ski_on_snow import ground as ground_kernel
from sssi_exudyn.simulation.ski_on_snow.structs import (
    Carrier,
    CuttingEdges,
    ForcePass,
    Groove,
    Instant,
    Sections,
    Triplets,
)


def choose_backend(backend: Backend) -> Backend:
    """Return the back end to use: ``fastest`` becomes the fastest there is.

    Raises InputError where ``compiled`` is asked for and Numba is missing or broken.
    """
    if backend == "fastest":
        return "numpy" if FAULT else "compiled"
    if backend == "compiled" and FAULT:
        raise InputError("backend", "compiled", f"Numba does not work ({FAULT})", "fix it, or use numpy or symbolic")
    return backend


def kernel_of(terms: Sequence[Term], backend: Backend) -> tuple[Any, LawParameters]:
    """Return the functions of the force pass for ``terms``, as ``kernel`` names them, and the parameters they take.

    The Jacobian is the kernel's in every back end, as machine code where Numba works: it steers Newton's method, not
    the result, and is wanted far less often than forces.
    """
    chosen = choose_backend(backend)
    parameters = law_parameters(terms)
    if chosen == "python":
        return interpreted_kernel(terms, kernel), parameters
    template = compile_kernel(point, ground_kernel, kernel)
    if chosen == "compiled":
        return template, parameters
    laws = ArrayLaws(terms) if chosen == "numpy" else SymbolicLaws(terms)
    return ArrayKernel(laws, template.jacobian), parameters


class Forces:
    """All forces by the kernel.

    Parameters
    ----------
    terms : the model's terms
    sections, carrier : what of the skis and of the skier does not change
    ref : reference coordinates of all nodes, in the kernel's order
    """

    def __init__(
        self,
        terms: Sequence[Term],
        sections: Sections,
        carrier: Carrier,
        ref: Array,
        backend: Backend = "fastest",
    ) -> None:
        self._kernel, parameters = kernel_of(terms, backend)
        self._make_room(parameters, sections, carrier, ref, kernel.SEEN)

    def _make_room(
        self, parameters: LawParameters, sections: Sections, carrier: Carrier, ref: Array, columns: int
    ) -> None:
        self._parameters = parameters
        self._sections, self._carrier, self.ref = sections, carrier, ref
        self._found = ForcePass(
            np.zeros(len(ref)), np.zeros((2, columns)), np.zeros((len(carrier.area), 4)), np.zeros(3)
        )
        entries = 2 * (17**2 * len(sections.share) + 64 * len(sections.damping) + 15) + 3 * len(carrier.sign)
        self._triplets = Triplets(np.zeros(entries, np.int64), np.zeros(entries, np.int64), np.zeros(entries))

    @property
    def out(self) -> Array:
        """Generalised forces on all coordinates of the last pass."""
        return self._found.out

    @property
    def seen(self) -> Array:
        """(2, columns) what the last pass saw of each ski, as the kernels name the columns."""
        return self._found.seen

    @property
    def drag(self) -> Array:
        """(e, 4) the air's force (N) and power (W) on the exposed segments in the last pass."""
        return self._found.drag

    @property
    def body(self) -> Array:
        """(3,) N, force of the body terms in the last pass."""
        return self._found.body

    def evaluate(self, q: Array, v: Array, at: Instant) -> Array:
        """Return the generalised forces on all coordinates (a buffer that the next call overwrites); fill ``seen``,
        ``drag``, ``body``.
        """
        self._kernel.forces(self._parameters, q, v, self.ref, self._sections, self._carrier, at, self._found)
        return self.out

    def foot_axes(self, place: Array, rotation: Array) -> tuple[Array, Array, float]:
        """Return forward and left axes (3,) of a foot in the snow's tangent plane, and the ski's edge angle (rad)."""
        along, across, edge = self._kernel.foot_axes(self._parameters, self._sections.surface, place, rotation)
        return np.array(along), np.array(across), edge

    def triplets(self, q: Array, v: Array, at: Instant, by_place: float, by_rate: float) -> Array:
        """Return sparse triplets (k, 3) of −(by_place ∂f/∂q + by_rate ∂f/∂v), after an ``evaluate`` near by."""
        count = self._kernel.jacobian(
            self._parameters, q, v, self.ref, self._sections, self._carrier, at, self.seen, by_place, by_rate,
            self._triplets,
        )  # fmt: skip
        return np.column_stack([part[:count] for part in self._triplets])

    def bring_memory(self, step: float) -> None:
        """Bring what the skis left at the last accepted step to where they are ``step`` (s) later: here nothing."""

    def accept(self) -> None:
        """Take what the last pass would leave in the snow as what the step left: here nothing."""


class CarvedForces(Forces):
    """All forces on snow that edges cut, and what the snow remembers of the skis.

    Parameters
    ----------
    terms, sections, carrier, ref : as for ``Forces``
    edges : what edges that cut need of the skis in addition
    """

    def __init__(
        self, terms: Sequence[Term], sections: Sections, edges: CuttingEdges, carrier: Carrier, ref: Array
    ) -> None:
        self._kernel = compile_kernel(
            point, edge_point, ground_kernel, groove_kernel, edge_kernel, kernel, carved_forces_kernel
        )  # fmt: skip
        self._make_room(law_parameters(terms), sections, carrier, ref, carved_forces_kernel.CARVED_SEEN)
        count = len(sections.share)
        self.memory = Groove.fresh(2, 2, count)
        flat = FlatSections(np.full((2, count), EITHER), np.zeros((2, count)), np.full((2, count), LASTING))
        self._carved = CarvedSkis(edges, self.memory, flat, 0.0)

    def evaluate(self, q: Array, v: Array, at: Instant) -> Array:
        self._kernel.carved_forces(
            self._parameters, q, v, self.ref, self._sections, self._carved, self._carrier, at, self._found
        )
        return self.out

    def triplets(self, q: Array, v: Array, at: Instant, by_place: float, by_rate: float) -> Array:
        count = self._kernel.carved_jacobian(
            self._parameters, q, v, self.ref, self._sections, self._carved, self._carrier, at, (by_place, by_rate),
            self._triplets,
        )  # fmt: skip
        return np.column_stack([part[:count] for part in self._triplets])

    def bring_memory(self, step: float) -> None:
        self._carved = self._carved._replace(step=step)
        for ski in range(2):
            self._kernel.advect(self._carved.edges, self._kernel.of_ski(self.memory, ski), step)

    def accept(self) -> None:
        for ski in range(2):
            self._kernel.accept(self._kernel.of_ski(self.memory, ski))
        self._kernel.keep_flat(self._carved.lying)


class CoupledMass:
    """What the skis' masses add to the pelvis, and how they couple it with their nodes.

    A node moves with ẋ + … + R Ẋ: its mass m stands on the pelvis' diagonal, and m R between the pelvis and the node.

    ``held`` is the node at the boot with the inertia of boot and leg that a ski takes along as it yaws and as it rolls
    (kg m²), by 2 q_z and 2 q_x; None where it is clamped.
    """

    def __init__(self, sections: Sections, size: int, held: tuple[int, Array] | None = None) -> None:
        nodes = len(sections.node_mass)
        pelvis, axis = np.meshgrid(np.arange(3), np.arange(3), indexing="ij")
        start = size - kernel.NODE * np.arange(2 * nodes, 0, -1)
        node = (start[:, None, None] + axis).ravel()
        slope = np.broadcast_to(pelvis, (2 * nodes, 3, 3)).ravel()
        self._size, self._mass = size, sections.node_mass[:, None, None]
        self._triplets = np.zeros((3 + 2 * len(node), 3))
        self._triplets[:3, :2], self._triplets[:3, 2] = np.arange(3)[:, None], 2.0 * sections.node_mass.sum()
        self._triplets[3:, 0] = np.concatenate([slope, node])
        self._triplets[3:, 1] = np.concatenate([node, slope])
        self._coupled = slice(3, len(self._triplets))
        if held is not None:
            at = (start[held[0] + nodes * np.arange(2)][:, None] + [6, 4]).ravel()
            self._triplets = np.vstack([self._triplets, np.column_stack([at, at, 4.0 * np.tile(held[1], 2)])])

    def matrix(self, foot_rotation: Array) -> Any:
        """Return the sparse matrix for the feet's rotations (2, 3, 3)."""
        values = (self._mass * foot_rotation[:, None]).ravel()
        values[values == 0.0] = np.finfo(np.float64).tiny  # Exudyn's sparse matrices take no zeros
        self._triplets[self._coupled, 2] = np.concatenate([values, values])
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(self._triplets, self._size, self._size)
        return matrix


def add_forces(mbs: Any, nodes: Sequence[int], forces: Forces, mass: Any, now: Callable[[], Instant]) -> int:
    """Add the object through which ``forces`` act on ``nodes``, which must be the system's first, in the kernel's
    order.

    mass : what the object adds to the mass matrix at the start (``CoupledMass``); to be renewed every step.

    ``now`` gives the posture at the end of the current step.  Exudyn hands coordinates to an object's user functions as
    lists, whose making costs more than the forces.  So the forces are set before every residual of Newton's method by a
    function of the system, which gets no lists; coordinates are read as arrays that share the system's memory.
    """
    size = len(forces.out)
    data = mbs.systemData

    def jacobian(_mbs: Any, _t: float, _item: int, _q: Any, _v: Any, by_place: float, by_rate: float) -> Any:
        q, v = data.GetODE2Coordinates(copy=False)[:size], data.GetODE2Coordinates_t(copy=False)[:size]
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(forces.triplets(q, v, now(), by_place, by_rate), size, size)
        return matrix

    nothing = exu.MatrixContainer()
    nothing.SetWithSparseMatrix(np.zeros((0, 3)), size, size)
    item = int(
        mbs.AddObject(
            ObjectGenericODE2(
                name="snow_and_air",
                nodeNumbers=list(nodes),
                massMatrix=mass,
                stiffnessMatrix=nothing,
                dampingMatrix=nothing,
                forceVector=np.zeros(size),
                jacobianUserFunction=jacobian,
            )
        )
    )

    def before_residual(_mbs: Any, _t: float, _iteration: int, _discontinuous: int) -> bool:
        q, v = data.GetODE2Coordinates(copy=False)[:size], data.GetODE2Coordinates_t(copy=False)[:size]
        mbs.SetObjectParameter(item, "forceVector", forces.evaluate(q, v, now()))
        return True

    mbs.SetPreNewtonResidualUserFunction(before_residual)
    return item
