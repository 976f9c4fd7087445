"""The snow surface under a recorded run, from the heights of its fixes, those of other runs on the slope, and an
elevation model where there is one.

At every fix the antenna's height less the antenna's place above the loaded ski's edge, which the posture gives, is the
snow's height there.  An elevation model gives the heights' mean; what the snow leaves it by is estimated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pymap3d
from scipy.spatial import cKDTree

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array, slope_to_enu
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.noise import NOISE
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion, antenna_offset
from sssi_exudyn.recording.instruments.gps import Gps, enu_from
from sssi_exudyn.recording.recording import NEARBY, Elevations, Recording
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.terrain.elevation_model import open_elevations
from sssi_exudyn.terrain.from_heights import (
    HEIGHT,
    LEAST,
    Estimate,
    Heights,
    Noticed,
    estimate_surface,
    level_surface,
)
from sssi_exudyn.terrain.surface import Surface

BAROMETER: Final = (0.12, ExponentialNoise(4.5, 1000.0))
"""Of a barometer's heights: twice what is independent (m), and a wander of 0.2 m in a second, as a logger's show that
went down a glacier; it forgets in 1000 s, much longer than a run."""
_NOTICED: Final = 0.15
"""Of a fix's standard deviation: a movement of the whole track that small, by all modes left out, is not noticed."""
_NOTICED_LOAD: Final = 0.1
"""Of the insoles' noise: 2.5 N of the load, a third of what white readings at 50 Hz have in a tenth of a second.  Where
each mode left out had up to 0.07, they had 10 N together on even snow, more than that noise.
"""
_NOTICED_TILT: Final = 0.0015
"""rad; 0.6 mm from one ski to the other, of which insoles notice some millimetres."""
_LIFTED: Final = 0.03
"""m; of two skis the one higher than the other by much more than this is off the snow."""
_DATUM: Final = 10.0
"""m that an elevation model and a receiver with the same datum differ by at most."""
_ROUNDS: Final = 5
"""Places on the snow found by turns with its height there; on slopes below 0.3 each round leaves a tenth."""


def on_snow_surface(model: Model, recording: Recording, motion: Motion) -> Model:
    """Return the model on the surface that the fixes' heights show, or on the plane where there are too few heights or
    no fixes.  The surface has the modes that would move the track by more than the fixes are off.

    Raises InputError for an elevation model that cannot be used.
    """
    estimated = snow_surface(model, recording, motion)
    return model if estimated is None else replace(model, surface=estimated[0])


def snow_surface(model: Model, recording: Recording, motion: Motion) -> tuple[Surface, Heights] | None:
    """Return the surface of ``on_snow_surface`` and the heights that show it; None where it stays on the plane."""
    estimate = _estimate(model, recording, motion)
    if estimate is None:
        return None
    assert recording.gps is not None
    surface = estimate.estimate.surface(estimate.empty, _noticed(recording))
    return replace(surface, mean=surface.mean + estimate.ground), estimate.heights


def _noticed(recording: Recording) -> Noticed:
    """Return what a recording's instruments notice of the surface in addition to its heights."""
    assert recording.gps is not None
    return Noticed(
        _NOTICED * float(np.median(recording.gps.sigma)),
        np.inf if recording.gps.speed is None else _NOTICED * NOISE.speed.size,
        np.inf if recording.insoles is None else _NOTICED_LOAD * NOISE.load.size * GRAVITY,
        np.inf if recording.insoles is None else _NOTICED_TILT,
    )


@dataclass(frozen=True)
class SurfaceProcess:
    """The snow surface of a run as a process of which the heights are one measurement among others.

    amplitude : m, of the waves; they leave the plane by ``HEIGHT`` times as much
    surface : an estimate of it; the modes are those of before any height was known, the first two the plane's tilt
    ground : what an elevation model makes of it, or the level plane
    places : (p, 2) m along the run's path and around it
    measured : (m, 2) m of the heights, those of the run at hand first
    shaped : (m,) m, what the model's own terms made of the snow where heights are measured
    follow : (k, p) 1/m, how the modes' amounts follow from the surface's heights at ``places``
    smooth : (p, m), how these follow from the measured ones
    """

    amplitude: float
    surface: Surface
    ground: Surface
    places: Array
    measured: Array
    shaped: Array
    follow: Array
    smooth: Array

    def at(self, surface: Surface) -> SurfaceProcess:
        """Return the process where another estimate of it is; its nodes may be others, as a corrected posture moves
        them.
        """
        along = surface.at(self.places)[:, 0]
        amounts = self.follow @ (along - self.ground.at(self.places)[:, 0])
        heights = surface.at(self.surface.nodes())[:, 0].reshape(self.surface.mean.shape)
        first = surface.at(self.measured[:1])[0, 0]
        rest = heights - first - np.tensordot(amounts, self.surface.modes, axes=1)
        return replace(self, surface=replace(self.surface, mean=rest, amounts=tuple(amounts.tolist())))

    def estimated(self, model: Model) -> SurfaceProcess:
        """Return the process where the surface of ``model`` is, which has its modes."""
        assert model.surface is not None
        return replace(self, surface=model.surface, shaped=replace(model, surface=None).snow(self.measured)[0])

    def without_terms_of(self, model: Model) -> Surface:
        """Return the surface that the heights show apart from what the model's own terms make of the snow."""
        change = replace(model, surface=None).snow(self.measured)[0] - self.shaped
        amounts = np.array(self.surface.amounts) - self.follow @ self.smooth @ change
        return replace(self.surface, amounts=tuple(amounts.tolist()))


def surface_process(model: Model, recording: Recording, motion: Motion) -> SurfaceProcess | None:
    """Return the process about the slope's plane, or about the recording's elevation model; None without heights.

    Raises InputError for an elevation model that cannot be used.
    """
    estimate = _estimate(model, recording, motion)
    if estimate is None:
        return None
    surface, places, follow, smooth = estimate.estimate.process(estimate.empty, _noticed(recording))
    heights = estimate.estimate.heights
    surface, ground = (
        replace(surface, mean=surface.mean + estimate.ground),
        replace(estimate.empty, mean=estimate.ground),
    )
    shaped = replace(model, surface=None).snow(heights.all_places)[0]
    amplitude = estimate.estimate.amplitude
    return SurfaceProcess(amplitude, surface, ground, places, heights.all_places, shaped, follow, smooth)


@dataclass(frozen=True)
class _Found:
    """The surface's estimate from the heights over the ``ground`` (nf, nl) m at the nodes of ``empty``."""

    heights: Heights
    estimate: Estimate
    empty: Surface
    ground: Array


def _estimate(model: Model, recording: Recording, motion: Motion) -> _Found | None:
    if recording.gps is None:
        return None
    heights = snow_heights(recording.gps, motion, model)
    if len(heights.time) < LEAST:
        return None
    empty = level_surface(heights)
    others = (_heights_of_other(model, recording.gps, other, heights) for other in recording.runs)
    heights = replace(heights, others=tuple(other for other in others if len(other.time) > 0))
    if recording.elevations is None:
        return _Found(heights, estimate_surface(heights), empty, np.zeros(empty.mean.shape))
    ground, *along = _ground(model, recording.gps, recording.elevations, heights, empty)
    over = [replace(run, height=run.height - z) for run, z in zip((heights, *heights.others), along, strict=True)]
    estimate = estimate_surface(replace(over[0], others=tuple(over[1:])), recording.elevations.sigma / HEIGHT)
    return _Found(heights, estimate, empty, ground - along[0][0])


def _heights_of_other(model: Model, gps: Gps, other: Recording, heights: Heights) -> Heights:
    """Return the snow's heights at another run's fixes near the places of ``heights``, in the slope frame of the run
    whose fixes are ``gps``.

    What both receivers' heights differ by is taken out first: it would shift the places along the slope.
    """
    assert other.gps is not None
    motion = motion_from_recording(other)
    theirs = model_of(other, motion)
    seen = snow_heights(other.gps, motion, theirs)
    to_enu, to_slope = (slope_to_enu(run.inclination, run.fall_line_azimuth).T for run in (theirs, model))
    enu = enu_from(np.column_stack([seen.places, seen.height]) @ to_enu, other.gps.origin, gps.origin)
    way = cKDTree(heights.places)
    for _ in range(_ROUNDS):
        snow = enu @ to_slope.T
        snow[:, 2] -= replace(model, surface=None).snow(snow)[0]
        distance, nearest = way.query(snow[:, :2])
        near = distance <= NEARBY
        if not np.any(near):
            break
        apart = float(np.median((snow[:, 2] - heights.height[nearest])[near]))
        enu[:, 2] -= apart / np.cos(model.inclination)
    return replace(seen, time=seen.time[near], places=snow[near, :2], height=snow[near, 2], sigma=seen.sigma[near])


def _ground(model: Model, gps: Gps, elevations: Elevations, heights: Heights, empty: Surface) -> tuple[Array, ...]:
    """Return the elevation model's heights (m) over the slope's plane: (nf, nl) at the nodes of ``empty``, and (n,) at
    the places of each run's heights, the run at hand first.
    """
    count = len(heights.time)
    to_enu = slope_to_enu(model.inclination, model.fall_line_azimuth).T
    with open_elevations(elevations.path, elevations.crs) as sample:

        def over_ground(places: Array, height: Array) -> Array:
            """Return how far (n,) m, straight up, places (n, 2) at heights (n,) over the slope's plane are above the
            elevation model.  The first places, those of the fixes, have to be covered.
            """
            enu = np.column_stack([places, height]) @ to_enu
            latitude, longitude, above = pymap3d.enu2geodetic(*enu.T, *gps.origin)
            return np.asarray(above - sample(np.asarray(latitude), np.asarray(longitude), count))

        apart = float(np.median(over_ground(heights.places, heights.height))) - elevations.geoid_height
        if elevations.same_datum and abs(apart) > _DATUM:
            raise InputError(
                elevations.path,
                "",
                f"its heights are {abs(apart):.1f} m {'below' if apart > 0.0 else 'above'} the fixes'",
                'write [terrain] datum = "other", or give heights over the ellipsoid',
            )
        # heights that count from elsewhere would also shift the ground along the slope
        lift = elevations.geoid_height + apart
        places = np.concatenate([heights.all_places, empty.nodes()])
        ground = np.zeros(len(places))
        for _ in range(_ROUNDS):
            ground += (lift - over_ground(places, ground)) * np.cos(model.inclination)
    ends = np.cumsum([len(run.time) for run in (heights, *heights.others)])
    *along, nodes = np.split(ground, ends)
    return nodes.reshape(empty.mean.shape), *along


def snow_heights(gps: Gps, motion: Motion, model: Model) -> Heights:
    """Return the snow's heights at the fixes within the motion, over the slope's plane or over what the model's terms
    make of it.

    Raises ValueError for a motion without an antenna.
    """
    inside = gps.between(motion.start, motion.stop)
    time = gps.time[inside]
    parts = Parts(model, correct_motion(model, motion))
    posture = parts.movement(time)
    antenna = gps.enu[inside] @ slope_to_enu(model.inclination, model.fall_line_azimuth)
    edges = antenna[:, None] - antenna_offset(parts.motion, time)[0][:, None] + posture.foot_place
    edges[..., 2] -= _edge_below_middle(parts, posture.foot_rotation)
    higher = edges[..., 2] - edges[..., 2].min(axis=1, keepdims=True)
    share = np.exp(-higher / _LIFTED)
    share /= share.sum(axis=1, keepdims=True)
    snow = np.sum(share[..., None] * edges, axis=1)
    height = snow[:, 2] - replace(model, surface=None).snow(snow)[0]
    sigma = NOISE.height.size * gps.vertical * gps.sigma[inside]
    noise = ExponentialNoise(float(np.median(sigma)), NOISE.height.memory)
    if gps.barometric:
        independent, noise = BAROMETER
        sigma = np.full(len(time), independent)
    return Heights(time, snow[:, :2], height, sigma, noise)


def _edge_below_middle(parts: Parts, rotation: Array) -> Array:
    """Return by how much (n, 2) m a ski's lower edge is below the middle of its base, from the feet's rotations (n, 2,
    3, 3).
    """
    ski = parts.model.ski
    half = 0.5 * float(ski.width(ski.s_of_x(0.0)))
    return np.asarray(half * np.abs(rotation[..., 2, 1]))
