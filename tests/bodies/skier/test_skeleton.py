"""The skeleton's tree in Exudyn against the chain it was made from, and falling freely."""

from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import (
    CoordinateConstraint,
    MarkerNodeCoordinate,
    NodePointGround,
    SensorKinematicTree,
    SensorNode,
)
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.anthropometry import body_inertia
from sssi_exudyn.bodies.skier.chain import COORDINATES, SEGMENTS, average_geometry, forward_kinematics, rates
from sssi_exudyn.bodies.skier.skeleton import add_skeleton

INCLINATION = 0.28


@pytest.mark.parametrize("seed", range(3))
def test_poses_and_velocities_are_the_chains(seed: int) -> None:
    """Take random coordinates, with joints that stand askew in their parents as a capture's knees and ankles do."""
    generator = np.random.default_rng(seed)
    geometry = average_geometry(1.78)
    askew = Rotation.from_rotvec(0.2 * generator.normal(size=(len(SEGMENTS), 3))).as_matrix()
    geometry = replace(geometry, attitude_in_parent=askew)
    q, qd = generator.normal(size=(2, len(COORDINATES)))
    inertias = body_inertia(geometry, 75.0, "male")
    mbs = exu.SystemContainer().AddSystem()
    skeleton = add_skeleton(mbs, geometry, inertias, np.zeros(3), INCLINATION, q, qd)
    kinds = exu.OutputVariableType.Position, exu.OutputVariableType.RotationMatrix, exu.OutputVariableType.Velocity
    sensors = [
        [
            mbs.AddSensor(
                SensorKinematicTree(
                    objectNumber=skeleton.tree,
                    linkNumber=link,
                    localPosition=list(place),
                    outputVariableType=kind,
                    writeToFile=False,
                )
            )
            for kind in kinds
        ]
        for link, place, _ in skeleton.links.of_segment
    ]
    mbs.Assemble()
    poses = forward_kinematics(geometry, q, INCLINATION)
    moving = rates(poses, qd, np.zeros(len(COORDINATES)))
    for i, (_, _, turn) in enumerate(skeleton.links.of_segment):
        place, frame, velocity = (np.array(mbs.GetSensorValues(sensor)) for sensor in sensors[i])
        # 1e-9: rounding through at most ten joints
        np.testing.assert_allclose(place, poses.origin[i], atol=1e-9, err_msg=SEGMENTS[i])
        np.testing.assert_allclose(frame.reshape(3, 3) @ turn, poses.rotation[i], atol=1e-9, err_msg=SEGMENTS[i])
        np.testing.assert_allclose(velocity, moving.velocity[i], atol=1e-8, err_msg=SEGMENTS[i])


def test_free_fall() -> None:
    """Let the skeleton go, held in its posture: it falls with gravity and no joint feels anything."""
    geometry = average_geometry(1.78)
    gravity = np.array([2.5, 0.0, -9.4])
    q = 0.3 * np.random.default_rng(5).normal(size=len(COORDINATES))
    mbs = exu.SystemContainer().AddSystem()
    add_skeleton(
        mbs, geometry, body_inertia(geometry, 75.0, "male"), gravity, INCLINATION, q, np.zeros(len(COORDINATES))
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 0.5, 100
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    assert exu.MainSolverImplicitSecondOrder().SolveSystem(mbs, settings)
    fallen = np.array(mbs.systemData.GetODE2Coordinates())[:3] - q[:3]
    np.testing.assert_allclose(fallen, 0.5 * gravity * 0.5**2, atol=1e-8)
    moments = np.array(mbs.systemData.GetAECoordinates())
    # a hand held out weighs 2 N m: nothing of that is left
    assert np.max(np.abs(moments)) < 1e-6


def test_a_freed_knee_swings_as_a_physical_pendulum() -> None:
    """Free one knee, upright, all else held: shank and foot swing about it with T = 2π √(I/(m g d))."""
    geometry = average_geometry(1.78)
    inertias = body_inertia(geometry, 75.0, "male", boot_mass=1.9)
    knee = COORDINATES.index("knee_angle_r")
    q = np.zeros(len(COORDINATES))
    q[knee] = 0.02
    mbs = exu.SystemContainer().AddSystem()
    skeleton = add_skeleton(mbs, geometry, inertias, np.array([0.0, 0.0, -9.81]), 0.0, q, np.zeros(len(COORDINATES)))
    held = [coordinate for coordinate in range(3, len(COORDINATES)) if coordinate != knee]
    mbs.SetObjectParameter(skeleton.constraint, "scalingMarker1", np.eye(len(COORDINATES))[held])
    mbs.SetObjectParameter(skeleton.constraint, "offset", skeleton.sign[held] * q[held])
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    for coordinate in range(3):
        pelvis = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=skeleton.node, coordinate=coordinate))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, pelvis]))
    swing = mbs.AddSensor(
        SensorNode(
            nodeNumber=skeleton.node,
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Coordinates,
        )
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 3.0, 3000
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    settings.timeIntegration.verboseMode = 0
    settings.solution.sensors.writePeriod = 1e-3
    settings.solution.file.write = False
    assert exu.MainSolverImplicitSecondOrder().SolveSystem(mbs, settings)
    table = np.array(mbs.GetSensorStoredData(swing))
    time, angle = table[:, 0], table[:, 1 + knee]
    poses = forward_kinematics(geometry, np.zeros(len(COORDINATES)), 0.0)
    hinge = poses.origin[SEGMENTS.index("tibia_r")]
    inertia, moment = 0.0, np.zeros(2)
    for name in ("tibia_r", "talus_r", "calcn_r", "toes_r"):
        i = SEGMENTS.index(name)
        body, turn = inertias[i], poses.rotation[i]
        arm = poses.origin[i] + turn @ body.com - hinge
        inertia += (turn @ body.inertia @ turn.T)[1, 1] + body.mass * (arm[0] ** 2 + arm[2] ** 2)
        moment += body.mass * arm[[0, 2]]
    # the foot points forward, so the leg comes to rest a little bent; the swing is about that
    rest = 0.5 * (angle.max() + angle.min())
    crossings = np.flatnonzero(np.diff(np.sign(angle - rest)))
    period = 2.0 * (time[crossings[-1]] - time[crossings[0]]) / (len(crossings) - 1)
    expected = 2.0 * np.pi * np.sqrt(inertia / (9.81 * np.hypot(*moment)))
    # 0.5 %: an amplitude of some 0.1 rad lengthens the period by 0.06 %, crossings are resolved to a step of 1 ms
    assert period == pytest.approx(expected, rel=0.005)


def test_nothing_of_the_skier_is_lost() -> None:
    geometry = average_geometry(1.78)
    inertias = body_inertia(geometry, 75.0, "male", boot_mass=1.9, binding_mass=0.65)
    assert sum(body.mass for body in inertias) == pytest.approx(75.0 + 2 * 1.9 + 2 * 0.65, rel=1e-12)
    mbs = exu.SystemContainer().AddSystem()
    skeleton = add_skeleton(
        mbs, geometry, inertias, np.zeros(3), 0.0, np.zeros(len(COORDINATES)), np.zeros(len(COORDINATES))
    )
    tree = mbs.GetObject(skeleton.tree)
    assert sum(tree["linkMasses"]) == pytest.approx(sum(body.mass for body in inertias), rel=1e-12)
