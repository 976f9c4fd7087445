"""A bench for skis: holding, loading and shaking an Exudyn ski beam, shared by the tests."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.itemInterface import Force, GenericJoint, MarkerBodyRigid, ObjectGround, Torque
from numpy.typing import ArrayLike

from sssi_exudyn.bodies.ski.beam import SkiBeam, add_ski_beam
from sssi_exudyn.bodies.ski.mesh import BeamMesh
from sssi_exudyn.bodies.ski.ski import Profile, Ski, read_ski
from sssi_exudyn.core.frames import Array

FLAT = Profile((0.0, 1.0), (0.0, 0.0), ("linear",))


def slalom() -> Ski:
    return read_ski("slalom_165", "nowhere")


class Bench:
    """One free, unloaded ski at rest in its own frame; hold it, load it, solve."""

    def __init__(self, mesh: BeamMesh, *, damped: bool = False) -> None:
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.mesh = mesh
        self.beam: SkiBeam = add_ski_beam(self.mbs, mesh, np.eye(4), np.zeros(3), np.zeros(3), damped=damped)
        self.ground = self.mbs.AddObject(ObjectGround())

    def hold(self, node: int, axes: ArrayLike = (1, 1, 1, 1, 1, 1)) -> None:
        """Lock a node's displacements and rotations, each along or about the ski's axes, where ``axes`` is 1."""
        place, turn = self.mesh.node_position[node], self.mesh.node_rotation[node]
        marker = self.mbs.AddMarker(
            MarkerBodyRigid(bodyNumber=self.ground, localHT=exu.HT(rotation=turn, translation=place))
        )
        self.mbs.AddObject(
            GenericJoint(markerNumbers=[marker, self.beam.node_markers[node]], constrainedAxes=list(np.asarray(axes)))
        )

    def push(self, node: int, force: ArrayLike) -> int:
        return int(self.mbs.AddLoad(Force(markerNumber=self.beam.node_markers[node], loadVector=list(force))))

    def twist(self, node: int, torque: ArrayLike) -> int:
        return int(self.mbs.AddLoad(Torque(markerNumber=self.beam.node_markers[node], loadVector=list(torque))))

    def settle(self, steps: int = 1) -> Array:
        """Return the nodes' displacement (n + 1, 3) m in static equilibrium; the load is applied in ``steps``."""
        self.mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.staticSolver.numberOfLoadSteps = steps
        settings.staticSolver.newton.relativeTolerance = 1e-8
        settings.staticSolver.newton.absoluteTolerance = 2e-6  # N; over the rounding of stiff axes, 2e-7 to 5e-7
        settings.staticSolver.verboseMode = 0
        settings.solution.file.write = False
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        self.mbs.SolveStatic(settings)
        return self.positions() - self.mesh.node_position

    def positions(self) -> Array:
        kind = exu.OutputVariableType.Position
        return np.array([self.mbs.GetNodeOutput(node, kind) for node in self.beam.nodes])

    def frequencies(self) -> Array:
        """Return the natural frequencies of the unloaded ski (Hz), rising, rigid motions included."""
        self.mbs.Assemble()
        values = self.mbs.ComputeODE2Eigenvalues(
            computeComplexEigenvalues=False, convert2Frequencies=True, useAbsoluteValues=True
        )[0]
        return np.sort(np.asarray(values, float))
