"""The page that compares skis in steady turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.contact.term import formula, parameters
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.reports.html import document
from sssi_exudyn.reports.plots import COLOURS
from sssi_exudyn.reports.section import Block, Drawing, Facts, Grid, Items, Section, Text
from sssi_exudyn.simulation.turns.steady_turn import SteadyTurn, TurnCase
from sssi_exudyn.simulation.turns.turn_rig import UNCERTAIN, RigPoint, difference

_STYLES: Final = ("-", "--")
"""Styles of the lines: five skis, and five more."""


def turn_page(skis: Sequence[Ski], points: Sequence[RigPoint], case: TurnCase) -> str:
    """Return the page for skis and their points, all of one case except for the edge angle."""
    names = [ski.name for ski in skis]
    lead = (
        f"<p>{escape(', '.join(names))}: one ski with {case.load:g} N along the snow's normal at {case.speed:g} m/s, "
        "the resultant square to the base. Bars are one standard deviation of what is uncertain of snow and posture. "
        "The skis' own figures are taken as they stand in the catalogue.</p>\n"
    )
    sections = [
        Section("Radius", (_over_edge(names, points, "radius (m)", _radius_bar), Grid(_radius_rows(names, points)))),
        Section(f"Against {names[0]}", _differences(names, points)),
        Section("Side reserve", (Text(_RESERVE), _over_edge(names, points, "side reserve (1)", _reserve_bar))),
        Section(
            "What the snow takes",
            (Text(_BALANCE), _over_edge(names, points, "drag (N)", _drag), Grid(loss_rows(points))),
        ),
        Section("Along the edge", _along(names, points)),
        Section("What the bars are made of", (Grid(_share_rows(points)), Items(_sources()))),
        Section("Skis", (Grid(_ski_rows(skis)), Items(tuple(f"{ski.name}: {ski.source}" for ski in skis)))),
        Section("Snow", (Text(formula(type(case.law))), Facts(_snow_rows(case)))),
    ]
    return document("Skis in steady turns", lead, sections)


_RESERVE: Final = (
    "The share of what the groove's wall bears along the edge that is not used. Where it falls the ski skids; at 0 it "
    "slips out of the turn."
)
_BALANCE: Final = (
    "Drag is the snow's force against the path of the boot centre; the power is what the skier gives against the "
    "snow's force and moment. Friction along the edge, compaction of the snow ahead and skidding across the edge take "
    "it; what is left over is the solver's."
)
_Bar = Callable[[RigPoint], tuple[float, float, float]]
"""A point's value, and its uncertainty downwards and upwards."""


def _radius_bar(point: RigPoint) -> tuple[float, float, float]:
    radius = np.nan if point.radius is None else point.radius
    low = radius if point.radius_low is None else point.radius_low
    high = radius if point.radius_high is None else point.radius_high
    return radius, radius - low, high - radius


def _reserve_bar(point: RigPoint) -> tuple[float, float, float]:
    return (np.nan, 0.0, 0.0) if point.turn is None else (point.turn.side_reserve, *point.reserve_bar())


def _drag(point: RigPoint) -> tuple[float, float, float]:
    return (np.nan if point.turn is None else point.turn.drag), 0.0, 0.0


def _line(index: int) -> dict[str, Any]:
    count = len(COLOURS)
    return {"color": COLOURS[index % count], "linestyle": _STYLES[index // count % len(_STYLES)]}


def _over_edge(names: Sequence[str], points: Sequence[RigPoint], label: str, bar: _Bar) -> Drawing:
    def draw(axes: Axes) -> None:
        for index, name in enumerate(names):
            own = [point for point in points if point.ski == name]
            edge = np.degrees([point.edge for point in own]) + 0.3 * (index - 0.5 * (len(names) - 1))
            value, less, more = np.array([bar(point) for point in own]).T
            axes.errorbar(
                edge, value, (less, more), label=name, capsize=2.0, marker="o", markersize=3.0, **_line(index)
            )
        axes.set_xlabel("edge angle (degrees)")
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)

    return Drawing(f"{label} over the edge angle, one line a ski", draw)


def _along(names: Sequence[str], points: Sequence[RigPoint]) -> tuple[Block, ...]:
    """Draw quantities along the edge, at the edge angle nearest to 60 degrees at which all skis turn."""
    edges = sorted({point.edge for point in points}, key=lambda edge: abs(edge - np.radians(60.0)))
    of_edges = [[point.turn for point in points if point.edge == edge and point.radius is not None] for edge in edges]
    shared = [[turn for turn in turns if turn is not None] for turns in of_edges if len(turns) == len(names)]
    if not shared:
        return (Text("There is no edge angle at which all skis turn."),)
    turns = shared[0]
    edge_words = f"at {np.degrees(turns[0].case.edge):.0f} degrees"

    def drawing(label: str, of: Callable[[SteadyTurn], Array]) -> Drawing:
        def draw(axes: Axes) -> None:
            for index, (name, turn) in enumerate(zip(names, turns, strict=True)):
                axes.plot(1e3 * turn.place, of(turn), label=name, **_line(index))
            axes.set_xlabel("ahead of the boot centre (mm)")
            axes.set_ylabel(label)

        return Drawing(f"{label} along the edge, {edge_words}", draw)

    return (
        drawing("pressure (kN/m)", lambda turn: 1e-3 * turn.pressure),
        drawing("side force (kN/m)", lambda turn: 1e-3 * turn.across),
        drawing("wall's share used (1)", _used),
        drawing("slip across (m/s)", lambda turn: np.where(turn.depth > 0.0, turn.slip, np.nan)),
        drawing("groove (mm)", lambda turn: 1e3 * np.where(turn.depth > 0.0, turn.groove, np.nan)),
    )


def _used(turn: SteadyTurn) -> Array:
    inside = turn.most > 0.0
    return np.where(inside, np.abs(turn.across) / np.where(inside, turn.most, 1.0), np.nan)


def _number(value: float | None, digits: int = 2) -> str:
    return "none" if value is None else f"{value:.{digits}f}"


def _radius_rows(names: Sequence[str], points: Sequence[RigPoint]) -> list[list[str]]:
    edges = sorted({point.edge for point in points})
    rows = [["", *(f"{np.degrees(edge):.0f}°" for edge in edges)]]
    for name in names:
        own = {point.edge: point for point in points if point.ski == name}
        rows.append([name, *(_radius_text(own[edge]) for edge in edges)])
    return rows


def _radius_text(point: RigPoint) -> str:
    if point.turn is None:
        return "no turn"
    return f"{_number(point.radius)} ({_number(point.radius_low)} to {_number(point.radius_high)}) m"


def loss_rows(points: Sequence[RigPoint]) -> list[list[str]]:
    """Return the table of drag and power, the headline first: a row a point, its losses and what they leave over."""
    rows = [["", "drag", "power", "friction", "compaction", "skid", "left over", "groove", "sideslip"]]
    for point in points:
        turn = point.turn
        name = f"{point.ski}, {np.degrees(point.edge):.0f}°"
        if turn is None:
            rows.append([name, point.problem, *[""] * (len(rows[0]) - 2)])
            continue
        taken = (turn.friction, turn.compaction, turn.skid)
        rows.append(
            [
                name,
                f"{turn.drag:.0f} N",
                *(f"{power:.0f} W" for power in (turn.power, *taken, turn.power - sum(taken))),
                f"{1e3 * turn.groove.max():.1f} mm",
                f"{np.degrees(np.arctan(turn.sideslip)):.2f}°",
            ]
        )
    return rows


def _differences(names: Sequence[str], points: Sequence[RigPoint]) -> tuple[Block, ...]:
    """Compare the radius of every other ski with the first one's."""
    edges = sorted({point.edge for point in points})
    by = {(point.ski, point.edge): point for point in points}
    rows = [["radius", *(f"{np.degrees(edge):.0f}°" for edge in edges)]]
    rows += [[name, *(_difference_text(by[name, edge], by[names[0], edge]) for edge in edges)] for name in names[1:]]
    return (Text(_ALIKE), Grid(rows)) if len(rows) > 1 else ()


def _difference_text(point: RigPoint, other: RigPoint) -> str:
    change = difference(point, other)
    if change is None:
        return "one may slip"
    remark = "" if abs(change.share) > 2.0 * change.error else ", not significant"
    return f"{100.0 * change.share:+.1f} ± {100.0 * change.error:.1f} %{remark}"


_ALIKE: Final = (
    "What is uncertain of snow and posture is the same for both skis, so the difference is known better than either "
    "radius. Differences below two standard deviations are not significant."
)


def _share_rows(points: Sequence[RigPoint]) -> list[list[str]]:
    """Return by how much each uncertain quantity changes the radius."""
    rows = [["radius with one less, one more", *(f"{source.name}, {source.amount}" for source in UNCERTAIN)]]
    for point in points:
        if point.turn is not None:
            pairs = [
                ", ".join("none" if value is None or value <= 0.0 else f"{1.0 / value:.2f}" for value in pair) + " m"
                for pair in point.curvatures
            ]
            rows.append([f"{point.ski}, {np.degrees(point.edge):.0f}°", *pairs])
    return rows


def _sources() -> tuple[str, ...]:
    return tuple(
        f"{uncertain.name}, one standard deviation {uncertain.amount}: {uncertain.source}" for uncertain in UNCERTAIN
    )


def _ski_rows(skis: Sequence[Ski]) -> list[list[str]]:
    rows = [["", "length", "widths: greatest behind, least, greatest ahead", "mass", "EI", "GJ at the boot centre"]]
    s = np.linspace(0.0, 1.0, 401)
    for ski in skis:
        width = 1e3 * ski.width(s)
        waist = int(np.argmin(np.where((s > 0.2) & (s < 0.8), width, np.inf)))
        boot = ski.s_of_x(0.0)
        rows.append(
            [
                ski.name,
                f"{ski.length:.2f} m",
                f"{width[:waist].max():.0f}, {width[waist]:.0f}, {width[waist:].max():.0f} mm",
                f"{ski.mass:.2f} kg",
                f"{float(ski.bending_stiffness(boot)):.0f} N m²",
                f"{float(ski.torsional_stiffness(boot)):.0f} N m²",
            ]
        )
    return rows


def _snow_rows(case: TurnCase) -> list[tuple[str, str, str]]:
    about = quantities(type(case.law))
    return [
        (about[name].meaning, f"{value:g} {about[name].unit}", about[name].source)
        for name, value in parameters(case.law).items()
    ]
