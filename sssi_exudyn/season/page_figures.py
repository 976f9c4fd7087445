"""The figures of a season's page: maps of tracks, runs over time, the same descent again, technique."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Block, Key, Panel, Panels
from sssi_exudyn.season.figures import TECHNIQUES
from sssi_exudyn.season.places import areas_of, local

_MOST_TRACKS: Final = 400
"""Maximum number of tracks that are drawn, so that a page stays below some megabytes."""
_MOST_AREAS: Final = 4
_MOST_PLACES: Final = 6
_MOST_BARS: Final = 40
"""Maximum number of runs with a bar of their own."""
_LONGEST: Final = 12
"""Characters of a run's name next to its bar, which leave room for the bars on a telephone."""
_OF_TECHNIQUE: Final = (1, 0, 2)
"""Colours of the techniques."""
_MOST_POINTS: Final = 2000
"""Maximum number of runs in a figure over time."""
_SHOWN_DAYS: Final = 12
"""Maximum number of lines between days; of more, lines are no help."""


def map_of_tracks(table: pd.DataFrame, tracks: Mapping[str, Array]) -> tuple[Block, ...]:
    """Return a map of each ski area with all tracks; those of one descent have one colour and its letter."""
    names = [name for name in table["run"] if name in tracks][:_MOST_TRACKS]
    if not names:
        return ()
    areas = areas_of(local([tracks[name][:, :2] for name in names]))
    places = dict(zip(table["run"], table["place"], strict=True))
    panels = []
    for area in range(min(_MOST_AREAS, max(areas) + 1)):
        own = [name for name, of in zip(names, areas, strict=True) if of == area]
        paths = local([tracks[name][:, :2] for name in own])
        title = f"Area {area + 1}: {len(own)} run{'s' * (len(own) != 1)}"
        panels.append(Panel(title, f"map of {len(own)} tracks", _draw_map(paths, [places[name] for name in own])))
    left = len(tracks) - len(names)
    more = f"; {left} more tracks are not drawn" if left > 0 else ""
    caption = f"Tracks from above, north up, a dot where each begins; letters name shared descents{more}"
    return (Panels(caption, tuple(panels), (), 5.0, 3.6),)


def _draw_map(paths: Sequence[Array], places: Sequence[str]) -> Callable[[Axes], None]:
    letters = sorted(set(places) - {""})
    middle = np.mean([path[0] for path in paths], axis=0)

    def draw(axes: Axes) -> None:
        written = set()
        for path, place in zip(paths, places, strict=True):
            rank = letters.index(place) if place else None
            colour = plots.INK if rank is None else plots.COLOURS[rank % len(plots.COLOURS)]
            line = path - middle
            axes.plot(line[:, 0], line[:, 1], color=colour, linewidth=0.8, alpha=0.8)
            axes.plot(line[0, 0], line[0, 1], ".", color=colour, markersize=4.0)
            if place and place not in written:
                written.add(place)
                axes.annotate(place, line[len(line) // 2], xytext=(4, 4), textcoords="offset points", fontsize=11)
        axes.set_aspect("equal", adjustable="datalim")
        axes.xaxis.set_major_locator(MaxNLocator(5))  # labels of thousands of metres do not touch
        axes.set(xlabel="east (m)", ylabel="north (m)")

    return draw


def over_time(seen: pd.DataFrame) -> tuple[Block, ...]:
    """Return speed, vertical, energy and effective friction with its interval, the runs in the order of time."""
    shown = seen.tail(_MOST_POINTS)
    if shown.empty:
        return ()
    number = np.arange(1.0, len(shown) + 1.0)
    days = shown["day"].to_numpy()
    changes = [row + 0.5 for row in range(1, len(days)) if days[row] != days[row - 1]]

    def lines(axes: Axes) -> None:
        for change in changes if len(changes) <= _SHOWN_DAYS else ():
            axes.axvline(change, color=plots.INK, linewidth=0.6, linestyle=":")
        axes.set_xlabel("run, in the order of time")
        axes.set_ylim(bottom=0.0)
        axes.set_xlim(0.5, len(shown) + 0.5)

    def speed(axes: Axes) -> None:
        axes.plot(number, shown["mean_speed_mps"], "o", color=plots.COLOURS[1], markersize=4.0)
        axes.plot(number, shown["top_speed_mps"], "^", color=plots.COLOURS[0], markersize=4.0)
        axes.set_ylabel("speed (m/s)")
        lines(axes)

    def of(column: str, label: str) -> Callable[[Axes], None]:
        def draw(axes: Axes) -> None:
            axes.plot(number, shown[column], "o", color=plots.COLOURS[1], markersize=4.0)
            axes.set_ylabel(label)
            lines(axes)

        return draw

    def friction(axes: Axes) -> None:
        _with_intervals(axes, number, shown)
        axes.set_ylabel("effective friction")
        lines(axes)

    panels = [Panel("Speed", "mean and top speed of each run", speed)]
    for column, title, label in (
        ("vertical_m", "Vertical drop", "vertical (m)"),
        ("energy_lost_a_turn_J_per_kg", "Energy lost in a turn", "energy (J/kg)"),
    ):
        if shown[column].notna().any():
            panels.append(Panel(title, f"{title.lower()} of each run", of(column, label)))
    if shown["effective_friction"].notna().any():
        panels.append(Panel("Effective friction", "of each run, with its 90 % interval where it has one", friction))
    keys = (Key(1, ".", "mean speed, and single figures"), Key(0, ".", "top speed"))
    caption = "Each run in the order of time, a dotted line between days; bars are 90 % intervals"
    return (Panels(caption, tuple(panels), keys, 5.0, 2.6),)


def _with_intervals(axes: Axes, number: Array, rows: pd.DataFrame) -> None:
    value, low, high = (rows[f"effective_friction{end}"].to_numpy(dtype=float) for end in ("", "_low", "_high"))
    known = np.isfinite(low) & np.isfinite(high)
    axes.vlines(number[known], low[known], high[known], color=plots.COLOURS[1], linewidth=1.2)
    axes.plot(number, value, "o", color=plots.COLOURS[1], markersize=4.0)


def same_descents(done: pd.DataFrame) -> tuple[Block, ...]:
    """Return effective friction of the runs of each shared descent, in the order of time."""
    counts = done.loc[(done["place"] != "") & done["effective_friction"].notna(), "place"].value_counts()
    panels = []
    for place in sorted(counts[counts > 1].index)[:_MOST_PLACES]:
        rows = done[done["place"] == place].tail(_MOST_POINTS)
        panels.append(Panel(f"Descent {place}: {len(rows)} runs", "effective friction of each run", _draw_place(rows)))
    if not panels:
        return ()
    caption = "Effective friction of the runs of one descent, in the order of time; bars are 90 % intervals"
    return (Panels(caption, tuple(panels), (), 3.4, 2.4),)


def _draw_place(rows: pd.DataFrame) -> Callable[[Axes], None]:
    def draw(axes: Axes) -> None:
        _with_intervals(axes, np.arange(1.0, len(rows) + 1.0), rows)
        axes.set(xlabel="run", ylabel="effective friction")
        axes.set_ylim(bottom=0.0)

    return draw


def technique_bars(done: pd.DataFrame) -> tuple[Block, ...]:
    """Return a bar of probabilities of each run whose technique is known."""
    known = done[done[f"technique_{TECHNIQUES[0]}"].notna()].tail(_MOST_BARS)
    if known.empty:
        return ()

    def draw(axes: Axes) -> None:
        before = np.zeros(len(known))
        names = [one_line(name.rpartition("/")[2], _LONGEST) for name in known["run"]]
        rows = np.arange(len(known))
        for index, technique in enumerate(TECHNIQUES):
            share = known[f"technique_{technique}"].fillna(0.0).to_numpy(dtype=float)
            axes.barh(rows, share, left=before, color=plots.COLOURS[_OF_TECHNIQUE[index]], height=0.7)
            before += share
        axes.set_yticks(rows, names)
        axes.invert_yaxis()
        axes.set(xlabel="probability", xlim=(0.0, 1.0))

    keys = tuple(Key(_OF_TECHNIQUE[index], ".", technique) for index, technique in enumerate(TECHNIQUES))
    panel = Panel("Technique of each run", "probability of each technique, a bar a run", draw)
    return (Panels("Probability of each technique, a bar a run", (panel,), keys, 4.6, 1.0 + 0.24 * len(known)),)
