"""A ski from what is measured on it: density, stiffness and damping, each with its interval (paper 2.2.2).

The material is taken as homogeneous.  The shear modulus follows from a torsion test; without one the material is taken
as isotropic with ν = 0.3, and the shear modulus is E/(2(1 + ν)).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import curve_fit
from scipy.signal import detrend, hilbert
from scipy.stats import linregress
from scipy.stats import t as student

from sssi_exudyn.bodies.ski.bench_tests import Measurements
from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import modal_ski
from sssi_exudyn.bodies.ski.ski import Profile, Ski, SkiUncertainty, integrate_pieces
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array

ISOTROPIC_ERROR: Final = 0.3
"""Standard error, as a share, of a torsional stiffness that no test measured.

The catalogue's slalom ski, a layered one, is 28 % softer than an isotropic ski of its bending stiffness.
"""
OUTLINE_ERROR: Final = 0.015
"""Standard error, as a share, of the radius of a turn of a scanned ski.

The catalogue's slalom ski turned 0.5 to 1.8 % wider at 30 and 45 degrees with its widths as points 5 to 15 mm apart.
"""
_LARGEST_ERROR: Final = 0.5
"""Share; a ski's file holds no larger error."""
_SETTLING_PERIODS: Final = 3.0
"""Periods of the first bending after which the faster, more strongly damped ones have died out."""
_LEAST_POINTS: Final = 3
"""Points of a line from which an error can be estimated."""


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error and its 95 % interval."""

    value: float
    se: float
    low: float
    high: float


@dataclass(frozen=True)
class Line:
    """A straight line y = intercept + slope x through a test's points, with the slope's standard error."""

    intercept: float
    slope: float
    slope_se: float


@dataclass(frozen=True)
class Decay:
    """A free vibration from ``start`` (s) on: damping ratio, frequency (Hz), and amplitudes in the signal's unit."""

    start: float
    zeta: float
    hertz: float
    cosine: float
    sine: float
    rest: float

    def at(self, time: Array) -> Array:
        """Return the signal at ``time`` (n,) s."""
        return _vibration(time - self.start, self.zeta, self.hertz, self.cosine, self.sine, self.rest)


@dataclass(frozen=True)
class IdentifiedSki:
    """The ski, and the standard error of each number; ``damping_ratio`` is that of the tip's vibration.

    ``frequency`` (Hz) is the measured one of the tip's vibration; ``predicted_frequency`` that of the ski as
    identified, which no fit has seen: their difference tests homogeneity.  ``bending``, ``torsion`` and ``vibration``
    are the fits.

    Examples
    --------
    >>> identified = sssi_exudyn.identify("bench")
    >>> identified.ski, identified.young_modulus.se
    """

    ski: Ski
    density: Estimate
    young_modulus: Estimate
    damping_ratio: Estimate
    frequency: Estimate
    predicted_frequency: float
    shear_modulus: Estimate
    bending: Line
    torsion: Line | None
    vibration: Decay

    @property
    def estimates(self) -> tuple[tuple[str, Estimate, str], ...]:
        """Return name, value with interval, and unit of each number."""
        return (
            ("density", self.density, "kg/m^3"),
            ("young_modulus", self.young_modulus, "Pa"),
            ("shear_modulus", self.shear_modulus, "Pa"),
            ("damping_ratio", self.damping_ratio, "1"),
            ("frequency", self.frequency, "Hz"),
        )


def identify_ski(measured: Measurements) -> IdentifiedSki:
    """Identify density, Young's modulus and damping from the tests on one ski.

    Raises InputError when a test does not determine its number.
    """
    length = float(measured.scan_place[-1] - measured.scan_place[0])
    s = tuple(float(v) for v in (measured.scan_place - measured.scan_place[0]) / length)

    def profile(values: Array) -> Profile:
        return Profile(s, tuple(float(v) for v in values), ("linear",) * (len(s) - 1))

    blank = Ski(
        name=measured.name,
        source="identified from scan, weight, three-point bending"
        + (", torsion" if len(measured.moment) else "")
        + " and free vibration",
        width=profile(measured.width),
        thickness=profile(measured.thickness),
        height=profile(measured.height),
        length=length,
        boot_centre=measured.boot_centre,
        mass=measured.mass,
    )
    thicker = dataclasses.replace(blank, thickness=profile(measured.thickness + measured.thickness_sigma))
    volume, volume_up = (_volume(ski) for ski in (blank, thicker))
    density_se = math.hypot(measured.mass_sigma / volume, measured.mass / volume - measured.mass / volume_up)
    young, bending = _young_modulus(measured, blank, thicker)
    shear, torsion = _shear_modulus(measured, blank, thicker, young)
    stiff = dataclasses.replace(blank, young_modulus=young.value, shear_modulus=shear.value)
    frequency, damping, vibration = _decay(measured)
    modes = modal_ski(mesh(stiff), 2)
    tip = int(np.argmax(np.abs(modes.shape[:, -1, 2])))
    # Damping grows with frequency, and a ski's ratio is declared for the mean of its front and its back.
    ratio = damping.value * float(np.mean(modes.frequency) / modes.frequency[tip])
    errors = SkiUncertainty(
        # of the stiffness itself: the caliper's error is in the modulus and in the thickness, and cancels in EI and GJ
        bending=min(bending.slope_se / bending.slope, _LARGEST_ERROR),
        torsion=ISOTROPIC_ERROR if torsion is None else min(torsion.slope_se / torsion.slope, _LARGEST_ERROR),
        outline=OUTLINE_ERROR,
    )
    ski = dataclasses.replace(stiff, damping_ratio=ratio, uncertainty=errors)
    return IdentifiedSki(
        ski=ski,
        density=_interval(measured.mass / volume, density_se, math.inf),
        young_modulus=young,
        damping_ratio=damping,
        frequency=frequency,
        predicted_frequency=float(modes.frequency[tip]),
        shear_modulus=shear,
        bending=bending,
        torsion=torsion,
        vibration=vibration,
    )


def _volume(ski: Ski) -> float:
    area = integrate_pieces(ski, np.array([0.0, 1.0]), lambda s: ski.width(s) * ski.thickness(s)).item()
    return float(ski.length * area)


def _interval(value: float, se: float, freedom: float) -> Estimate:
    reach = float(student.ppf(0.975, freedom)) * se
    return Estimate(float(value), float(se), float(value - reach), float(value + reach))


def _young_modulus(measured: Measurements, ski: Ski, thicker: Ski) -> tuple[Estimate, Line]:
    """Return E and the test's line: the compliance of a ski of unit modulus over the slope of deflection against force.

    The errors of the slope and of the caliper, which enters with the cube of thickness, add up in quadrature.
    """
    line = _line(measured.force, measured.deflection, "[bending]", "deflection does not grow with force")
    freedom = len(measured.force) - 2
    unit, unit_up = (_unit_compliance(measured, blank) for blank in (ski, thicker))
    value = unit / line.slope
    se = math.hypot(value * line.slope_se / line.slope, (unit - unit_up) / line.slope)
    return _interval(value, se, freedom), line


def _line(x: Array, y: Array, place: str, problem: str) -> Line:
    """Fit a line to a test's points.  Raises InputError with ``problem`` where its slope is not above its error."""
    if len(x) < _LEAST_POINTS or np.ptp(x) == 0.0:
        raise InputError("bench.toml", place, f"{len(x)} points", f"measure {_LEAST_POINTS} or more, at several loads")
    line = linregress(x, y)
    if not line.slope > 2.0 * line.stderr:
        raise InputError("bench.toml", place, problem, "check columns and signs")
    return Line(float(line.intercept), float(line.slope), float(line.stderr))


def _shear_modulus(measured: Measurements, ski: Ski, thicker: Ski, young: Estimate) -> tuple[Estimate, Line | None]:
    """Return G and the line of the torsion test: ∫ dx/(GJ) at G = 1 over the slope of twist against moment.

    Without a test G is that of an isotropic material, and its error ``ISOTROPIC_ERROR``.
    """
    if not len(measured.moment):
        value = young.value / (2.0 * (1.0 + ski.poisson_ratio))
        return _interval(value, ISOTROPIC_ERROR * value, math.inf), None
    line = _line(measured.moment, measured.twist, "[torsion]", "twist does not grow with the moment")
    unit, unit_up = (_unit_twist(measured, blank) for blank in (ski, thicker))
    value = unit / line.slope
    se = math.hypot(value * line.slope_se / line.slope, (unit - unit_up) / line.slope)
    return _interval(value, se, len(measured.moment) - 2), line


def _unit_twist(measured: Measurements, ski: Ski) -> float:
    """Return the twist between clamp and moment times G (rad/(N m) · Pa)."""
    unit = dataclasses.replace(ski, shear_modulus=1.0)
    ends = np.array(sorted((measured.twist_clamp, measured.twist_load))) / ski.length
    return float(ski.length * integrate_pieces(unit, ends, lambda s: 1.0 / unit.torsional_stiffness(s)).sum())


def _unit_compliance(measured: Measurements, ski: Ski) -> float:
    """Return the deflection under the force times E (m/N · Pa), on two supports.

    For a unit force it is E ∫ M²/EI + V²/κGA dx.
    """
    unit = dataclasses.replace(ski, young_modulus=1.0)
    left, load, right = (place / ski.length for place in (measured.left, measured.load, measured.right))
    rear, front = (right - load) / (right - left), (load - left) / (right - left)

    def compliance(s: Array) -> Array:
        behind = s < load
        shear = np.where(behind, rear, -front)
        moment = ski.length * np.where(behind, rear * (s - left), front * (right - s))
        return np.asarray(moment**2 / unit.bending_stiffness(s) + shear**2 / unit.shear_stiffness(s))

    return float(ski.length * integrate_pieces(unit, np.array([left, load, right]), compliance).sum())


def _vibration(t: Array, zeta: float, hertz: float, cosine: float, sine: float, rest: float) -> Array:
    """Return a free vibration (any unit) at ``t`` (n,) s after its start."""
    omega = 2.0 * np.pi * hertz
    phase = omega * np.sqrt(1.0 - zeta**2) * t
    return np.asarray(np.exp(-zeta * omega * t) * (cosine * np.cos(phase) + sine * np.sin(phase)) + rest)


def _decay(measured: Measurements) -> tuple[Estimate, Estimate, Decay]:
    """Fit frequency (Hz) and damping ratio of the tip's free vibration, by least squares over its late part."""
    step = float(np.median(np.diff(measured.time)))
    even = np.arange(measured.time[0], measured.time[-1], step)
    wave = detrend(np.interp(even, measured.time, measured.signal), type="constant")
    spectrum = np.abs(np.fft.rfft(wave, 8 * len(wave)))
    peak = float(np.fft.rfftfreq(8 * len(wave), step)[np.argmax(spectrum[1:]) + 1])
    start = measured.time[0] + _SETTLING_PERIODS / peak
    late = measured.time > start
    t, y = measured.time[late] - start, measured.signal[late]
    if len(t) < 20 or t[-1] * peak < 3.0:
        raise InputError("bench.toml", "[vibration]", "too short to see a decay", "record at least ten periods")
    half = len(wave) // 2
    envelope = np.abs(hilbert(wave))[len(wave) // 10 : half]
    slope = np.polyfit(np.arange(len(envelope)) * step, np.log(envelope), 1)[0]
    guess = min(max(-slope / (2.0 * np.pi * peak), 0.002), 0.3)

    first = [guess, peak, y[0] - y[-1], 0.0, y[-1]]
    bounds = ([0.0, 0.5 * peak, *[-np.inf] * 3], [0.5, 1.5 * peak, *[np.inf] * 3])
    fitted, covariance = curve_fit(_vibration, t, y, p0=first, bounds=bounds)
    errors = np.sqrt(np.diag(covariance))
    if not fitted[0] > 2.0 * errors[0]:
        raise InputError("bench.toml", "[vibration]", "no decay can be seen", "check the columns and the recording")
    freedom = len(t) - len(fitted)
    decay = Decay(float(start), *(float(value) for value in fitted))
    return _interval(fitted[1], errors[1], freedom), _interval(fitted[0], errors[0], freedom), decay
