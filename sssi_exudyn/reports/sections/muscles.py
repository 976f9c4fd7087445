"""The muscles of a run: activation by leg and phase of the turn, the joints' loads, and joints that lack strength."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import NDArray

from sssi_exudyn.analysis.turns import PHASES
from sssi_exudyn.bodies.muscles.muscles import LUMBAR_GROUPS, SIDES, leg_groups
from sssi_exudyn.core.choices import MuscleSet
from sssi_exudyn.core.frames import Array
from sssi_exudyn.muscle_forces.of_result import contact_band_column, contact_column, group_column
from sssi_exudyn.reports.plots import COLOURS
from sssi_exudyn.reports.section import Block, Drawing, Grid, Heading, Runs, Section, Text, say_of_each, section_of_each
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import LackingJoint, MuscleFigures

Mask = NDArray[np.bool_]
_PUBLISHED: Final = (
    "No measurement of these forces in skiing is known. Instrumented knees carry 2.5 to 2.8 body weights in walking, "
    "3.2 to 3.5 down stairs, 4.2 in jogging and 4.3 in tennis (D'Lima et al., Arthritis Res. Ther. 15 (2013) ar4138). "
    "What can be compared and what cannot is in docs/notebook/muscles.md."
)


def muscles(runs: Runs) -> Section:
    """Show the muscles from the series' columns and the summary's group that ``sssi muscles`` adds."""
    return section_of_each("Muscles", runs, _blocks, say_of_each(runs, _strength))


def _strength(run: StoredRun) -> str:
    """State how often the muscles suffice."""
    figures = run.summary.muscles
    if figures is None:
        return ""
    share = f"{100.0 * figures.strong_enough_share:.0f}\u00a0%"
    return f"{figures.count} muscles make all joint moments in {share} of the samples"


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    figures, series = run.summary.muscles, run.series
    if figures is None:
        return ()
    chosen: MuscleSet = "full" if figures.muscle_set == "full" else "paper"
    if not _columns(chosen) <= set(series.columns):  # the summary has figures without their columns in the series
        return (Text(_sentence(figures)),)
    blocks: tuple[Block, ...] = (
        Text(_sentence(figures)),
        Heading("Activation of the leg's muscle groups by phase of the turn: outside / inside leg"),
        Grid(_by_phase(series, "leg", leg_groups(chosen))),
        Heading("Activation of the lumbar muscle groups: outside / inside half of the trunk"),
        Grid(_by_phase(series, "lumbar", LUMBAR_GROUPS)),
        Heading("Largest joint contact forces (body weights)"),
        Grid(_contact(series, figures.contact_peak_band_bodyweights)),
        Drawing(_loads_caption(figures), lambda axes: _draw_loads(axes, series), 3.0),
        Drawing("The same over a turn, mean of all turns with all phases", lambda axes: _draw_turn(axes, series), 3.0),
        Text(_PUBLISHED),
        Drawing("Activation of the quadriceps", lambda axes: _draw_quadriceps(axes, series), 3.0),
    )
    if not figures.lacking:
        return blocks
    return (*blocks, Heading("Joints that lack strength"), Grid(_lacking(figures.lacking)))


def _columns(chosen: MuscleSet) -> set[str]:
    """Return the columns of the series that the section shows."""
    regions = (("leg", leg_groups(chosen)), ("lumbar", LUMBAR_GROUPS))
    joints = [f"{joint}_{side[0]}" for joint in ("hip", "knee", "ankle") for side in SIDES]
    groups = {group_column(region, group, side) for region, names in regions for group in names for side in SIDES}
    return {"turn", "turn_side", "turn_phase", *groups, *(contact_column(joint) for joint in (*joints, "L5_S1"))}


def _sentence(figures: MuscleFigures) -> str:
    return (
        f"{figures.count} muscles share the joint moments so that the sum of their activations to the power of "
        f"{figures.power} is least (static optimisation). In {100.0 * figures.strong_enough_share:.0f} % of the "
        "samples they are strong enough to make all of them. Elsewhere reserve moments make up the rest; the table of "
        "joints that lack strength shows which and by how much."
    )


def _lacking(joints: Sequence[LackingJoint]) -> list[list[str]]:
    rows = [
        [
            _joint_name(joint.coordinate),
            f"{100.0 * joint.share_of_samples:.0f} %",
            f"{joint.worst_Nm:.0f} of {joint.wanted_then_Nm:.0f}",
            f"{joint.at_s:.2f}",
        ]
        for joint in joints
    ]
    return [["", "of the time", "most that was missing (N m)", "at (s)"], *rows]


def _joint_name(coordinate: str) -> str:
    word, side = coordinate[:-2], {"_r": ", right", "_l": ", left"}.get(coordinate[-2:])
    return (word + side if side else coordinate).replace("_", " ")


def _by_side(series: pd.DataFrame) -> list[tuple[str, str, str, Mask]]:
    """Return phase, ("outside", "inside"), the body's side and the samples: all turns of each side."""
    side, phase = (series[name].to_numpy() for name in ("turn_side", "turn_phase"))
    parts = []
    for name in PHASES:
        for turn_side, outer, inner in (("left", "right", "left"), ("right", "left", "right")):
            samples = (phase == name) & (side == turn_side)
            parts += [(name, "outside", outer, samples), (name, "inside", inner, samples)]
    return parts


def _mean_by_phase(series: pd.DataFrame, of_side: dict[str, Array]) -> dict[tuple[str, str], float]:
    """Return the mean over all samples of a phase, by phase and outside or inside; NaN where there are none."""
    sums: dict[tuple[str, str], list[Array]] = {}
    for phase, where, side, samples in _by_side(series):
        sums.setdefault((phase, where), []).append(of_side[side][samples])
    joined = {key: np.concatenate(parts) for key, parts in sums.items()}
    return {key: float(np.mean(values)) if len(values) else float("nan") for key, values in joined.items()}


def _by_phase(series: pd.DataFrame, region: str, groups: Sequence[str]) -> list[list[str]]:
    rows = []
    for group in groups:
        mean = _mean_by_phase(series, {side: _values(series, group_column(region, group, side)) for side in SIDES})
        cells = (f"{_number(mean[phase, 'outside'])} / {_number(mean[phase, 'inside'])}" for phase in PHASES)
        rows.append([group.replace("_", " "), *cells])
    return [["", *PHASES], *rows]


def _contact(series: pd.DataFrame, bands: Mapping[str, float]) -> list[list[str]]:
    """Return the largest loads, with half the bands' width there in the last column."""

    def peak(joints: Sequence[str]) -> str:
        largest, joint = max((float(_contact_weights(series, joint).max()), joint) for joint in joints)
        return _number(largest) + (f" ± {_number(bands[joint])}" if joint in bands else "")

    peaks: dict[str, dict[str, float]] = {}
    for _, where, side, samples in _by_side(series):
        for joint in ("hip", "knee", "ankle"):
            values = _contact_weights(series, f"{joint}_{side[0]}")[samples]
            if len(values):
                row = peaks.setdefault(joint, {})
                row[where] = max(row.get(where, 0.0), float(values.max()))
    rows = [
        [
            joint,
            *(_number(peaks.get(joint, {}).get(where, float("nan"))) for where in ("outside", "inside")),
            peak([f"{joint}_{side[0]}" for side in SIDES]),
        ]
        for joint in ("hip", "knee", "ankle")
    ]
    rows.append(["L5/S1", "–", "–", peak(["L5_S1"])])
    return [["", "outside leg in turns", "inside leg in turns", "in the whole run"], *rows]


def _loads_caption(figures: MuscleFigures) -> str:
    caption = "Contact forces of knees and L5/S1"
    if not figures.draws:
        return caption
    return (
        f"{caption}; bands of nine in ten, from {figures.draws} draws of what posture, mass, snow and friction leave "
        "uncertain, not of the muscles' own strength and paths"
    )


def _draw_loads(axes: Axes, series: pd.DataFrame) -> None:
    for (name, label), colour in zip(
        (("knee_l", "left knee"), ("knee_r", "right knee"), ("L5_S1", "L5/S1")), COLOURS, strict=False
    ):
        weights = _contact_weights(series, name)
        axes.plot(series["time_s"], weights, color=colour, label=label)
        if contact_band_column(name) in series:
            width = _values(series, contact_band_column(name))
            axes.fill_between(
                series["time_s"], weights - width, weights + width, color=colour, alpha=0.25, linewidth=0.0
            )
    axes.set(xlabel="time (s)", ylabel="body weights")


def _draw_turn(axes: Axes, series: pd.DataFrame) -> None:
    """Draw loads of the outside and the inside knee and of L5/S1 from beginning to end of a turn, with bands."""
    share = np.linspace(0.0, 1.0, 101)
    loads: dict[str, list[Array]] = {}
    for _, turn in series[series["turn"] > 0].groupby("turn"):
        side = turn["turn_side"].iloc[0]
        if side not in SIDES or not set(PHASES) <= set(turn["turn_phase"]):
            continue
        outer, inner = ("r", "l") if side == "left" else ("l", "r")
        time = _values(turn, "time_s")
        instants = time[0] + share * (time[-1] - time[0])
        for label, joint in (("outside knee", f"knee_{outer}"), ("inside knee", f"knee_{inner}"), ("L5/S1", "L5_S1")):
            band = contact_band_column(joint)
            columns = [_contact_weights(turn, joint), _values(turn, band) if band in turn else np.zeros(len(turn))]
            loads.setdefault(label, []).append(np.stack([np.interp(instants, time, column) for column in columns]))
    for (label, turns), colour in zip(loads.items(), COLOURS, strict=False):
        mean, width = np.mean(turns, axis=0)
        axes.plot(100.0 * share, mean, color=colour, label=label)
        if np.any(width > 0.0):
            axes.fill_between(100.0 * share, mean - width, mean + width, color=colour, alpha=0.25, linewidth=0.0)
    axes.set(xlabel="share of the turn (%)", ylabel="body weights")


def _draw_quadriceps(axes: Axes, series: pd.DataFrame) -> None:
    for side, colour in zip(reversed(SIDES), COLOURS, strict=False):
        values = _values(series, group_column("leg", "quadriceps_femoris", side))
        axes.plot(series["time_s"], values, color=colour, label=side)
    axes.set(xlabel="time (s)", ylabel="activation", ylim=(0.0, 1.05))


def _contact_weights(series: pd.DataFrame, joint: str) -> Array:
    return _values(series, contact_column(joint))


def _values(series: pd.DataFrame, column: str) -> Array:
    return series[column].to_numpy(dtype=float)


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"
