"""Properties of the benchmark's world that the diagnosis cannot know, drawn for each case.

Everything here stays when an effect is taken out again, so that its consequences are not mixed with other errors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array, level_to_enu
from sssi_exudyn.core.noise import ExponentialNoise, draw_noise
from sssi_exudyn.core.number_ref import DAMPING, EPS, EXPONENTS, MU_N, MU_T, SLIP, STIFFNESS, NumberRef
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.observations import INTERVAL, Measurements, predict_fixes
from sssi_exudyn.model.faults import insole_lateness, insole_readings
from sssi_exudyn.model.from_recording import first_guess
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.terrain.surface import Surface, surface_over
from sssi_exudyn.validation.benchmark.concealed_terms import DragOfPosture

STEP: Final = 0.004
"""s; the diagnosis' full model takes longer steps, its reduced model others."""
_ELEMENTS: Final = 20
"""Number of beam elements of a ski: half the time of 50, for 3 mm of the track."""
_MASS, _SLOPE, _DRAG, _SKI, _BOOT_CENTRE = 0.03, np.radians(0.5).item(), 0.15, 0.1, 0.01
"""Standard deviations: shares of mass, drag and the ski's stiffnesses, rad of the slope, m of the boot centre."""
_LIFT = 0.15, 0.1
"""Mean and standard deviation of lift coefficients: lift areas of 0.03 to 0.14 m²."""
_ONSET, _DAMPING, _EXPONENT = 0.6, 0.5, 0.1
"""Standard deviations: logarithms of friction's onset and of the snow's damping, and its exponents."""
_WAVES: Final = 12
_LENGTHS: Final = (8.0, 60.0)
"""m; lengths of the snow's waves."""
STEEPNESS: Final = (0.002, 0.012)
"""Root mean square slope of all waves together, from a groomed to a natural slope: heights of 1 to 10 cm."""
_MARGIN: Final = 40.0
"""m of snow around the start, and a metre more for each tenth of a second downhill."""
_JOINT, _JOINT_WANDER = np.radians(0.4).item(), np.radians(0.2).item()
"""rad of error of each joint of the capture: a foot is then 0.7 to 1° wrong, as with inertial suits."""
_WANDER: Final = 2.0
"""s over which the errors of the capture vary."""
_CLOCK: Final = ExponentialNoise(0.001, 10.0)
"""s; variation of the receiver's clock against the suit's: crystals that differ by 20 ppm and warm up."""
_FLOAT: Final = 0.25
"""m; standard deviation stated by the receiver while it has lost its fixed solution."""
_CELLS: Final = 12.0
"""N of noise of an insole's reading, white at 50 Hz."""
_ZERO, _STAMP = 8.0, 0.005
"""N that an insole reads unloaded, and s by which its clock is off, as standard deviations."""
_RATE: Final = 50.0


@dataclass(frozen=True)
class Instruments:
    """Quality of the instruments of a case.

    gps : noise of a fix;  outliers : share of single fixes that are far off
    lost : s, begin and end of a spell without a fixed solution, with its error (3,) m; None for none
    cuff : share of the load past the soles, on the cuffs
    gains, zeros : (2,) of the insoles, 1 and N;  late : s of the insoles' clock
    joints, wander : rad of error of each joint, constant and varying
    """

    gps: ExponentialNoise
    outliers: float
    lost: tuple[float, float, Array] | None
    cuff: float
    gains: Array
    zeros: Array
    late: float
    joints: float
    wander: float

    def levels(self, measurements: Measurements) -> NoiseLevels:
        """Return their noise in the form of the evidence."""
        load = float(np.sqrt(2.0) * _CELLS / np.sqrt(_RATE * INTERVAL))
        reading = ExponentialNoise(load, 1.0 / _RATE)
        height = ExponentialNoise(1.3 * self.gps.sigma, self.gps.correlation_time)
        return replace(measurements.usual, gps=self.gps, height=height, load=reading, difference=reading)


def draw_instruments(rng: np.random.Generator, motion: Motion) -> Instruments:
    """Draw instruments of usual quality; half of the receivers have outliers, a third lose their fix for a while."""
    begin = float(rng.uniform(motion.start, motion.stop - 2.5))
    lost = begin, begin + float(rng.uniform(1.5, 2.5)), rng.normal(0.0, 0.6 * _FLOAT, 3)
    of_insoles = rng.spawn(1)[0]  # so that a seed has the cases that it had without
    return Instruments(
        gps=ExponentialNoise(0.02 * float(np.exp(rng.normal(0.0, 0.2))), float(rng.uniform(2.0, 5.0))),
        outliers=0.02 * float(rng.integers(2)),
        lost=lost if rng.uniform() < 1.0 / 3.0 else None,
        cuff=float(rng.normal(0.06, 0.01)),
        gains=1.0 + rng.normal(0.0, 0.01, 2),
        joints=_JOINT * float(np.exp(rng.normal(0.0, 0.3))),
        wander=_JOINT_WANDER * float(np.exp(rng.normal(0.0, 0.3))),
        zeros=of_insoles.normal(0.0, _ZERO, 2),
        late=float(of_insoles.normal(0.0, _STAMP)),
    )


def other_day(
    rng: np.random.Generator, recording: Recording, motion: Motion, fitted: Model,
    steepness: tuple[float, float] = STEEPNESS,
) -> tuple[Model, Motion]:  # fmt: skip
    """Draw a skier and his movement who weighs other than stated, on other snow, skis and slope.

    He starts where the movement does, as in the recording.  The waves of the snow have a root mean square slope between
    the two of ``steepness``.
    """
    assert recording.gps is not None
    inclination = fitted.inclination + float(rng.normal(0.0, _SLOPE))
    motion = replace(motion, inclination=inclination)
    start = first_guess(recording.gps, motion, inclination, fitted.fall_line_azimuth)
    skier = replace(fitted.skier, mass=fitted.skier.mass * (1.0 + float(rng.normal(0.0, _MASS))))
    ski = replace(
        fitted.ski,
        young_modulus=fitted.ski.young_modulus * float(np.exp(rng.normal(0.0, _SKI))),
        shear_modulus=fitted.ski.shear_modulus * float(np.exp(rng.normal(0.0, _SKI))),
        boot_centre=fitted.ski.boot_centre + float(rng.normal(0.0, _BOOT_CENTRE)),
    )
    mu_t = fitted.friction.mu_t + float(rng.uniform(-0.02, 0.03))
    mu_n = fitted.friction.mu_n * float(rng.uniform(0.95, 1.1))
    posture: tuple[Term, ...] = (
        DragOfPosture(float(rng.normal(0.0, 0.05)), float(rng.uniform(2.0, 5.0)), float(rng.uniform(0.0, 2.0 * np.pi))),
    )
    model = replace(
        fitted, inclination=inclination, skier=skier, ski=ski, start=start, terms=(*fitted.terms, *posture),
        surface=draw_hill(rng, start.f, start.l, motion.stop - motion.start, steepness),
        solver=replace(fitted.solver, step=STEP, elements=_ELEMENTS),
    )  # fmt: skip
    drag = NumberRef("air.c_d")
    numbers = {
        MU_T: max(mu_t, 0.02),
        MU_N: min(mu_n, 0.95),
        STIFFNESS: model.value(STIFFNESS) * float(np.exp(rng.normal(0.0, 0.15))),
        drag: model.value(drag) * (1.0 + float(rng.normal(0.0, _DRAG))),
    }
    # generators of their own: other draws of a case stay as they are
    of_snow, of_air = rng.spawn(2)
    lift = {NumberRef("air.c_l"): float(of_air.normal(*_LIFT))}
    return model.with_values(numbers | lift | _draw_snow(of_snow, model)), motion


def _draw_snow(rng: np.random.Generator, model: Model) -> dict[NumberRef, float]:
    """Draw how friction builds up, by slip speed or by slip angle, and how the snow resists penetration."""
    by_angle = bool(rng.integers(2))
    onset = {EPS: 0.02, SLIP: 0.015} if by_angle else {EPS: 0.1}
    factors = {name: value * float(np.exp(rng.normal(0.0, _ONSET))) for name, value in onset.items()}
    factors[DAMPING] = model.value(DAMPING) * float(np.exp(rng.normal(0.0, _DAMPING)))
    exponents = {name: model.value(name) + float(rng.normal(0.0, _EXPONENT)) for name in EXPONENTS}
    return factors | exponents


def draw_hill(
    rng: np.random.Generator,
    f: float,
    l: float,  # noqa: E741
    long: float,
    steepness: tuple[float, float],
) -> Surface:
    """Draw waves of all lengths and directions around and below a start (m), for so ``long`` (s).

    Their root mean square slope is between the two given ones.
    """
    corners = np.array([[f - _MARGIN, l - _MARGIN], [f + _MARGIN + 10.0 * long, l + _MARGIN]])
    level = surface_over(corners, 1.0, 0.0)
    slope = float(np.exp(rng.uniform(*np.log(steepness))))
    heights = np.zeros(len(level.nodes()))
    for _ in range(_WAVES):
        k = 2.0 * np.pi / float(np.exp(rng.uniform(*np.log(_LENGTHS))))
        turn, phase = float(rng.uniform(-np.pi / 3.0, np.pi / 3.0)), float(rng.uniform(0.0, 2.0 * np.pi))
        amplitude = float(rng.normal(0.0, slope * np.sqrt(2.0 / _WAVES))) / k
        heights += amplitude * np.sin(k * (level.nodes() @ [np.cos(turn), np.sin(turn)]) + phase)
    return replace(level, mean=heights.reshape(level.mean.shape))


def record_gps(
    rng: np.random.Generator, recording: Recording, world: Model, time: Array, antenna: Array, motion: Motion,
    instruments: Instruments,
) -> Gps:  # fmt: skip
    """Record fixes at 10 Hz, whose receiver states 2 cm."""
    assert recording.gps is not None
    fixes = np.arange(motion.start, motion.stop, 0.1)
    place = predict_fixes(world, time, antenna, fixes + draw_noise(rng, fixes, _CLOCK))
    for axis, factor in enumerate((1.0, 1.0, 1.3)):
        noise = replace(instruments.gps, sigma=factor * instruments.gps.sigma)
        place[:, axis] += draw_noise(rng, fixes, noise)
    far, turn = rng.uniform(0.2, 0.6, len(fixes)), rng.uniform(0.0, 2.0 * np.pi, len(fixes))
    off = rng.uniform(size=len(fixes)) < instruments.outliers
    place[:, :2] += (off * far)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    sigma = np.full(len(fixes), 0.02)
    if instruments.lost is not None:
        begin, end, error = instruments.lost
        lost = (fixes >= begin) & (fixes < end)
        place[lost] += error
        sigma[lost] = _FLOAT
    enu = place @ level_to_enu(world.fall_line_azimuth).T
    return replace(recording.gps, time=fixes, enu=enu, sigma=sigma, speed=None, course=None)


def record_insoles(
    rng: np.random.Generator, recording: Recording, world: Model, time: Array, sole: Array, motion: Motion,
    instruments: Instruments,
) -> Insoles | None:  # fmt: skip
    """Record the insoles' readings, at 50 Hz; None where the recording has none."""
    if recording.insoles is None:
        return None
    times = np.arange(motion.start, time[-1], 1.0 / _RATE)
    at = times - insole_lateness(world.sensors) - instruments.late
    forces = insole_readings(world.sensors, np.stack([np.interp(at, time, s) for s in sole.T], axis=1))
    readings = (1.0 - instruments.cuff) * instruments.gains * forces + instruments.zeros
    readings += rng.normal(0.0, _CELLS, forces.shape)
    readings = np.maximum(readings, 0.0)
    cells = np.zeros((len(times), 0))
    return replace(
        recording.insoles, time=times, left=readings[:, 0], right=readings[:, 1], left_cells=cells, right_cells=cells
    )


def record_capture(rng: np.random.Generator, motion: Motion, heading: float, instruments: Instruments) -> Motion:
    """Record the movement by a capture with errors in every joint, turned by ``heading`` (rad)."""
    time = np.arange(motion.start - 0.2, motion.stop + 0.2, 1.0 / 60.0)
    time = time[(time >= motion.knots[0]) & (time <= motion.knots[-1])]
    angles, _, _ = motion.evaluate(time)
    knots = np.linspace(time[0], time[-1], max(4, round((time[-1] - time[0]) / _WANDER) + 1))
    smooth = np.ones(25) / 25.0
    for column in range(angles.shape[1]):
        error = rng.normal(0.0, instruments.joints)
        error = error + np.interp(time, knots, rng.normal(0.0, instruments.wander, len(knots)))
        angles[:, column] += np.convolve(np.pad(error, 12, mode="edge"), smooth, mode="valid")
    angles[:, PRESCRIBED.index("pelvis_rotation")] -= heading
    captured = spline_motion(motion.geometry, motion.inclination, time, angles)
    return replace(captured, antenna=motion.antenna, round_trip=motion.round_trip, start=motion.start, stop=motion.stop)
