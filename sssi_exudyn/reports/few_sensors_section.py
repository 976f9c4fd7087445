"""A recording of few sensors in summary and page: what was measured and what assumed, and what that leaves unsure."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.fitting.fit import Fitted
from sssi_exudyn.fitting.objective import Problem
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.few_sensors.complete import Completed
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.html import Section, figure, table
from sssi_exudyn.validation.posture_uncertainty import SecondHalf, Shares, second_half, shares_of


def counted(
    recording: Recording, motion: Motion, problem: Problem, fitted: Fitted
) -> tuple[Fitted, dict[str, Any], Section]:
    """A fit to a recording of few sensors, with what assumed posture and estimated slope leave unsure in its errors;
    what the summary says of it (``posture``), and its section of the page.
    """
    completed, gps = recording.completed, recording.gps
    assert completed is not None
    assert gps is not None
    shares = shares_of(fitted, problem, motion, completed, recording.slope.sigma_inclination)
    half = second_half(fitted, problem, motion, gps)
    figures = posture_figures(completed, fitted.names, shares, half)
    return (
        replace(fitted, covariance=shares.covariance),
        {"posture": figures},
        posture_section(completed, figures, half),
    )


def posture_figures(completed: Completed, names: tuple[str, ...], shares: Shares, half: SecondHalf) -> dict[str, Any]:
    """The ``posture`` figures of a summary.

    names : (k,) the fitted numbers, in the order of the shares
    """
    sigma, lag = completed.sigma, completed.lag
    figures: dict[str, Any] = {
        "measured": list(completed.measured),
        "assumed": list(completed.assumed),
        "sigma": {
            "edge_deg": float(np.degrees(sigma.roll)),
            "pitch_deg": float(np.degrees(sigma.pitch)),
            "heading_deg": float(np.degrees(sigma.yaw)),
            "height_m": sigma.height,
        },
        "gps_lag_s": None if lag is None else {"value": lag.value, "se": lag.sigma},
        "unbalanced_rms_m": float(np.sqrt(np.mean(completed.unbalanced**2))),
    }
    at = names.index("friction.mu_t")
    figures["mu_t_se"] = {name: float(getattr(shares, name)[at]) for name in ("track", "posture", "slope", "steering")}
    without = [figures["mu_t_se"][name] for name in ("track", "posture", "slope")]
    figures["effective_friction"] = {"value": shares.effective, "se": float(np.linalg.norm(without))}
    figures["second_half"] = {
        "mu_t": half.mu_t,
        "speed_rms_mps": half.speed_rms,
        "constant_speed_rms_mps": half.usual_rms,
    }
    return figures


def posture_section(completed: Completed, figures: dict[str, Any], half: SecondHalf) -> Section:
    """What a reader has to know before believing anything of such a result."""
    sigma = figures["sigma"]
    rows = [
        ("edge angle (°)", f"± {sigma['edge_deg']:.1f}", "each foot's roll, one standard deviation"),
        ("heading (°)", f"± {sigma['heading_deg']:.1f}", "of the skis"),
        ("pitch (°)", f"± {sigma['pitch_deg']:.1f}", "of the skis against the slope"),
        ("height (m)", f"± {sigma['height_m']:.3f}", "of one foot against the other"),
        ("balance (m)", f"{figures['unbalanced_rms_m']:.3f}", "by which the posture fails to balance in roll"),
    ]
    effective = figures["effective_friction"]
    rows.append(
        (
            "effective friction",
            f"{effective['value']:.3f} ± {effective['se']:.3f}",
            "of the way: along and across the skis together, which is told apart only where steering was measured",
        )
    )
    for name, value in figures["mu_t_se"].items():
        rows.append(("share in μ_t's standard error", f"{value:.4f}", f"from the {name}"))
    parts = [
        "<p>Most of this posture was not measured. Joint angles, moments and the load's share between the feet are"
        " those of the assumptions; speed, path and effective friction are what the sensors tell.</p>\n",
        _list("Measured", completed.measured),
        _list("Assumed", completed.assumed),
        table("How sure the feet are", rows),
    ]
    parts.append(
        figure(
            _speed_svg(half),
            f"Speed over ground: predicted with what the first half says (μ_t {half.mu_t:.3f}) and measured; beyond"
            f" the line nothing was fitted, {half.speed_rms:.2f} m/s root mean square off",
        )
    )
    return Section("Few sensors: measured and assumed", "".join(parts))


def _list(title: str, lines: tuple[str, ...]) -> str:
    items = "".join(f"<li>{escape(line)}</li>\n" for line in lines)
    return f"<h3>{title}</h3>\n<ul>\n{items}</ul>\n"


def _speed_svg(half: SecondHalf) -> str:
    def draw(axes: Axes) -> None:
        axes.plot(half.time, half.measured, ".-", color=plots.COLOURS[0], label="measured", markersize=3)
        axes.plot(half.time, half.predicted, color=plots.COLOURS[1], label="predicted")
        axes.axvline(half.split, color=plots.INK, linewidth=0.6, linestyle="--")
        axes.set(xlabel="time (s)", ylabel="speed (m/s)")

    return plots.svg("few-sensors-speed", draw)
