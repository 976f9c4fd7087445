"""Faults of instruments, one class per fault: written once and used by simulation, fit and diagnosis alike.

A fault of the capture changes the simulated motion; a fault of the GPS or the insoles changes only their readings.
A late GPS clock and a misaligned capture are numbers that every model has: ``start.clock_offset`` and
``start.heading_offset``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import build_checked, quantities, quantity
from sssi_exudyn.core.text import did_you_mean

_CHOICE: Final = "chosen: beyond what instruments in working order show"


@dataclass(frozen=True)
class Sensor(ABC):
    """A fault of an instrument, with its name in files and the source of its formula."""

    name: ClassVar[str]
    sources: ClassVar[tuple[str, ...]]


@dataclass(frozen=True)
class GpsSensor(Sensor):
    """A fault in the places that the GPS reports."""

    @abstractmethod
    def offset(self, time: Array) -> Array:
        """Return the reported minus the true place (n, 3) m, level frame, of fixes at ``time`` (n,) s."""


@dataclass(frozen=True)
class CaptureSensor(Sensor):
    """A fault of the motion capture, or an error in its stated mounting."""

    def yaw(self, time: Array) -> Array:
        """Return the angle (n,) rad by which the whole capture has to be turned to the left at ``time`` (n,) s.

        It is a straight line in time.
        """
        return np.zeros(np.shape(time))

    def lever(self) -> Array:
        """Return the antenna's true place less the assumed one, (3,) m, in the frame of its segment."""
        return np.zeros(3)


@dataclass(frozen=True)
class InsoleSensor(Sensor):
    """A fault in the forces that the insoles report."""

    def reading(self, sole: Array) -> Array:
        """Return the reported forces (n, 2) N for the forces ``sole`` (n, 2) N square to the soles, left and right."""
        return sole

    def lateness(self) -> float:
        """Return by how much (s) later than the capture's clock the readings are stamped."""
        return 0.0


@dataclass(frozen=True)
class GpsJump(GpsSensor):
    """Fixes that are displaced for a while: at once by a wrong ambiguity, or gradually by a reflection.

    Formula: reported = true + (x, y)·½(1 − cos(π·min(1, 2s/rise)))   s = min(t − t0, t1 − t)/(t1 − t0)
    for t0 ≤ t < t1; with rise = 0 it is a step, reported = true + (x, y)
    """

    name: ClassVar[str] = "gps_jump"
    sources: ClassVar[tuple[str, ...]] = (
        "Teunissen, Montenbruck: Springer Handbook of GNSS (2017), ch. 15 (multipath) and 23 (ambiguities)",
    )

    x: float = quantity(0.0, "m", low=-50.0, high=50.0, source=_CHOICE, meaning="displacement down the fall line")
    y: float = quantity(0.0, "m", low=-50.0, high=50.0, source=_CHOICE, meaning="displacement to the left")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="time at which it begins")
    t1: float = quantity(2.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="time at which it ends")
    rise: float = quantity(
        0.0, "1", low=0.0, high=1.0, source="chosen", meaning="share of its time in which it comes and goes"
    )

    def share(self, time: Array) -> Array:
        """Return the share (n,) of (x, y) by which fixes at ``time`` (n,) s are displaced."""
        inside = (time >= self.t0) & (time < self.t1)
        if np.real(self.rise) <= 0.0:
            return inside.astype(np.float64)
        done = (time - self.t0) / (self.t1 - self.t0)
        way = np.minimum(2.0 * np.minimum(done, 1.0 - done) / self.rise, 1.0)
        return np.where(inside, 0.5 * (1.0 - np.cos(np.pi * way)), 0.0)

    def offset(self, time: Array) -> Array:
        return np.asarray(self.share(time)[:, None] * [self.x, self.y, 0.0])


@dataclass(frozen=True)
class HeadingDrift(CaptureSensor):
    """A capture whose heading slowly turns away, as that of gyroscopes and of magnetometers disturbed by steel does.

    Formula: yaw = rate·(t − t_ref)
    """

    name: ClassVar[str] = "heading_drift"
    sources: ClassVar[tuple[str, ...]] = ("Roetenberg et al., IEEE Trans. Neural Syst. Rehabil. Eng. 13 (2005) 395",)

    rate: float = quantity(0.0, "rad/s", low=-0.1, high=0.1, source=_CHOICE, meaning="turn per second, to the left")
    t_ref: float = quantity(
        0.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="time at which the heading is right"
    )

    def yaw(self, time: Array) -> Array:
        return np.asarray(self.rate * (np.asarray(time) - self.t_ref))


@dataclass(frozen=True)
class LeverArm(CaptureSensor):
    """An antenna that does not sit at its assumed place.

    Formula: place = assumed + (forward, left, up)   in the frame of the segment that carries it
    """

    name: ClassVar[str] = "lever_arm"
    sources: ClassVar[tuple[str, ...]] = ("geometry",)

    forward: float = quantity(0.0, "m", low=-1.5, high=1.5, source=_CHOICE, meaning="further forward than assumed")
    left: float = quantity(0.0, "m", low=-1.5, high=1.5, source=_CHOICE, meaning="further left")
    up: float = quantity(0.0, "m", low=-1.5, high=1.5, source=_CHOICE, meaning="further up")

    def lever(self) -> Array:
        return np.array([self.forward, self.left, self.up])


@dataclass(frozen=True)
class InsoleGain(InsoleSensor):
    """Insoles with wrong calibrations, each by its own factor.

    Formula: reported = (1 + left, 1 + right)·true
    """

    name: ClassVar[str] = "insole_gain"
    sources: ClassVar[tuple[str, ...]] = ("Nakazato et al., Sports Biomech. 10 (2011) 326: errors to 40 % on skis",)

    left: float = quantity(0.0, "1", low=-0.9, high=2.0, source=_CHOICE, meaning="relative error of the left gain")
    right: float = quantity(0.0, "1", low=-0.9, high=2.0, source=_CHOICE, meaning="relative error of the right gain")

    def reading(self, sole: Array) -> Array:
        return np.asarray(sole * [1.0 + self.left, 1.0 + self.right])


@dataclass(frozen=True)
class BootCuff(InsoleSensor):
    """A share of the load that goes through the boot's cuff and not through the sole.

    Formula: reported = (1 − share)·true
    """

    name: ClassVar[str] = "boot_cuff"
    sources: ClassVar[tuple[str, ...]] = ("Nakazato et al., Sports Biomech. 10 (2011) 326: insoles read too little",)

    share: float = quantity(0.0, "1", low=-0.5, high=0.9, source=_CHOICE, meaning="share of the load in the cuff")

    def reading(self, sole: Array) -> Array:
        return np.asarray((1.0 - self.share) * sole)


@dataclass(frozen=True)
class InsoleOffset(InsoleSensor):
    """Insoles whose zero has drifted, as it does with warmth and with buckles that were opened since it was set.

    Formula: reported = true + (left, right)
    """

    name: ClassVar[str] = "insole_offset"
    sources: ClassVar[tuple[str, ...]] = (
        "Hurkmans et al., J. Biomech. 39 (2006) 110: insoles' zero drifts within hours",
    )

    left: float = quantity(0.0, "N", low=-600.0, high=600.0, source=_CHOICE, meaning="what the left reads unloaded")
    right: float = quantity(0.0, "N", low=-600.0, high=600.0, source=_CHOICE, meaning="what the right reads unloaded")

    def reading(self, sole: Array) -> Array:
        return np.asarray(sole + [self.left, self.right])


@dataclass(frozen=True)
class InsoleDelay(InsoleSensor):
    """Insoles whose clock is late against the capture's, as one is that was aligned by hand.

    Formula: reported(t) = true(t − late)
    """

    name: ClassVar[str] = "insole_delay"
    sources: ClassVar[tuple[str, ...]] = ("geometry",)

    late: float = quantity(0.0, "s", low=-0.25, high=0.25, source=_CHOICE, meaning="how late a reading is stamped")

    def lateness(self) -> float:
        return self.late


SENSORS: Final[tuple[type[Sensor], ...]] = (
    GpsJump,
    HeadingDrift,
    LeverArm,
    InsoleGain,
    BootCuff,
    InsoleOffset,
    InsoleDelay,
)
"""List of all faults, written out."""


def values_of(sensor: Sensor) -> dict[str, float]:
    """Return the declared numbers of a fault, by name."""
    return {name: getattr(sensor, name) for name in quantities(sensor)}


def read_sensor(name: str, values: Mapping[str, object], file: str | Path, place: str) -> Sensor:
    """Return the fault ``name`` with the numbers read from ``file`` at ``place``.

    Raises InputError for an unknown name, an unknown number, or one outside its bounds.
    """
    for cls in SENSORS:
        if cls.name == name:
            return build_checked(cls, values, file, place)
    known = [cls.name for cls in SENSORS]
    raise InputError(file, place, f"no sensor model is named {name!r}", did_you_mean(name, known))


def gps_offset(sensors: Iterable[Sensor], time: Array) -> Array:
    """Return the sum (n, 3) m, level frame, that all GPS faults add to fixes at ``time`` (n,)."""
    total = np.zeros((len(time), 3))
    for sensor in sensors:
        if isinstance(sensor, GpsSensor):
            total = total + sensor.offset(time)
    return total


def antenna_shift(sensors: Iterable[Sensor]) -> Array:
    """Return the antenna's place less the assumed one, (3,) m, by all faults."""
    total = np.zeros(3)
    for sensor in sensors:
        if isinstance(sensor, CaptureSensor):
            total = total + sensor.lever()
    return total


def insole_lateness(sensors: Iterable[Sensor]) -> float:
    """Return by how much (s) later than the capture's clock the insoles' readings are stamped, by all faults."""
    return sum((sensor.lateness() for sensor in sensors if isinstance(sensor, InsoleSensor)), 0.0)


def insole_readings(sensors: Iterable[Sensor], sole: Array) -> Array:
    """Return the insoles' readings (n, 2) N of the forces ``sole`` (n, 2) square to the soles."""
    for sensor in sensors:
        if isinstance(sensor, InsoleSensor):
            sole = sensor.reading(sole)
    return sole
