"""The runs of a descent compared together: sentences, tables and figures of the season's page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Block, Grid, Heading, Items, Panel, Panels, Text
from sssi_exudyn.season.joint_friction import LARGEST, JointFriction, Range, RunFriction

_MOST: Final = 6
"""Maximum number of descents on the page; ``season.json`` has all of them."""
NAMED: Final = 0.5
"""Probability from which a difference is named; it is said with it."""
_LOSS: Final = (
    "Effective friction is what a skier lost on the snow. Who brakes loses more on any snow, and who keeps the same"
    " speed loses as much on fast snow as on slow. So a difference may be the snow's, the ski's or the skier's."
)


def sentences_of(descent: JointFriction) -> list[str]:
    """Return what differs between runs, and what is the place's, each in a sentence."""
    lines = []
    for run in descent.runs:
        if _is_named(descent, run):
            size = f"{run.run} had {_more(run.more)} than the other runs, on all stretches alike"
            lines.append(f"{size} (probability {run.differs:.0%}).")
    for difference in descent.differences:
        if difference.probability >= NAMED:
            size = f"{difference.run} alone had {_more(difference.size)} {_stretch(descent, difference.stretch)}"
            lines.append(f"{size} (probability {difference.probability:.0%}).")
    if not lines:
        lines.append("No run is known to differ from the others.")
    lines += [
        f"In all runs there was {word} friction than on the other stretches {', '.join(places)}: it is the place's."
        for word, places in (("more", _apart(descent, 1.0)), ("less", _apart(descent, -1.0)))
        if places
    ]
    return lines


def _is_named(descent: JointFriction, run: RunFriction) -> bool:
    """Return whether a run is named; of two that differ it is the one with more friction."""
    of_two = len(descent.runs) == 2 and run.differs >= NAMED and run.more.value > 0.0
    return run.apart or of_two


def bound_of(descent: JointFriction) -> str:
    """Return in a sentence which differences would not be noticed."""
    least, on_stretch = (
        max(ends) for ends in zip(*((run.seen, run.seen_on_stretch) for run in descent.runs), strict=True)
    )
    whole = f"A run that differs by less than {least:.3f} on all stretches may not be noticed"
    if on_stretch >= LARGEST:
        return f"{whole}, and what differs on one stretch may pass for a skier's scatter."
    return (
        f"{whole}, nor one that differs by less than {on_stretch:.2f} on one of them; of larger ones nine of ten are."
    )


def together(descents: Sequence[JointFriction]) -> tuple[Block, ...]:
    """Return sentences, a figure and two tables of each descent."""
    blocks: list[Block] = []
    for descent in descents[:_MOST]:
        blocks += [
            Heading(f"Descent {descent.place}: {len(descent.runs)} runs"),
            Items((*sentences_of(descent), bound_of(descent))),
            _figure(descent),
            Grid(_stretch_rows(descent)),
            Grid(_run_rows(descent)),
        ]
        if descent.left_out:
            blocks.append(Text(f"Not compared: {', '.join(descent.left_out)}."))
    if len(descents) > _MOST:
        blocks.append(Text(f"The file season.json has {len(descents) - _MOST} more descents."))
    return (*blocks, Text(_LOSS)) if blocks else ()


def about_together(descents: Sequence[JointFriction]) -> str:
    """Return the section in a sentence."""
    apart = sum(_is_named(descent, run) for descent in descents for run in descent.runs)
    alone = sum(difference.probability >= NAMED for descent in descents for difference in descent.differences)
    count = sum(len(descent.runs) for descent in descents)
    if not apart and not alone:
        return f"Of {count} runs none is known to differ from the others of its descent."
    return f"Of {count} runs, {apart} had another friction than the others all along, and {alone} on a stretch."


def _apart(descent: JointFriction, sign: float) -> list[str]:
    """Return the stretches that have more friction than the others (less for a negative ``sign``), and how much."""
    return [
        f"{_stretch(descent, number)} ({stretch.apart.value:+.3f})"
        for number, stretch in enumerate(descent.stretches)
        if min(sign * stretch.apart.low, sign * stretch.apart.high) > 0.0
    ]


def _more(size: Range) -> str:
    ends = sorted((abs(size.low), abs(size.high)))
    word = "more" if size.value > 0.0 else "less"
    across = size.low < 0.0 < size.high
    interval = f"{size.low:+.3f} to {size.high:+.3f}" if across else f"{ends[0]:.3f} to {ends[1]:.3f}"
    return f"{abs(size.value):.3f} {word} friction ({interval})"


def _stretch(descent: JointFriction, number: int) -> str:
    stretch = descent.stretches[number]
    return f"from {stretch.begin_m:.0f} to {stretch.end_m:.0f} m"


def _between(size: Range, form: str) -> str:
    return f"{size.value:{form}} ({size.low:{form}} to {size.high:{form}})"


def _stretch_rows(descent: JointFriction) -> list[list[str]]:
    rows = [["stretch, m", "drop, m", "friction of all runs", "over the other stretches"]]
    for stretch in descent.stretches:
        name = f"{stretch.begin_m:.0f} to {stretch.end_m:.0f}"
        rows.append([name, f"{stretch.drop_m:.0f}", _between(stretch.friction, ".3f"), _between(stretch.apart, "+.3f")])
    return [*rows, ["all", f"{sum(s.drop_m for s in descent.stretches):.0f}", _between(descent.friction, ".3f"), ""]]


def _run_rows(descent: JointFriction) -> list[list[str]]:
    rows = [["run", "friction over the others", "differs", "noticed from", "on one stretch from", "scatter"]]
    for run in descent.runs:
        on_stretch = f"{run.seen_on_stretch:.2f}" if run.seen_on_stretch < LARGEST else ""
        cells = [_between(run.more, "+.3f"), f"{run.differs:.0%}", f"{run.seen:.3f}", on_stretch, f"{run.scatter:.3f}"]
        rows.append([run.run, *cells])
    return rows


def _figure(descent: JointFriction) -> Panels:
    middle = np.array([0.5 * (stretch.begin_m + stretch.end_m) for stretch in descent.stretches])
    count = np.arange(1.0, len(descent.runs) + 1.0)
    panels = (
        Panel(
            f"Descent {descent.place}: by stretch",
            "effective friction of all runs by stretch, with 90 % intervals",
            _draw(middle, [stretch.friction for stretch in descent.stretches], "along the descent (m)"),
        ),
        Panel(
            f"Descent {descent.place}: by run",
            "friction of each run over that of the others, with 90 % intervals",
            _draw(count, [run.more for run in descent.runs], "run, in the order of time", zero=True),
        ),
    )
    return Panels(
        "The place's friction, and each run's over that of the others; bars are 90 % intervals", panels, (), 5.0, 2.4
    )


def _draw(at: np.ndarray, sizes: Sequence[Range], label: str, *, zero: bool = False) -> Callable[[Axes], None]:
    value, low, high = np.array([(size.value, size.low, size.high) for size in sizes]).T

    def draw(axes: Axes) -> None:
        if zero:
            axes.axhline(0.0, color=plots.INK, linewidth=0.6, linestyle=":")
        axes.vlines(at, low, high, color=plots.COLOURS[1], linewidth=1.2)
        axes.plot(at, value, "o", color=plots.COLOURS[1], markersize=4.0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set(xlabel=label, ylabel="friction over the others" if zero else "effective friction")

    return draw
