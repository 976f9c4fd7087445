"""The yaw rate of each sensor against the course: an acceleration that points down, and rates in degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.few_sensors.attitude import attitude_of
from sssi_exudyn.recording.few_sensors.course import Lag, find_lag, velocity_of
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.imu import Imu

_FASTEST: Final = 8.0
"""Root mean square of a rate, rad/s, that nothing worn on a run reaches (460 °/s); in °/s, all sensors exceed it."""
_CLEAR: Final = 0.6
"""Correlation with the course from which on a sensor certainly turns with it."""
_BETTER: Final = 8.0
"""Logarithm of the probability by which the turned sensor has to be better: even turns fit half a turn later, too.
In 32 runs from the field the wrong sign came out better by 5.4 at most.
"""
_USUAL_LAG: Final = (1.2, 0.9)
"""Lag of a telephone's fixes, s, and its standard deviation; it is 1.1 to 2.0 s in most runs, and 0 of other receivers.
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
            lags = turning_lags(imu, evidence.gps)
            if lags is None:
                continue
            as_is, turned = (lag.correlation for lag in lags)
            if turned > _CLEAR and evidence_of_turned(imu, evidence.gps, *lags) > _BETTER:
                evidence = _with(evidence, number, replace(imu, force=-imu.force))
                problem = f"it turns against the course (correlation {as_is:.2f}), turned over with it ({turned:.2f})"
                fix = "the acceleration points down at rest: its sign was turned"
                findings.append(_corrected(evidence, number, problem, fix))
        return findings


def turning_lags(imu: Imu, gps: Gps) -> tuple[Lag, Lag] | None:
    """Return how the course turns with a sensor's yaw rate, and with that of its negative vertical; None without fixes.

    A negative acceleration makes up down: the yaw rate changes its sign.
    """
    attitude, velocity = attitude_of(imu), velocity_of(gps)
    try:
        as_is, turned = (find_lag(gps.time, velocity, imu.time, sign * attitude.yaw_rate) for sign in (1.0, -1.0))
    except SssiError:  # hardly any fixes within the sensor's time, which is judged where they are joined
        return None
    return as_is, turned


def evidence_of_turned(imu: Imu, gps: Gps, as_is: Lag, turned: Lag) -> float:
    """Return the logarithm of the probability of the turned sensor over the one as it is.

    A second counts as one measurement of the turning, and the usual lag of a receiver as one more.
    """
    inside = gps.time[gps.between(imu.time[0], imu.time[-1])]
    count = min(len(inside), float(np.ptp(inside)))
    left, left_turned = (max(1.0 - lag.correlation**2, 1e-6) for lag in (as_is, turned))
    middle, sigma = _USUAL_LAG
    off, off_turned = (0.5 * ((lag.value - middle) / sigma) ** 2 for lag in (as_is, turned))
    return 0.5 * count * float(np.log(left / left_turned)) + off - off_turned


def _with(evidence: Evidence, number: int, imu: Imu) -> Evidence:
    return replace(evidence, imus=(*evidence.imus[:number], imu, *evidence.imus[number + 1 :]))


def _corrected(evidence: Evidence, number: int, problem: str, done: str) -> Finding:
    path = evidence.files.get(f"sensors {number + 1}", evidence.toml)
    return Finding(path, evidence.imus[number].place, problem, done, sure=True, corrected=evidence)
