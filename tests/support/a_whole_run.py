"""A run with all that a report can show of it: boots, uneven snow, a diagnosis, turns; and one of few sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from a_diagnosis import whole_version
from a_run import a_run

from sssi_exudyn.analysis.boots import AnkleFigures, BootFigures
from sssi_exudyn.io.typed import convert
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Estimate, FrictionShares, Posture, PostureSigma, Prediction
from sssi_exudyn.simulation.result import SIDES
from sssi_exudyn.terrain.surface import Surface
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis


def a_whole_run(duration: float = 8.0) -> StoredRun:
    """Return the run with the moments of its boots' cuffs, on waves of snow, and with a diagnosis."""
    run = a_run(duration)
    ankle = AnkleFigures(10.0, 15.0, 44.0, 12.0, 41.0, 9.0, 17.0, 35.0, 1.7)
    boots = BootFigures(0.07, 3.0, 2.1, 0.9, False, 10.4, dict.fromkeys(SIDES, ankle))
    cuffs = {f"{side}_cuff_flexion_Nm": 20.0 * np.sin(run.time) for side in SIDES}
    heights = 0.05 * np.sin(np.arange(60.0))[:, None] * np.cos(np.arange(12.0))[None]
    surface = Surface((-10.0, -10.0), 2.0, heights, np.full(heights.shape, 0.02), np.zeros((0, *heights.shape)))
    return replace(
        run,
        summary=replace(run.summary, boots=boots),
        series=run.series.assign(**cuffs),
        model=replace(run.model, surface=surface),
        diagnosis=convert(whole_version(), Diagnosis),
    )


def a_run_of_few_sensors(run: StoredRun) -> StoredRun:
    """Return the same run as one most of whose posture was assumed, with the prediction of its second half."""
    posture = Posture(
        measured=("both skis",),
        assumed=("knee flexion <90°",),
        sigma=PostureSigma(edge_deg=5.0, pitch_deg=3.0, heading_deg=6.0, height_m=0.05),
        gps_lag_s=None,
        unbalanced_rms_m=0.02,
        mu_t_se=FrictionShares(0.001, 0.004, 0.01, 0.02),
        effective_friction=Estimate(0.2, 0.01),
        second_half=Prediction(0.05, 0.4, 0.9, 3.0),
    )
    time = np.arange(0.0, 6.0, 0.1)
    speeds = pd.DataFrame({"time_s": time, "measured_mps": 5.0 + np.sin(time), "predicted_mps": 5.0 + 0.0 * time})
    return replace(run, summary=replace(run.summary, posture=posture), second_half=speeds)
