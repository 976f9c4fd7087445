"""What the report says of the muscles: who worked when, on which leg, what the joints carried, and who was too weak."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import NDArray

from sssi_exudyn.analysis.turns import PHASES
from sssi_exudyn.bodies.muscles.muscles import LEG_GROUPS, LUMBAR_GROUPS, SIDES
from sssi_exudyn.core.frames import Array
from sssi_exudyn.muscle_forces.forces import JOINTS
from sssi_exudyn.muscle_forces.of_result import MuscleRun, contact_weights, figures, group_activation
from sssi_exudyn.reports.html import Section, figure, grid
from sssi_exudyn.reports.plots import COLOURS, svg

TITLE = "Muscles"
Mask = NDArray[np.bool_]


def muscles_section(found: MuscleRun, series: pd.DataFrame) -> Section:
    """The section of a result; ``series`` has the turns' columns (``biomechanics.labelled``)."""
    shown = [
        f"<p>{_sentence(found)}</p>\n",
        "<h3>Activation of the leg's muscle groups by phase of the turn: outside / inside leg</h3>\n",
        _by_phase(found, series, "leg", LEG_GROUPS),
        "<h3>Activation of the lumbar muscle groups: outside / inside half of the trunk</h3>\n",
        _by_phase(found, series, "lumbar", LUMBAR_GROUPS),
        "<h3>Largest joint contact forces (body weights)</h3>\n",
        _contact(found, series),
        figure(svg("muscle-loads", lambda axes: _draw_loads(axes, found), height=3.0), "What knees and L5/S1 carry"),
        figure(
            svg("muscle-quadriceps", lambda axes: _draw_quadriceps(axes, found), height=3.0),
            "Activation of the quadriceps",
        ),
    ]
    lacking = figures(found)["lacking"]
    if lacking:
        rows = [
            [
                _named(entry["coordinate"]),
                f"{100.0 * entry['share_of_samples']:.0f} %",
                f"{entry['worst_Nm']:.0f} of {entry['wanted_then_Nm']:.0f}",
                f"{entry['at_s']:.2f}",
            ]
            for entry in lacking
        ]
        head = ["", "of the time", "most that was missing (N m)", "at (s)"]
        shown += ["<h3>Joints that lack strength</h3>\n", grid([head, *rows])]
    return Section(TITLE, "".join(shown))


def _sentence(found: MuscleRun) -> str:
    enough = figures(found)["strong_enough_share"]
    return (
        f"{len(found.skier.named)} muscles share the joint moments so that the sum of their activations to the power "
        f"of {found.power} is least (static optimisation). In {100.0 * enough:.0f} % of the samples they are strong "
        "enough to make all of them; where they are not, reserve moments stand in and the table of joints that lack "
        "strength tells which and by how much."
    )


def _named(coordinate: str) -> str:
    word, side = coordinate[:-2], {"_r": ", right", "_l": ", left"}.get(coordinate[-2:])
    return (word + side if side else coordinate).replace("_", " ")


def _sided(series: pd.DataFrame) -> list[tuple[str, str, str, Mask]]:
    """Phase, ("outside", "inside"), the body's side and the samples: all turns of each side."""
    side, phase = (series[name].to_numpy() for name in ("turn_side", "turn_phase"))
    found = []
    for name in PHASES:
        for turn_side, outer, inner in (("left", "right", "left"), ("right", "left", "right")):
            at = (phase == name) & (side == turn_side)
            found += [(name, "outside", outer, at), (name, "inside", inner, at)]
    return found


def _mean_by_phase(series: pd.DataFrame, of_side: dict[str, Array]) -> dict[tuple[str, str], float]:
    """Mean over all samples of a phase, by phase and outside or inside; NaN where there are none."""
    sums: dict[tuple[str, str], list[Array]] = {}
    for phase, where, side, at in _sided(series):
        sums.setdefault((phase, where), []).append(of_side[side][at])
    joined = {key: np.concatenate(parts) for key, parts in sums.items()}
    return {key: float(np.mean(values)) if len(values) else float("nan") for key, values in joined.items()}


def _by_phase(found: MuscleRun, series: pd.DataFrame, region: str, groups: Sequence[str]) -> str:
    rows = []
    for group in groups:
        mean = _mean_by_phase(series, {side: group_activation(found, side, region, group) for side in SIDES})
        cells = (f"{_number(mean[phase, 'outside'])} / {_number(mean[phase, 'inside'])}" for phase in PHASES)
        rows.append([group.replace("_", " "), *cells])
    return grid([["", *PHASES], *rows])


def _contact(found: MuscleRun, series: pd.DataFrame) -> str:
    weights = contact_weights(found)
    peaks: dict[str, dict[str, float]] = {}
    for _, where, side, at in _sided(series):
        for joint in ("hip", "knee", "ankle"):
            values = weights[f"{joint}_{side[0]}"][at]
            if len(values):
                row = peaks.setdefault(joint, {})
                row[where] = max(row.get(where, 0.0), float(values.max()))
    rows = [
        [joint, *(_number(peaks.get(joint, {}).get(where, float("nan"))) for where in ("outside", "inside")),
         _number(max(float(weights[f"{joint}_{side[0]}"].max()) for side in SIDES))]
        for joint in ("hip", "knee", "ankle")
    ]  # fmt: skip
    rows.append(["L5/S1", "–", "–", _number(float(weights["L5_S1"].max()))])
    assert set(weights) == set(JOINTS)
    return grid([["", "outside leg in turns", "inside leg in turns", "in the whole run"], *rows])


def _draw_loads(axes: Axes, found: MuscleRun) -> None:
    weights = contact_weights(found)
    for (name, label), colour in zip(
        (("knee_l", "left knee"), ("knee_r", "right knee"), ("L5_S1", "L5/S1")), COLOURS, strict=False
    ):
        axes.plot(found.time, weights[name], color=colour, label=label)
    axes.set(xlabel="time (s)", ylabel="body weights")


def _draw_quadriceps(axes: Axes, found: MuscleRun) -> None:
    for side, colour in zip(reversed(SIDES), COLOURS, strict=False):
        values = group_activation(found, side, "leg", "quadriceps_femoris")
        axes.plot(found.time, values, color=colour, label=side)
    axes.set(xlabel="time (s)", ylabel="activation", ylim=(0.0, 1.05))


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"
