"""What one simulation gives, as arrays.

Vectors are in the slope frame (f down the fall line, l left, n normal; see ``frames``).  Pairs are (left, right).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sssi_exudyn.core.frames import Array

if TYPE_CHECKING:
    import pandas as pd

SIDES = ("left", "right")
_FREE = ("pelvis_f", "pelvis_l", "pelvis_n")
"""The coordinates that are lengths; all others are angles."""


@dataclass(frozen=True)
class EdgeSeries:
    """What skis that cut the snow do in addition, at n instants, (n, 2) by ski.

    heading : (n,) rad of the whole skier against the captured heading, > 0 to the left
    yaw, roll : rad of the ski against the captured foot, > 0 to the left and to the right edge
    heave, pitch : m, rad of the same, > 0 up and tip down
    side_reserve : share of what the groove's wall bears along the edge that is not used; 0 off the snow
    along, across : N, sums over the edge of the friction's and of the wall's force, whatever their signs
    """

    heading: Array
    yaw: Array
    roll: Array
    heave: Array
    pitch: Array
    side_reserve: Array
    along: Array
    across: Array


PRESSED = 20.0
"""N along the snow's normal below which a ski has no centre of pressure: the usual threshold of force plates."""


@dataclass(frozen=True)
class Wrench:
    """A force on each ski, N, and its moment about the foot's place, N m; n instants, arrays (n, 2, 3)."""

    force: Array
    moment: Array


@dataclass(frozen=True)
class SnowWrench(Wrench):
    """What the snow does to each ski, normal forces and friction, n instants, arrays (n, 2, 3).

    normal : unit vector along the snow's normal under the foot
    """

    normal: Array

    @cached_property
    def pressure_arm(self) -> Array:
        """(n, 2, 3) m from the foot's place to the centre of pressure.

        That is the point of the plane through the foot's place, parallel to the snow, about which the moment is along
        the normal.  Zero where the ski presses with less than ``PRESSED``.
        """
        load = np.sum(self.force * self.normal, axis=-1, keepdims=True)
        pressed = load > PRESSED
        arm = np.cross(self.normal, self.moment) / np.where(pressed, load, 1.0)
        return np.where(pressed, arm, 0.0)

    @cached_property
    def free_moment(self) -> Array:
        """(n, 2, 3) N m about the centre of pressure: along the normal where the ski presses."""
        return np.asarray(self.moment - np.cross(self.pressure_arm, self.force))


def side_reserve(most: Array, borne: Array) -> Array:
    """Return the share of what walls bear at most (…) N that they do not bear (…) N; 0 off the snow."""
    cutting = most > 0.0
    return np.where(cutting, 1.0 - borne / np.where(cutting, most, 1.0), 0.0)


@dataclass(frozen=True)
class SimulationResult:
    """One simulated run: n samples, c coordinates of which p are prescribed.

    Parameters
    ----------
    coordinate_names : c names, the order of ``coordinates``
    moment_names : p names, the order of ``joint_moments``
    time : (n,) s, the recording's clock
    pelvis, pelvis_velocity : (n, 3) m, m/s
    com, com_velocity : (n, 3) m, m/s; centre of mass of skier, boots and skis
    antenna : (n, 3) m, the GPS antenna; None where the recording has none
    coordinates : (n, c) m for the pelvis's translations, rad for all others
    foot_load : (n, 2) N, sum of the snow's normal forces on each ski
    sole_force : (n, 2) N, of the snow's whole force on each ski the part along the foot's up axis, square to the sole:
        what an insole feels (but for what the boot's cuff carries)
    foot_friction : (n, 2, 3) N, friction on each foot
    foot_position, foot_velocity : (n, 2, 3) m, m/s; where that friction acts
    foot_forward : (n, 2, 3), unit vector along each ski
    snow : the snow's whole force on each ski and its moment about ``foot_position``
    edge_angle : (n, 2) rad, between ski base and snow about the ski's long axis
    penetration : (n, 2) m, the deepest contact point of each ski
    drag : (n, 3) N, the air's force on the whole skier
    joint_moments : (n, p) N m, what drives each prescribed coordinate.  Those of the pelvis's rotations are the
        residual moment: nothing holds a real pelvis, so they say how consistent the motion is
    ski_deflection : (n, 2, 2) m, normal deflection of each ski's (tip, tail) against its unloaded shape
    energy : cumulative J by name, each (n,): gravity, kinetic, posture (the prescribed joints' work), friction, …
    energy_closure : (n,) J, what the balance of those terms leaves over; zero for an exact integration
    statistics : about the solver: steps, wall_s, newton_iterations, jacobians, backend
    edges : of skis that cut the snow; None by the paper's law
    pole_force : (n, 2, 3) N of the poles on the hands; None without
    segment_drag : (n, 3) N of the air on each exposed segment's centre of mass, by segment; their sum is ``drag``
    ski_bending : what bending skis, and skis that move in their boots, do to the feet beyond what rigid ones would
        under the same snow, as a wrench on these; None where it was not found
    body_force : (n, 3) N that acts on skier, boots and bindings, shared out by the segments' masses; None without
    ankle_edging : (n, 2) N m that the shank does to the foot about the foot's long axis forwards, at the ankle; None
        where it was not found

    Raises ValueError when an array's shape does not fit.
    """

    coordinate_names: tuple[str, ...]
    moment_names: tuple[str, ...]
    time: Array
    pelvis: Array
    pelvis_velocity: Array
    com: Array
    com_velocity: Array
    antenna: Array | None
    coordinates: Array
    foot_load: Array
    sole_force: Array
    foot_friction: Array
    foot_position: Array
    foot_velocity: Array
    foot_forward: Array
    snow: SnowWrench
    edge_angle: Array
    penetration: Array
    drag: Array
    joint_moments: Array
    ski_deflection: Array
    energy: Mapping[str, Array]
    energy_closure: Array
    statistics: Mapping[str, int | float | str]
    edges: EdgeSeries | None = None
    ankle_edging: Array | None = None
    pole_force: Array | None = None
    segment_drag: Mapping[str, Array] = field(default_factory=dict)
    body_force: Array | None = None
    ski_bending: Wrench | None = None

    def __post_init__(self) -> None:
        n = len(self.time)
        shapes: dict[str, tuple[int, ...]] = {
            "time": (n,),
            "coordinates": (n, len(self.coordinate_names)),
            "joint_moments": (n, len(self.moment_names)),
            "ski_deflection": (n, 2, 2),
            "energy_closure": (n,),
        }
        shapes |= dict.fromkeys(("pelvis", "pelvis_velocity", "com", "com_velocity", "drag"), (n, 3))
        shapes |= dict.fromkeys(("foot_load", "sole_force", "edge_angle", "penetration"), (n, 2))
        shapes |= dict.fromkeys(("foot_friction", "foot_position", "foot_velocity", "foot_forward"), (n, 2, 3))
        given = {name: np.shape(getattr(self, name)) for name in shapes}
        parts = {f"snow {name}": getattr(self.snow, name) for name in ("force", "moment", "normal")}
        given |= {name: np.shape(values) for name, values in parts.items()}
        shapes |= dict.fromkeys(parts, (n, 2, 3))
        given |= {f"drag of {name}": np.shape(values) for name, values in self.segment_drag.items()}
        shapes |= {f"drag of {name}": (n, 3) for name in self.segment_drag}
        given |= {f"energy {name}": np.shape(values) for name, values in self.energy.items()}
        shapes |= {f"energy {name}": (n,) for name in self.energy}
        if self.antenna is not None:
            given["antenna"], shapes["antenna"] = np.shape(self.antenna), (n, 3)
        if self.ankle_edging is not None:
            given["ankle_edging"], shapes["ankle_edging"] = np.shape(self.ankle_edging), (n, 2)
        if self.pole_force is not None:
            given["pole_force"], shapes["pole_force"] = np.shape(self.pole_force), (n, 2, 3)
        if self.body_force is not None:
            given["body_force"], shapes["body_force"] = np.shape(self.body_force), (n, 3)
        for name, shape in shapes.items():
            if given[name] != shape:
                raise ValueError(f"{name} has shape {given[name]}, expected {shape}")

    @property
    def pressure_centre(self) -> Array:
        """(n, 2, 3) m, the centre of pressure of each ski; the foot's place where it does not press."""
        return np.asarray(self.foot_position + self.snow.pressure_arm)

    @property
    def closure_percent(self) -> float:
        """Largest gap of the energy balance, in percent of the largest energy that was turned over."""
        turnover = max((float(np.ptp(values)) for values in self.energy.values()), default=0.0)
        gap = float(np.max(np.abs(self.energy_closure), initial=0.0))
        return 100.0 * gap / turnover if turnover > 0.0 else float("nan")

    def shift(self, by: Array) -> SimulationResult:
        """Return the same run with all places moved by ``by`` (3,) m."""
        first = [name in _FREE for name in self.coordinate_names]
        coordinates = self.coordinates.copy()
        coordinates[:, first] += by
        return replace(
            self,
            pelvis=self.pelvis + by,
            com=self.com + by,
            antenna=None if self.antenna is None else self.antenna + by,
            coordinates=coordinates,
            foot_position=self.foot_position + by,
        )

    def to_frame(self, slope_to_enu: Array) -> pd.DataFrame:
        """Return one row a sample and one column a component, with its unit in its name; vectors are east-north-up.

        Parameters
        ----------
        slope_to_enu : (3, 3) rotation, as ``frames.slope_to_enu`` gives it

        Where there is no antenna its columns are NaN.  Angles and edge angles are in degrees.
        """
        import pandas as pd  # here: a simulation alone needs no table

        columns: dict[str, Array] = {"time_s": self.time}

        def add_vector(name: str, vectors: Array, unit: str) -> None:
            turned = vectors @ slope_to_enu.T
            for axis, label in enumerate(("east", "north", "up")):
                columns[f"{name}_{label}_{unit}"] = turned[:, axis]

        antenna = np.full_like(self.com, np.nan) if self.antenna is None else self.antenna
        add_vector("antenna", antenna, "m")
        add_vector("com", self.com, "m")
        add_vector("com_velocity", self.com_velocity, "mps")
        add_vector("pelvis", self.pelvis, "m")
        add_vector("pelvis_velocity", self.pelvis_velocity, "mps")
        for index, side in enumerate(SIDES):
            columns[f"{side}_load_N"] = self.foot_load[:, index]
            columns[f"{side}_sole_N"] = self.sole_force[:, index]
            add_vector(f"{side}_friction", self.foot_friction[:, index], "N")
            add_vector(f"{side}_foot", self.foot_position[:, index], "m")
            add_vector(f"{side}_foot_velocity", self.foot_velocity[:, index], "mps")
            add_vector(f"{side}_foot_forward", self.foot_forward[:, index], "1")
            add_vector(f"{side}_snow_force", self.snow.force[:, index], "N")
            add_vector(f"{side}_snow_normal", self.snow.normal[:, index], "1")
            add_vector(f"{side}_pressure_centre", self.pressure_centre[:, index], "m")
            add_vector(f"{side}_free_moment", self.snow.free_moment[:, index], "Nm")
            columns[f"{side}_edge_angle_deg"] = np.degrees(self.edge_angle[:, index])
            columns[f"{side}_penetration_m"] = self.penetration[:, index]
            columns[f"{side}_tip_deflection_m"] = self.ski_deflection[:, index, 0]
            columns[f"{side}_tail_deflection_m"] = self.ski_deflection[:, index, 1]
            if self.edges is not None:
                columns[f"{side}_ski_yaw_deg"] = np.degrees(self.edges.yaw[:, index])
                columns[f"{side}_ski_roll_deg"] = np.degrees(self.edges.roll[:, index])
                columns[f"{side}_ski_heave_m"] = self.edges.heave[:, index]
                columns[f"{side}_ski_pitch_deg"] = np.degrees(self.edges.pitch[:, index])
                columns[f"{side}_side_reserve_1"] = self.edges.side_reserve[:, index]
            if self.ankle_edging is not None:
                columns[f"{side}_ankle_edging_Nm"] = self.ankle_edging[:, index]
            if self.pole_force is not None:
                add_vector(f"{side}_pole", self.pole_force[:, index], "N")
        if self.edges is not None:
            columns["heading_offset_deg"] = np.degrees(self.edges.heading)
        add_vector("drag", self.drag, "N")
        for index, name in enumerate(self.coordinate_names):
            values = self.coordinates[:, index]
            if name in _FREE:
                columns[f"{name}_m"] = values
            else:
                columns[f"{name}_deg"] = np.degrees(values)
        for index, name in enumerate(self.moment_names):
            columns[f"{name}_moment_Nm"] = self.joint_moments[:, index]
        for name, energy in self.energy.items():
            columns[f"energy_{name}_J"] = energy
        columns["energy_closure_J"] = self.energy_closure
        return pd.DataFrame(columns)
