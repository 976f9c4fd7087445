"""Diagnoses: a file of the first version, one with all later fields, and one with given findings."""

from __future__ import annotations

from typing import Any

from sssi_exudyn.io.writing import to_plain
from sssi_exudyn.validation.diagnosis.diagnosis_data import (
    Alternative,
    Chance,
    Change,
    Diagnosis,
    Evidence,
    Finding,
    ForceByFoot,
    ForceOverTime,
    Friction,
    FrictionChange,
    LatentForce,
    Likeness,
    Noise,
    Number,
    Placebos,
    SimilarRun,
    TrackDistance,
    Where,
)

FIRST_VERSION: dict[str, Any] = {
    "format": 1,
    "recording": "train_patch",
    "verdict": "explained",
    "sentence": "Between 5.6 s and 8.3 s the skis glide on slower snow: μ_t is 0.15 there against 0.09 elsewhere.",
    "findings": [
        {
            "kind": "physics",
            "name": "snow_patch",
            "probability": 0.97,
            "alternatives": [{"name": "pole_plant", "probability": 0.02}],
            "where": {
                "t0_s": 5.6,
                "t1_s": 8.3,
                "distance_m": [52.1, 75.4],
                "side": "both",
                "phase": ["control", "completion"],
            },
            "parameters": {"delta_mu_t": {"value": 0.062, "low": 0.055, "high": 0.069, "unit": "1"}},
            "impulse_Ns": [-98.0, 4.1, 0.3],
            "evidence": {
                "trajectory_error_m": {"before": 0.61, "after": 0.03},
                "held_out_error_m": {"before": 0.58, "after": 0.04},
                "chi2_per_dof": {"before": 41.0, "after": 1.02},
            },
        }
    ],
    "friction": {"before": {"mu_t": 0.112, "mu_n": 0.71}, "after": {"mu_t": 0.0901, "mu_n": 0.72}},
    "noise": {"gps_sigma_m": 0.021, "gps_correlation_s": 3.6},
}
"""Content of a file of the format's first description."""


def whole_version() -> dict[str, Any]:
    """Return the same with the data of its figures and the probabilities of hypotheses."""
    zero = (0.0, 0.0, 0.0)
    feet = ForceByFoot((zero, (40.0, 0.0, 0.0)), (zero, zero), (zero, (10.0, -3.0, 1.0)), (zero, zero), 12.5)
    stands_out = ((False,) * 3, (True, False, False))
    force = ForceOverTime((0.0, 1.0, 2.0), (zero, (50.0, -3.0, 1.0)), (zero, zero), stands_out, 9.25, feet)
    return {
        **FIRST_VERSION,
        "latent_force": to_plain(LatentForce(force, force)),
        "way": {"time_s": [0.0, 1.0, 2.0], "f_m": [0.0, 8.0, 16.0], "l_m": [0.0, 2.0, 1.0]},
        "friction_averaged": {
            "mu_t": {"value": 0.091, "low": 0.084, "high": 0.118, "unit": "1"},
            "mu_n": {"value": 0.72, "low": 0.70, "high": 0.74, "unit": "1"},
        },
        "smallest_noticed": {"gust": {"number": "w_f", "value": 3.21, "unit": "m/s"}},
        "held_out": [
            {"t0_s": 0.0, "t1_s": 0.06, "turn": None, "before_m": 0.6, "after_m": 0.2},
            {"t0_s": 0.06, "t1_s": 0.1, "turn": 1, "before_m": 0.5, "after_m": 0.1},
        ],
        "paragraph": "In turn 1 the snow is slower.",
        "chance": to_plain(Chance(400, 0.0025, 0.001, 0.61)),
        "likeness": to_plain(
            Likeness(
                9997,
                "Runs that look like it had: a gust 83%.",
                {"gust": 0.83},
                0.37,
                True,
                "gust",
                0.64,
                SimilarRun("snow_patch", (0.0, 1.0, 2.0), (zero, (50.0, -3.0, 1.0)), (zero, (45.0, 2.0, 1.0))),
            )
        ),
        "track_distance": to_plain(TrackDistance((0.0, 0.1), (0.5, 0.6), (0.1, 0.1))),
        "weighed": [
            [
                {"name": "snow_patch", "probability": 0.97, "log_evidence": 12.0, "refitted": True},
                {"name": "gust", "probability": 0.0, "log_evidence": None},
                {"name": "nothing", "probability": 0.02, "log_evidence": 2.0},
            ]
        ],
    }


def diagnosis_of(*findings: Finding) -> Diagnosis:
    friction = Friction(0.1, 0.8)
    verdict = "explained" if findings else "none"
    return Diagnosis(1, "hill", verdict, "", findings, FrictionChange(friction, friction), Noise(0.02, 3.0))


def finding_of(name: str, probability: float, *others: tuple[str, float], after: float = 0.05) -> Finding:
    """Return a finding between 2 s and 4 s, of -5 ± 1 m/s; its error on other turns is 0.3 m before, and ``after``."""
    return Finding(
        kind="unexplained" if name == "unexplained_force" else "physics",
        name=name,
        probability=probability,
        alternatives=tuple(Alternative(*other) for other in others),
        where=Where(2.0, 4.0, (10.0, 20.0), "both", ()),
        parameters={"w_f": Number(-5.0, -6.0, -4.0, "m/s")},
        impulse_Ns=(-100.0, 0.0, 0.0),
        evidence=Evidence(Change(0.3, after), Change(0.3, after), Change(9.0, 1.0), Placebos(0.1, 0.27)),
    )
