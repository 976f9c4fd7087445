"""The paper's Figures 5, 7 and 8: angles, contact forces and moments over two linked turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Key, Panel, Panels, Runs, Section, figure_section, say_of_each
from sssi_exudyn.reports.sections.linked_turns import Cycle, cycles_of
from sssi_exudyn.results.stored import StoredRun

RIGHT: Final = "-"
LEFT: Final = "--"
"""Line styles of the sides, as in the paper."""
_TRUNK: Final = ("pelvis", "lumbar")
ANGLES: Final = (
    ("hip_flexion", "hip flexion"),
    ("hip_adduction", "hip adduction"),
    ("hip_rotation", "hip internal rotation"),
    ("knee_angle", "knee flexion"),
    ("ankle_angle", "ankle dorsiflexion"),
    ("pelvis_tilt", "pelvis backward tilt"),
    ("pelvis_list", "pelvis right list"),
    ("pelvis_rotation", "pelvis left rotation"),
    ("lumbar_extension", "lumbar extension"),
    ("lumbar_bending", "lumbar right bending"),
    ("lumbar_rotation", "lumbar left rotation"),
)
"""Figure 5: coordinate, and its positive direction.  The paper has knee extension."""
MOMENTS: Final = (
    ("hip_flexion", "hip flexion"),
    ("hip_adduction", "hip adduction"),
    ("hip_rotation", "hip internal rotation"),
    ("knee_angle", "knee flexion"),
    ("ankle_angle", "ankle dorsiflexion"),
)
"""Figure 8: coordinate, and its positive direction."""
_AROUND: Final = 0.2
"""Share of a turn before and after the transition in which a spike counts as the transition's."""
_SPIKE: Final = 0.3
"""Least height of a spike, as a share of the curve's range."""


def figure_5(runs: Runs) -> Section:
    cycles = cycles_of(runs)
    panels = []
    for name, words in ANGLES:
        series = [
            (index, style, f"{run.name}{side}", _degrees(run, coordinate))
            for index, run in enumerate(runs)
            for coordinate, style, side in _sides(name)
        ]
        panels.append(_curves(f"{words} (°)", series, cycles))
    return figure_section(
        "Joint angles over two linked turns",
        Panels(
            f"Each panel names its positive direction. {_pairs_of_turns(runs, cycles)}. Compare Figure 5 of Gao et al",
            tuple(panels),
            (*_of_runs(runs), *_of_sides()),
            3.3,
            2.0,
        ),
        say_of_each(runs, _bending),
    )


def _bending(run: StoredRun) -> str:
    """State how far knees and hips bend."""
    words = []
    for joint, coordinate in (("knees", "knee_angle"), ("hips", "hip_flexion")):
        angles = np.concatenate([_degrees(run, f"{coordinate}_{side}") for side in "rl"])
        words.append(f"{joint} from {angles.min():.0f}° to {angles.max():.0f}°")
    return f"flexion goes in the {' and in the '.join(words)}"


def _degrees(run: StoredRun, coordinate: str) -> Array:
    return np.asarray(np.unwrap(run.series[f"{coordinate}_deg"].to_numpy(dtype=float), period=360.0))


def figure_7(runs: Runs) -> Section:
    cycles = cycles_of(runs)
    panels = []
    for index, (run, cycle) in enumerate(zip(runs, cycles, strict=True)):
        weight = GRAVITY * run.model.skier.mass
        series = [
            (index, style, side, run.series[f"{side}_load_N"].to_numpy(dtype=float) / weight)
            for style, side in ((RIGHT, "right"), (LEFT, "left"))
        ]
        panels.append(_curves(f"{run.name} (BW)", series, {index: cycle}, phases=True))
    return figure_section(
        "Load on each ski over two linked turns",
        Panels(
            "The snow's normal force on each ski over the skier's body weight; vertical lines are transitions, dashed "
            f"ones the bounds of the phases. {_pairs_of_turns(runs, cycles)}. Compare Figure 7 of Gao et al",
            tuple(panels),
            (*_of_runs(runs), *_of_sides()),
            4.6,
            2.4,
        ),
        say_of_each(runs, _largest_load),
    )


def _largest_load(run: StoredRun) -> str:
    """State the largest load on each ski."""
    weight = GRAVITY * run.model.skier.mass
    left, right = (float(run.series[f"{side}_load_N"].max()) / weight for side in ("left", "right"))
    return f"the left ski bears up to {left:.1f} and the right ski up to {right:.1f} body weights"


def figure_8(runs: Runs) -> Section:
    cycles = cycles_of(runs)
    panels = []
    for name, words in MOMENTS:
        series = [
            (index, style, f"{run.name}{side}", run.series[f"{joint}_moment_Nm"].to_numpy() / run.model.skier.mass)
            for index, run in enumerate(runs)
            for joint, style, side in _sides(name)
        ]
        panels.append(_curves(f"{words} (N m/kg)", series, cycles, mark_spikes=True))
    return figure_section(
        "Joint moments over two linked turns",
        Panels(
            "Each panel names its positive direction; moments are per kilogram of the skier. Diamonds are spikes at "
            f"the transition between the turns. {_pairs_of_turns(runs, cycles)}. Compare Figure 8 of Gao et al",
            tuple(panels),
            (*_of_runs(runs), *_of_sides()),
            3.3,
            2.0,
        ),
        say_of_each(runs, _largest_moment),
    )


def _largest_moment(run: StoredRun) -> str:
    """State the largest moment of a leg's joint."""
    peaks = {
        (words.partition(" ")[0], side): float(run.series[f"{name}_{side[0]}_moment_Nm"].abs().max())
        for name, words in MOMENTS
        for side in ("right", "left")
    }
    (joint, side), peak = max(peaks.items(), key=lambda item: item[1])
    return f"the largest moment is {peak / run.model.skier.mass:.1f} N m/kg, at the {side} {joint}"


Series = tuple[int, str, str, Array]
"""Index of the run, line style, name, values (n,)."""


def _curves(
    title: str,
    series: Sequence[Series],
    cycles: Sequence[Cycle] | Mapping[int, Cycle],
    *,
    phases: bool = False,
    mark_spikes: bool = False,
) -> Panel:
    curves = [(index, style, name, cycles[index].curve(values)) for index, style, name, values in series]
    shown = {index: cycles[index] for index, *_ in series}

    def draw(axes: Axes) -> None:
        for index, cycle in shown.items():
            for mark in cycle.transitions:
                axes.axvline(mark, color=_colour(index), linewidth=0.8, alpha=0.6)
            for mark in cycle.phases if phases else ():
                axes.axvline(mark, color=_colour(index), linewidth=0.8, alpha=0.6, linestyle=LEFT)
        for index, style, _, curve in curves:
            low, high = curve.mean - curve.spread, curve.mean + curve.spread
            axes.fill_between(curve.time, low, high, color=_colour(index), alpha=0.18, linewidth=0)
            axes.plot(curve.time, curve.mean, color=_colour(index), linestyle=style)
            if mark_spikes and shown[index].pairs:
                peaks = spikes(curve.time, curve.mean, shown[index])
                axes.plot(curve.time[peaks], curve.mean[peaks], "D", color=_colour(index), markersize=4.5)
        axes.margins(x=0.01)
        axes.set(xlabel="time (s)")

    ranges = "; ".join(f"{name} {np.min(c.mean):.2g} to {np.max(c.mean):.2g}" for _, _, name, c in curves)
    return Panel(title, ranges, draw)


def spikes(time: Array, values: Array, cycle: Cycle) -> list[int]:
    """Find the indices where the curve has a spike, up or down, at the transition between the two turns."""
    middle = cycle.transitions[1]
    window = _AROUND * float(np.mean(cycle.durations))
    least = _SPIKE * float(np.ptp(values))
    from scipy.signal import find_peaks  # here: it takes most of a second to load

    peaks = [i for sign in (1.0, -1.0) for i in find_peaks(sign * values, prominence=least)[0]]
    return [int(i) for i in peaks if abs(time[i] - middle) <= window]


def _sides(name: str) -> tuple[tuple[str, str, str], ...]:
    """Return coordinate, line style and name of each side; the trunk has none."""
    if name.startswith(_TRUNK):
        return ((name, RIGHT, ""),)
    return ((f"{name}_r", RIGHT, ", right"), (f"{name}_l", LEFT, ", left"))


def _colour(index: int) -> str:
    return plots.COLOURS[index % len(plots.COLOURS)]


def _of_runs(runs: Runs) -> tuple[Key, ...]:
    return tuple(Key(index % len(plots.COLOURS), "-", run.name) for index, run in enumerate(runs))


def _of_sides() -> tuple[Key, ...]:
    return Key(None, RIGHT, "right"), Key(None, LEFT, "left")


def _pairs_of_turns(runs: Runs, cycles: Sequence[Cycle]) -> str:
    """State how many pairs of turns a mean is over."""
    lines = [
        f"{run.name}: mean and standard deviation over {len(cycle.pairs)} pairs, {cycle.pairs[0][0].side} turn first"
        if len(cycle.pairs) > 1
        else f"{run.name}: one pair of turns, {cycle.pairs[0][0].side} turn first"
        if cycle.pairs
        else f"{run.name}: the whole run, for want of two linked turns"
        for run, cycle in zip(runs, cycles, strict=True)
    ]
    return "; ".join(lines)
