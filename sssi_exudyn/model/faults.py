"""What instruments get wrong, each fault one class: written once, seen by simulation, fit and diagnosis alike.

A fault of the capture moves what is simulated, one of the GPS or the insoles only what the instrument reports of it.
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
    """A fault of an instrument: its name in files, and where its formula comes from."""

    name: ClassVar[str]
    sources: ClassVar[tuple[str, ...]]


@dataclass(frozen=True)
class GpsSensor(Sensor):
    """A fault in the places that the GPS reports."""

    @abstractmethod
    def offset(self, time: Array) -> Array:
        """(n, 3) m, level frame: reported minus true place of fixes at ``time`` (n,) s."""


@dataclass(frozen=True)
class CaptureSensor(Sensor):
    """A fault of the motion capture, or of what is known of its mounting."""

    def yaw(self, time: Array) -> Array:
        """(n,) rad: by how much the whole capture has to be turned to the left at ``time`` (n,) s, a straight line."""
        return np.zeros(np.shape(time))

    def lever(self) -> Array:
        """(3,) m: the antenna's true place less the assumed one, in the frame of its segment."""
        return np.zeros(3)


@dataclass(frozen=True)
class InsoleSensor(Sensor):
    """A fault in the forces that the insoles report."""

    @abstractmethod
    def reading(self, sole: Array) -> Array:
        """(n, 2) N reported of the force square to the soles ``sole`` (n, 2) N, left and right."""


@dataclass(frozen=True)
class GpsJump(GpsSensor):
    """Fixes that are displaced for a while: a wrong ambiguity, a reflection.

    Formula: reported = true + (x, y)   for t0 ≤ t < t1
    """

    name: ClassVar[str] = "gps_jump"
    sources: ClassVar[tuple[str, ...]] = ("Teunissen, Montenbruck: Springer Handbook of GNSS (2017), ch. 23",)

    x: float = quantity(0.0, "m", low=-50.0, high=50.0, source=_CHOICE, meaning="displacement down the fall line")
    y: float = quantity(0.0, "m", low=-50.0, high=50.0, source=_CHOICE, meaning="displacement to the left")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it begins")
    t1: float = quantity(2.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it ends")

    def offset(self, time: Array) -> Array:
        inside = (time >= self.t0) & (time < self.t1)
        return np.where(inside[:, None], [self.x, self.y, 0.0], 0.0)


@dataclass(frozen=True)
class HeadingDrift(CaptureSensor):
    """A capture whose heading turns away slowly, as magnetometers disturbed by steel and gyroscopes do.

    Formula: yaw = rate·(t − t_ref)
    """

    name: ClassVar[str] = "heading_drift"
    sources: ClassVar[tuple[str, ...]] = ("Roetenberg et al., IEEE Trans. Neural Syst. Rehabil. Eng. 13 (2005) 395",)

    rate: float = quantity(0.0, "rad/s", low=-0.1, high=0.1, source=_CHOICE, meaning="turn a second, to the left")
    t_ref: float = quantity(0.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it is right")

    def yaw(self, time: Array) -> Array:
        return np.asarray(self.rate * (np.asarray(time) - self.t_ref))


@dataclass(frozen=True)
class LeverArm(CaptureSensor):
    """An antenna that does not sit where the recording has it.

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
    """Insoles whose calibration has gone, each by its own factor.

    Formula: reported = (1 + left, 1 + right)·true
    """

    name: ClassVar[str] = "insole_gain"
    sources: ClassVar[tuple[str, ...]] = ("Nakazato et al., Sports Biomech. 10 (2011) 326: errors to 40 % on skis",)

    left: float = quantity(0.0, "1", low=-0.9, high=2.0, source=_CHOICE, meaning="relative error of the left gain")
    right: float = quantity(0.0, "1", low=-0.9, high=2.0, source=_CHOICE, meaning="of the right gain")

    def reading(self, sole: Array) -> Array:
        return np.asarray(sole * [1.0 + self.left, 1.0 + self.right])


@dataclass(frozen=True)
class BootCuff(InsoleSensor):
    """A share of the load that the boot's cuff takes past the sole.

    Formula: reported = (1 − share)·true
    """

    name: ClassVar[str] = "boot_cuff"
    sources: ClassVar[tuple[str, ...]] = ("Nakazato et al., Sports Biomech. 10 (2011) 326: insoles read too little",)

    share: float = quantity(0.0, "1", low=-0.5, high=0.9, source=_CHOICE, meaning="share of the load in the cuff")

    def reading(self, sole: Array) -> Array:
        return np.asarray((1.0 - self.share) * sole)


SENSORS: Final[tuple[type[Sensor], ...]] = (GpsJump, HeadingDrift, LeverArm, InsoleGain, BootCuff)
"""The list of them, written out."""


def values_of(sensor: Sensor) -> dict[str, float]:
    """The declared numbers of a fault, by name."""
    return {name: getattr(sensor, name) for name in quantities(sensor)}


def read_sensor(name: str, values: Mapping[str, object], file: str | Path, place: str) -> Sensor:
    """The fault ``name`` with numbers as read from ``file`` at ``place``.

    Raises InputError for an unknown name, an unknown number, or one outside its bounds.
    """
    for cls in SENSORS:
        if cls.name == name:
            return build_checked(cls, values, file, place)
    known = [cls.name for cls in SENSORS]
    raise InputError(file, place, f"no sensor model is named {name!r}", did_you_mean(name, known))


def gps_offset(sensors: Iterable[Sensor], time: Array) -> Array:
    """(n, 3) m, level frame: what all GPS faults add to fixes at ``time`` (n,)."""
    total = np.zeros((len(time), 3))
    for sensor in sensors:
        if isinstance(sensor, GpsSensor):
            total = total + sensor.offset(time)
    return total


def antenna_shift(sensors: Iterable[Sensor]) -> Array:
    """(3,) m: the antenna's place less the assumed one, by all faults."""
    total = np.zeros(3)
    for sensor in sensors:
        if isinstance(sensor, CaptureSensor):
            total = total + sensor.lever()
    return total


def insole_readings(sensors: Iterable[Sensor], sole: Array) -> Array:
    """(n, 2) N that the insoles report of the forces ``sole`` (n, 2) square to the soles."""
    for sensor in sensors:
        if isinstance(sensor, InsoleSensor):
            sole = sensor.reading(sole)
    return sole
