"""The model as an Exudyn system that its user may look at, change and run on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import exudyn as exu
import numpy as np
import pandas as pd
from exudyn.itemInterface import MarkerKinematicTreeRigid, ObjectGround, VObjectGround

from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENT, SEGMENTS, forward_kinematics, jacobians
from sssi_exudyn.bodies.skier.skeleton import Skeleton
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array, gravity_in_slope
from sssi_exudyn.core.text import did_you_mean, one_line
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.full.drawing import DrawnSkier, snow_graphics
from sssi_exudyn.simulation.full.run import FullRun, divergence, set_up, solve_system, solver_settings
from sssi_exudyn.simulation.full.sensors import Sensor, add_sensors
from sssi_exudyn.simulation.full.series import result_from_record
from sssi_exudyn.simulation.result import SimulationResult

_DRAWN_OTHERWISE: Final = ("skier", "snow_and_air")
StepFunction = Callable[[Any, float], None]
"""Function of Exudyn's system and of the time (s) at the step's end."""
_HIDDEN: Final = ("beam", "binding")
"""Parts of names of what Exudyn would draw at the origin, since the nodes of skis count from the feet."""


@dataclass(frozen=True)
class _Counts:
    """How Exudyn counts and looks up the items of one kind."""

    count: str
    get: str


_KINDS: Final = {
    "nodes": _Counts("NumberOfNodes", "GetNode"),
    "objects": _Counts("NumberOfObjects", "GetObject"),
    "markers": _Counts("NumberOfMarkers", "GetMarker"),
    "loads": _Counts("NumberOfLoads", "GetLoad"),
    "sensors": _Counts("NumberOfSensors", "GetSensor"),
}


class Numbers(dict[str, int]):
    """Numbers by name.  An unknown name raises InputError with the nearest one."""

    def __missing__(self, name: object) -> int:
        raise InputError("model", one_line(name), "there is nothing of that name", did_you_mean(name, self))


@dataclass(frozen=True)
class _State:
    """Coordinates without reference, their rates and accelerations, of all nodes."""

    q: Array
    v: Array
    a: Array

    @classmethod
    def of(cls, mbs: Any, configuration: Any) -> _State:
        data = mbs.systemData
        take = (data.GetODE2Coordinates, data.GetODE2Coordinates_t, data.GetODE2Coordinates_tt)
        return cls(*(np.array(of(configuration)) for of in take))

    def set_initial(self, mbs: Any) -> None:
        """Make this the initial state; coordinates that were added since then keep what the assembly gave them."""
        data, initial = mbs.systemData, exu.ConfigurationType.Initial
        now = _State.of(mbs, initial)
        whole = [
            np.concatenate([own, given[len(own) :]])
            for own, given in ((self.q, now.q), (self.v, now.v), (self.a, now.a))
        ]
        data.SetODE2Coordinates(list(whole[0]), initial)
        data.SetODE2Coordinates_t(list(whole[1]), initial)
        data.SetODE2Coordinates_tt(list(whole[2]), initial)


@dataclass(repr=False)
class OpenModel:
    """The model in Exudyn, at the start of the run.

    Attributes
    ----------
    model, motion : what was built
    settings : Exudyn's ``SimulationSettings`` of the next ``run``; start, end and steps are set there
    before_step, after_step : functions of ``(mbs, t)`` that are called at every step, after the model's own.
        Exudyn's own user functions of the steps are the model's.
    """

    model: Model
    motion: Motion
    settings: Any
    before_step: list[StepFunction] = field(default_factory=list)
    after_step: list[StepFunction] = field(default_factory=list)
    _run: FullRun = field(kw_only=True)
    _state: _State = field(kw_only=True)
    _recorded: dict[str, list[Array]] = field(default_factory=dict, kw_only=True)
    _sensors: dict[str, Sensor] = field(default_factory=dict, kw_only=True)

    @property
    def mbs(self) -> Any:
        """Exudyn's ``MainSystem``, in the slope frame: x down the fall line, y to the left, z normal, SI units."""
        return self._run.system.mbs

    @property
    def system_container(self) -> Any:
        """Exudyn's ``SystemContainer``, whose renderer and visualisation settings show the system."""
        return self._run.system.container

    @property
    def nodes(self) -> Numbers:
        """Numbers of nodes by name: ``skier``, and from tail to tip ``left_ski_node_0`` …"""
        return self._items("nodes")

    @property
    def objects(self) -> Numbers:
        """Numbers of objects by name.

        The skeleton is ``skier``, its joints are ``prescribed_angles``, all contact and air is ``snow_and_air``.
        Skis are ``left_ski_beam_0`` …, bindings ``left_binding_x`` …
        """
        return self._items("objects")

    @property
    def markers(self) -> Numbers:
        """Numbers of markers by name: of segments such as ``torso`` or ``femur_l``, and of the skis' nodes."""
        return self._items("markers")

    @property
    def loads(self) -> Numbers:
        """Numbers of loads by name: none, unless the user has added some."""
        return self._items("loads")

    @property
    def sensors(self) -> Numbers:
        """Numbers of sensors by name: ``pelvis``, ``loads``, ``left_ski_shape`` and others."""
        return self._items("sensors")

    @property
    def joints(self) -> Numbers:
        """Indices of the 28 prescribed angles by name: rows of the constraint ``prescribed_angles``."""
        return Numbers({name: index for index, name in enumerate(PRESCRIBED)})

    @property
    def links(self) -> Numbers:
        """Links of the skier's kinematic tree by segment: several segments are welded to one link."""
        segments = zip(SEGMENTS, self._skeleton.links.of_segment, strict=True)
        return Numbers({name: link for name, (link, _, _) in segments})

    @property
    def time(self) -> float:
        """Time (s) that the run has reached, on the recording's clock."""
        return self._run.record.time[-1] if self._run.record.time else float(self._run.posture.time[0])

    @property
    def gravity(self) -> Array:
        """Acceleration (3,) m/s² of gravity in the slope frame, for loads of bodies that are added."""
        return gravity_in_slope(self.model.inclination)

    @checked
    def add_marker(self, segment: str, place: Array | tuple[float, float, float], name: str) -> int:
        """Add a marker at a place of a segment and return its number.

        Parameters
        ----------
        segment : one of ``links``
        place : (3,) m in the segment's frame: x forward, y left, z up when standing, from the segment's joint
        name : of the marker

        Raises InputError for an unknown segment, and for a name that a marker has.
        """
        index = self._segment(segment)
        if name in self.markers:
            raise InputError("add_marker", "name", f"there is a marker {name!r} already", "choose another name")
        return self._add_marker(index, np.asarray(place, dtype=np.float64), name)

    @checked
    def state_of(self, segment: str, place: Array | tuple[float, float, float]) -> tuple[Array, Array]:
        """Return where a place of a segment is, (3,) m, and how it moves, (3,) m/s, at ``time`` in the slope frame.

        A body that is added there starts with these.  Raises InputError for an unknown segment.
        """
        index, links = self._segment(segment), self._skeleton.links
        q, v = self._now()
        poses = forward_kinematics(self.motion.geometry, links.sign * q, self.model.inclination)
        there = poses.origin[index] + poses.rotation[index] @ np.asarray(place, dtype=np.float64)
        linear = jacobians(poses, [index], there[None])[1][0]
        return there, np.asarray(linear @ (links.sign * v))

    @checked
    def recorded(self, sensor: str) -> pd.DataFrame:
        """Return what a sensor of the model has recorded, one row a step with ``time_s`` first.

        Raises InputError for an unknown sensor.
        """
        if sensor not in self._sensors:
            raise InputError("recorded", sensor, "no such sensor of the model", did_you_mean(sensor, self._sensors))
        parts = self._recorded.get(sensor, [])
        columns = ["time_s", *self._sensors[sensor].columns]
        return pd.DataFrame(np.concatenate(parts) if parts else np.zeros((0, len(columns))), columns=columns)

    def integrate(self, solution: Path | None = None, until: float | None = None) -> SimulationResult:
        """Assemble the system with what was added, run it on, and return the run so far.

        Parameters
        ----------
        solution : file of coordinates that Exudyn's ``SolutionViewer`` finds
        until : s on the recording's clock; the built run's end if None

        Raises InputError for a time that the run has passed, and SimulationDiverged when the solver gives up.
        """
        run, grid = self._run, self._run.posture.time
        first = int(np.argmin(np.abs(grid - self.time)))
        last = len(grid) - 1 if until is None else int(np.argmin(np.abs(grid - until)))
        if last <= first:
            problem = f"the run is at {self.time:.3f} s already and ends at {grid[-1]:.3f} s"
            raise InputError("run", "until", problem, "give a later time, or build the model again")
        self._begin()
        integration = self.settings.timeIntegration
        integration.startTime, integration.endTime = float(grid[first]), float(grid[last])
        integration.numberOfSteps = last - first
        file = self.settings.solution.file
        file.write = solution is not None
        if solution is not None:
            solution.parent.mkdir(parents=True, exist_ok=True)
            file.name, file.writePeriod = str(solution), 0.02
        self.mbs.sys["simulationSettings"] = self.settings  # where Exudyn's viewer looks for the solution's file
        solver = exu.MainSolverImplicitSecondOrder()
        problem = solve_system(self.mbs, self.settings, solver)
        self._keep(first > 0)
        run.record.statistics(solver)
        result = result_from_record(run.parts, run.posture, run.system, run.record)
        if problem:
            raise divergence(run, problem, result)
        return result

    def release(self) -> None:
        """Give the system's memory back; the model cannot be used any more."""
        self._run.system.release()

    @property
    def _skeleton(self) -> Skeleton:
        skeleton = self._run.system.skeleton
        assert isinstance(skeleton, Skeleton)
        return skeleton

    def _segment(self, name: str) -> int:
        if name not in SEGMENT:
            raise InputError("segment", name, "the skier has no such segment", did_you_mean(name, SEGMENTS))
        return SEGMENT[name]

    def _items(self, kind: str) -> Numbers:
        counts, mbs = _KINDS[kind], self.mbs
        get = getattr(mbs, counts.get)
        count = getattr(mbs.systemData, counts.count)()
        return Numbers({str(get(number)["name"]): number for number in range(count)})

    def _now(self) -> tuple[Array, Array]:
        """Return the tree's coordinates and rates (31,) as they are at ``time``."""
        count = self._run.system.first_node
        return self._state.q[:count], self._state.v[:count]

    def _add_marker(self, segment: int, place: Array, name: str) -> int:
        link, origin, turn = self._skeleton.links.of_segment[segment]
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = turn, origin + turn @ place
        marker = MarkerKinematicTreeRigid(name=name, objectNumber=self._skeleton.tree, linkNumber=link, localHT=frame)
        return int(self.mbs.AddMarker(marker))

    def _begin(self) -> None:
        """Assemble, and start where the run stands; coordinates of items added since then start as these say."""
        mbs = self.mbs
        mbs.Assemble()
        self._state.set_initial(mbs)
        mbs.SetPreStepUserFunction(self._before)
        mbs.SetPostStepUserFunction(self._after)

    def _before(self, mbs: Any, t: float) -> bool:
        self._run.before_step(mbs, t)
        for function in self.before_step:
            function(mbs, t)
        return True

    def _after(self, mbs: Any, t: float) -> bool:
        times = self._run.record.time
        if not times or t > times[-1] + 1e-9:  # a run that goes on begins with the state it ended with
            self._run.after_step(mbs, t)
            for function in self.after_step:
                function(mbs, t)
        return True

    def _keep(self, goes_on: bool) -> None:
        """Keep the state that was reached, and what the sensors recorded."""
        self._state = _State.of(self.mbs, exu.ConfigurationType.Current)
        for name, sensor in self._sensors.items():
            rows = np.array(self.mbs.GetSensorStoredData(sensor.number))
            self._recorded.setdefault(name, []).append(rows[1:] if goes_on else rows)


def open_model(model: Model, motion: Motion) -> OpenModel:
    """Build the model in Exudyn, settled on the snow at the motion's start.

    Raises InputError for a heading that is to be found, which the skeleton's tree cannot have, and SimulationDiverged
    where the skier does not come to rest.
    """
    if model.heading.is_found:
        problem = "the skeleton's tree keeps the captured heading"
        raise InputError("build", f"heading {model.heading.mode}", problem, "use replay")
    run = set_up(model, motion, tree=True)
    system, skeleton = run.system, run.system.skeleton
    assert isinstance(skeleton, Skeleton)
    grid = run.posture.time
    settings = solver_settings(model, float(grid[0]), float(grid[-1]), len(grid) - 1)
    settings.solution.sensors.active = True
    settings.solution.sensors.writePeriod = 0.0  # every step
    settled = _State.of(system.mbs, exu.ConfigurationType.Initial)
    opened = OpenModel(model, run.parts.motion, settings, _run=run, _state=settled)
    for name, index in SEGMENT.items():
        opened._add_marker(index, np.zeros(3), name)
    opened._sensors.update(add_sensors(run, skeleton.tree))
    _draw(opened, run)
    opened._begin()
    return opened


def _draw(opened: OpenModel, run: FullRun) -> None:
    """Give the system shapes of skier, skis and snow, and hide what would stand at the origin."""
    mbs = run.system.mbs
    skier = VObjectGround(graphicsDataUserFunction=DrawnSkier(run.parts, run.system).user_function())
    mbs.AddObject(ObjectGround(name="skier_and_skis", visualization=skier))
    snow = VObjectGround(graphicsData=snow_graphics(run.parts, run.posture))
    mbs.AddObject(ObjectGround(name="snow", visualization=snow))
    for name, number in opened.nodes.items():
        if "_ski_node_" in name:
            mbs.SetNodeParameter(number, "Vshow", False)
    for name, number in opened.objects.items():
        if any(f"_{part}_" in name for part in _HIDDEN) or name in _DRAWN_OTHERWISE:
            mbs.SetObjectParameter(number, "Vshow", False)
