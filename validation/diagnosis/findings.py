"""What a diagnosis found, as data, and as ``diagnosis.json`` holds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.diagnosis.evidence import Account, NoiseLevels
from sssi_exudyn.validation.diagnosis.hypothesis import Scene
from sssi_exudyn.validation.diagnosis.missing_force import MissingForce
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.search import Round
from sssi_exudyn.validation.measurements import Measurements

STANDS_OUT: Final = 0.2
"""Probability of nothing missing above which nothing is said to be missing."""
SURE: Final = 0.8
"""Probability from which one name is said alone."""
WORTH_NAMING: Final = 0.02
PHASES: Final = ("initiation", "control", "completion")


@dataclass(frozen=True)
class Figures:
    """One model against the recording: mean horizontal errors (m), χ² per degree of freedom, memory of what is left.

    whiteness : correlation of neighbours in the whitened residual; 0 for what is only noise
    """

    trajectory_error: float
    held_out_error: float
    chi2_per_dof: float
    whiteness: float


@dataclass(frozen=True)
class Number:
    """A parameter with its 90 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Where:
    """When (s, recording's clock), on which metres of the path, in which phases of turns."""

    t0: float
    t1: float
    distance: tuple[float, float]
    phases: tuple[str, ...]


@dataclass(frozen=True)
class Finding:
    """One thing that was missing: the most probable name, what else it might be, and what it does.

    placebos : (p,) m, errors on turns not fitted with a force drawn at random in its place
    """

    kind: str
    name: str
    probability: float
    alternatives: tuple[tuple[str, float], ...]
    where: Where | None
    parameters: dict[str, Number]
    impulse: Array
    before: Figures
    after: Figures
    placebos: Array
    weighed: Round


@dataclass(frozen=True)
class OwnAccount:
    """A run with what it alone was found to have, and nothing that acts on all runs of a day alike."""

    fit: Refit
    scene: Scene
    account: Account
    levels: NoiseLevels


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer.

    fit, result : the model with everything that was found, fitted, and its run by the full model
    first : the fit without anything added;  missing, left : the force that was missing before, and after
    noise : of the instruments, under the final model
    rounds : all that was weighed, round by round
    figures : of the fit without anything added, and with each finding after the other
    residual_before, residual_after : (N,) of the measurements
    own : gives what other runs of its day are weighed with, which takes another fit
    """

    recording: str
    verdict: str
    sentence: str
    findings: tuple[Finding, ...]
    first: Refit
    fit: Refit
    result: SimulationResult | None
    noise: NoiseLevels
    missing: MissingForce
    left: MissingForce
    rounds: tuple[Round, ...]
    figures: tuple[Figures, ...]
    measurements: Measurements
    residual_before: Array
    residual_after: Array
    own: Callable[[], OwnAccount]

    @property
    def model(self) -> Model:
        """The extended model."""
        return self.fit.model


def diagnosis_to_dict(diagnosis: Diagnosis) -> dict[str, Any]:
    """The answer as ``diagnosis.json`` holds it."""

    def friction(fit: Refit) -> dict[str, float]:
        return {key: fit.model.value(f"friction.{key}") for key in ("mu_t", "mu_n")}

    return {
        "format": 1,
        "recording": diagnosis.recording,
        "verdict": diagnosis.verdict,
        "sentence": diagnosis.sentence,
        "findings": [_finding_to_dict(f) for f in diagnosis.findings],
        "friction": {"before": friction(diagnosis.first), "after": friction(diagnosis.fit)},
        "noise": {
            "gps_sigma_m": diagnosis.noise.gps.sigma,
            "gps_correlation_s": diagnosis.noise.gps.correlation_time,
            "height_sigma_m": diagnosis.noise.height.sigma,
            "load_sigma_N": diagnosis.noise.load.sigma,
            "capture_sigma_deg": float(np.degrees(diagnosis.noise.capture)),
        },
        "weighed": [
            [
                {"name": v.name or "nothing", "probability": v.probability, "log_evidence": v.log_evidence}
                for v in each.verdicts
            ]
            for each in diagnosis.rounds
        ],
        "stands_out": [
            {"t0_s": begin, "t1_s": end, "impulse_Ns": diagnosis.missing.impulse((begin, end)).tolist()}
            for begin, end in diagnosis.missing.stretches()
        ],
    }


def _finding_to_dict(finding: Finding) -> dict[str, Any]:
    where = finding.where
    before, after = finding.before, finding.after
    return {
        "kind": finding.kind,
        "name": finding.name,
        "probability": finding.probability,
        "alternatives": [{"name": name, "probability": p} for name, p in finding.alternatives],
        "where": None
        if where is None
        else {
            "t0_s": where.t0,
            "t1_s": where.t1,
            "distance_m": list(where.distance),
            "side": "both",
            "phase": list(where.phases),
        },
        "parameters": {
            name: {"value": n.value, "low": n.low, "high": n.high, "unit": n.unit}
            for name, n in finding.parameters.items()
        },
        "impulse_Ns": finding.impulse.tolist(),
        "evidence": {
            "trajectory_error_m": {"before": before.trajectory_error, "after": after.trajectory_error},
            "held_out_error_m": {"before": before.held_out_error, "after": after.held_out_error},
            "placebo_held_out_error_m": {
                "least": float(np.min(finding.placebos)),
                "median": float(np.median(finding.placebos)),
            },
            "chi2_per_dof": {"before": before.chi2_per_dof, "after": after.chi2_per_dof},
            "residual_memory": {"before": before.whiteness, "after": after.whiteness},
        },
    }
