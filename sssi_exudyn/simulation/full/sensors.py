"""Exudyn's sensors of a model: track, speed, loads, edges, air, and the shape of the skis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import exudyn as exu
import numpy as np
from exudyn.itemInterface import SensorKinematicTree, SensorUserFunction

from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.full import forces_kernel as kernel
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.run import FullRun
from sssi_exudyn.simulation.result import SIDES

_PELVIS: Final = 2
"""Link of the tree that has the pelvis' three translations and no rotation."""
_AXES: Final = ("f", "l", "n")


@dataclass(frozen=True)
class Sensor:
    """One of Exudyn's sensors.

    number : in the system
    columns : what it records, in SI units, each with its unit as the last part of its name
    """

    number: int
    columns: tuple[str, ...]


def add_sensors(run: FullRun, tree: int) -> dict[str, Sensor]:
    """Add the sensors to the run's system, by their names; vectors are in the slope frame."""
    system = run.system
    mbs = system.mbs
    sensors: dict[str, Sensor] = {}
    for name, unit, variable in (
        ("pelvis", "m", exu.OutputVariableType.Position),
        ("pelvis_velocity", "mps", exu.OutputVariableType.Velocity),
    ):
        number = mbs.AddSensor(
            SensorKinematicTree(
                name=name, objectNumber=tree, linkNumber=_PELVIS, outputVariableType=variable, storeInternal=True
            )
        )
        sensors[name] = Sensor(int(number), _vector(name, unit))

    def add(name: str, columns: Sequence[str], read: Callable[[], Array]) -> None:
        def value(_mbs: Any, _t: float, _sensors: Any, _factors: Any, _configuration: Any) -> list[float]:
            return [float(number) for number in read()]

        sensor = SensorUserFunction(name=name, sensorUserFunction=value, storeInternal=True)
        sensors[name] = Sensor(int(mbs.AddSensor(sensor)), tuple(columns))

    def of_skis(column: int) -> Callable[[], Array]:
        return lambda: system.forces.seen[:, column]

    def shape(side: int) -> Callable[[], Array]:
        first = system.first_node + side * NODE * len(run.parts.mesh.node_s)
        last = first + NODE * len(run.parts.mesh.node_s)

        def heights() -> Array:
            q = mbs.systemData.GetODE2Coordinates(copy=False)[first:last]
            return np.asarray((q + system.ref[first:last]).reshape(-1, NODE)[:, 2])

        return heights

    add("loads", [f"{side}_load_N" for side in SIDES], of_skis(kernel.LOAD))
    add("edge_angles", [f"{side}_edge_angle_rad" for side in SIDES], of_skis(kernel.EDGE))
    add("penetrations", [f"{side}_penetration_m" for side in SIDES], of_skis(kernel.DEPTH))
    add("air", _vector("drag", "N"), lambda: system.forces.drag[:, :3].sum(axis=0))
    for index, side in enumerate(SIDES):
        stations = [f"{side}_ski_height_at_{s:.3f}_m" for s in run.parts.mesh.node_s]
        add(f"{side}_ski_shape", stations, shape(index))
    return sensors


def _vector(name: str, unit: str) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}_{unit}" for axis in _AXES)
