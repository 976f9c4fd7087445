"""The yaw rate of each sensor against the course: an acceleration that points down, and rates in degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.few_sensors.attitude import attitude_of
from sssi_exudyn.recording.few_sensors.course import find_lag, velocity_of
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.imu import Imu

_FASTEST: Final = 8.0
"""Root mean square of a rate, rad/s, that nothing worn on a run reaches (460 °/s); in °/s, all sensors exceed it."""
_CLEAR: Final = 0.6
"""Correlation with the course from which on a sensor certainly turns with it."""
_BETTER: Final = 12.0
"""Logarithm of the likelihood by which the turned sensor has to be better: even turns fit half a turn later, too.
In 32 runs the wrong sign came out better by 8 at most (of 16 s).
"""


class SensorTurning:
    """Sensors whose acceleration points down at rest, as iPhones' does, and rates in degrees a second."""

    compares = "yaw rate of each sensor, by its rates and its vertical, with the turning of the course"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return corrections of the sensors; each carries those before it."""
        findings: list[Finding] = []
        for number, imu in enumerate(evidence.imus):
            size = float(np.sqrt(np.mean(np.sum(imu.rate**2, axis=1))))
            if size > _FASTEST:
                imu = replace(imu, rate=np.deg2rad(imu.rate))
                problem = f"its rates are {size:.0f} on average, which is no rad/s of a skier"
                evidence = _with(evidence, number, imu)
                findings.append(_corrected(evidence, number, problem, "taken as degrees a second"))
            if evidence.gps is None or imu.orientation is not None or imu.force is None:
                continue
            as_is, turned = turning_correlations(imu, evidence.gps)
            if turned > _CLEAR and _evidence(imu, evidence.gps, as_is, turned) > _BETTER:
                evidence = _with(evidence, number, replace(imu, force=-imu.force))
                problem = f"it turns against the course (correlation {as_is:.2f}), turned over with it ({turned:.2f})"
                fix = "the acceleration points down at rest: its sign was turned"
                findings.append(_corrected(evidence, number, problem, fix))
        return findings


def turning_correlations(imu: Imu, gps: Gps) -> tuple[float, float]:
    """Return the correlation of the course's turning with a sensor's yaw rate, and with that of its negative vertical.

    A negative acceleration makes up down: the yaw rate changes its sign.
    """
    attitude, velocity = attitude_of(imu), velocity_of(gps)
    try:
        lags = [find_lag(gps.time, velocity, imu.time, sign * attitude.yaw_rate) for sign in (1.0, -1.0)]
    except SssiError:  # hardly any fixes within the sensor's time, which is judged where they are joined
        return 0.0, 0.0
    return lags[0].correlation, lags[1].correlation


def _evidence(imu: Imu, gps: Gps, as_is: float, turned: float) -> float:
    """Return the logarithm of the likelihood of the turned sensor over the one as it is, a second a measurement."""
    inside = gps.time[(gps.time >= imu.time[0]) & (gps.time <= imu.time[-1])]
    count = min(len(inside), float(np.ptp(inside)))
    return 0.5 * count * float(np.log((1.0 - as_is**2) / max(1.0 - turned**2, 1e-6)))


def _with(evidence: Evidence, number: int, imu: Imu) -> Evidence:
    return replace(evidence, imus=(*evidence.imus[:number], imu, *evidence.imus[number + 1 :]))


def _corrected(evidence: Evidence, number: int, problem: str, done: str) -> Finding:
    path = evidence.files.get(f"sensors {number + 1}", evidence.toml)
    return Finding(path, evidence.imus[number].place, problem, done, sure=True, corrected=evidence)
