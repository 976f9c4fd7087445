"""The page that compares skis in steady turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.contact.term import formula, parameters
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.reports.html import document
from sssi_exudyn.reports.section import Block, Facts, Grid, Heading, Items, Panel, Panels, Section, Text
from sssi_exudyn.reports.sections.tables import unit_text
from sssi_exudyn.reports.ski_curves import line_of, side_by_side, ski_curves
from sssi_exudyn.simulation.turns.steady_turn import SteadyTurn, TurnCase
from sssi_exudyn.simulation.turns.turn_rig import UNCERTAIN, Difference, RigPoint, difference


def turn_page(skis: Sequence[Ski], points: Sequence[RigPoint], case: TurnCase) -> str:
    """Return the page for skis and their points, all of one case except for the edge angle."""
    names = [ski.name for ski in skis]
    answers = "".join(f'<p class="result">{escape(sentence)}</p>\n' for sentence in turn_sentences(names, points))
    resultant = ", ".join(
        f"{case.load / np.cos(edge):.0f} N at {np.degrees(edge):.0f}°"
        for edge in sorted({point.edge for point in points})
    )
    lead = answers + (
        f"<p>{escape(', '.join(names))}: one ski at {case.speed:g} m/s. It carries {case.load:g} N along the snow's "
        "normal at every edge angle, as the weight does in a turn. The centripetal force puts the resultant "
        f"square to the base: {resultant}. Bars are one standard deviation of what is uncertain of snow and "
        f"posture{_own_errors(skis)}.</p>\n"
    )
    sections = [
        Section("Radius", (_over_edge(names, points, "radius (m)", _radius_bar), Grid(_radius_rows(names, points)))),
        Section(f"Against {names[0]}", _differences(names, points)),
        Section("Side reserve", (Text(_RESERVE), _over_edge(names, points, "side reserve", _reserve_bar))),
        Section(
            "What the snow takes",
            (Text(_BALANCE), _over_edge(names, points, "drag (N)", _drag), *_loss_tables(names, points)),
        ),
        Section("Along the edge", _along(names, points)),
        Section("What the bars are made of", (*_share_tables(skis, points), Items(_sources()))),
        Section(
            "Skis",
            (*_ski_tables(skis), ski_curves(skis), Items(tuple(f"{ski.name}: {ski.source}" for ski in skis))),
        ),
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


def _over_edge(names: Sequence[str], points: Sequence[RigPoint], label: str, bar: _Bar) -> Panels:
    def draw(axes: Axes) -> None:
        for index, name in enumerate(names):
            own = [point for point in points if point.ski == name]
            edge = np.degrees([point.edge for point in own]) + 0.3 * (index - 0.5 * (len(names) - 1))
            value, less, more = np.array([bar(point) for point in own]).T
            axes.errorbar(edge, value, (less, more), capsize=2.0, marker="o", markersize=3.0, **line_of(index))
        axes.set_xlabel("edge angle (degrees)")
        axes.set_ylim(bottom=0.0)

    panel = Panel(label, "over the edge angle", draw)
    return side_by_side(names, [panel], f"{label[0].upper()}{label[1:]} over the edge angle, one line a ski")


def _along(names: Sequence[str], points: Sequence[RigPoint]) -> tuple[Block, ...]:
    """Draw quantities along the edge, at the edge angle nearest to 60 degrees at which all skis turn."""
    edges = sorted({point.edge for point in points}, key=lambda edge: abs(edge - np.radians(60.0)))
    of_edges = [[point.turn for point in points if point.edge == edge and point.radius is not None] for edge in edges]
    shared = [[turn for turn in turns if turn is not None] for turns in of_edges if len(turns) == len(names)]
    if not shared:
        return (Text("There is no edge angle at which all skis turn."),)
    turns = shared[0]
    edge_words = f"at {np.degrees(turns[0].case.edge):.0f} degrees"

    def panel(label: str, of: Callable[[SteadyTurn], Array]) -> Panel:
        def draw(axes: Axes) -> None:
            for index, turn in enumerate(turns):
                axes.plot(1e3 * turn.place, of(turn), **line_of(index))
            axes.set_xlabel("ahead of the boot centre (mm)")

        return Panel(label, f"along the edge, {edge_words}", draw)

    panels = (
        panel("pressure (kN/m)", lambda turn: 1e-3 * turn.pressure),
        panel("side force (kN/m)", lambda turn: 1e-3 * turn.across),
        panel("share of the wall used", _used),
        panel("slip across (m/s)", lambda turn: np.where(turn.depth > 0.0, turn.slip, np.nan)),
        panel("groove (mm)", lambda turn: 1e3 * np.where(turn.depth > 0.0, turn.groove, np.nan)),
    )
    return (side_by_side(names, panels, f"Along the edge, {edge_words}"),)


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
    """Return the table of drag and power of one ski's points, the headline first: losses and what they leave over."""
    rows = [["", "drag", "power", "friction", "compaction", "skid", "left over", "groove", "sideslip"]]
    for point in points:
        turn = point.turn
        name = f"{np.degrees(point.edge):.0f}°"
        if turn is None:
            rows.append([name, point.problem, *[""] * (len(rows[0]) - 2)])
            continue
        taken = (turn.friction, turn.compaction, turn.skid)
        rows.append(
            [
                name,
                f"{turn.drag:.0f} N",
                *(f"{round(power)} W" for power in (turn.power, *taken, turn.power - sum(taken))),
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
    low, high = (100.0 * bound for bound in change.interval)
    remark = "" if change.is_significant else ": may be none"
    return f"{100.0 * change.share:+.1f} % ({low:+.1f} to {high:+.1f}){remark}".replace("-", "−")


_ALIKE: Final = (
    "Snow and posture are the same for both skis: harder snow changes both radii at once. The interval of a difference "
    "counts by how much each of these errors changes the ratio of the radii. It adds the errors of either ski's own "
    "stiffness. It is two standard deviations wide to each side, some 95 %. So it may exclude zero although the bars "
    "of the radii overlap, and may hold zero although they do not."
)


def turn_sentences(names: Sequence[str], points: Sequence[RigPoint]) -> list[str]:
    """Return a sentence for each further ski: how much tighter or wider than the first it turns, and where."""
    by = {(point.ski, point.edge): point for point in points}
    edges = sorted({point.edge for point in points})
    if len(names) == 1:
        radii = [(edge, by[names[0], edge].radius) for edge in edges]
        known = [f"{radius:.1f} m at {np.degrees(edge):.0f}°" for edge, radius in radii if radius is not None]
        return [f"{names[0]} turns with a radius of {', '.join(known)}." if known else f"{names[0]} finds no turn."]
    sentences = []
    for name in names[1:]:
        changes = [difference(by[name, edge], by[names[0], edge]) for edge in edges]
        significant = [change for change in changes if change is not None and change.is_significant]
        parts = [_said([c for c in significant if (c.share < 0.0) == tighter], word) for tighter, word in _DIRECTIONS]
        words = " and ".join(part for part in parts if part)
        if not words:
            sentences.append(f"{name} turns like {names[0]}: no difference between their radii is significant.")
            continue
        sentences.append(f"{name} {words}, compared with {names[0]}.")
    return sentences


_DIRECTIONS: Final = ((True, "tighter"), (False, "wider"))


def _said(changes: Sequence[Difference], word: str) -> str:
    if not changes:
        return ""
    shares = [abs(100.0 * change.share) for change in changes]
    degrees = [float(np.degrees(change.edge)) for change in changes]
    return f"turns {_span(shares)} % {word} at {_span(degrees)}°"


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return low if low == high else f"{low} to {high}"


def _own_errors(skis: Sequence[Ski]) -> str:
    """Name the skis whose stiffness has errors of its own."""
    known = [ski.name for ski in skis if ski.uncertainty is not None]
    if not known:
        return "; the skis are taken as exactly known"
    return f", and of stiffness and outline of {escape(', '.join(known))}"


def _loss_tables(names: Sequence[str], points: Sequence[RigPoint]) -> tuple[Block, ...]:
    """Return the losses of each ski as a table of its own."""
    blocks: list[Block] = []
    for name in names:
        blocks += [Heading(name), Grid(loss_rows([point for point in points if point.ski == name]))]
    return tuple(blocks)


_OWN: Final = ("bending stiffness", "torsional stiffness", "outline")


def _share_tables(skis: Sequence[Ski], points: Sequence[RigPoint]) -> tuple[Block, ...]:
    """Return by how much each uncertain quantity changes the radius (m), a table a ski and a row a quantity."""
    blocks: list[Block] = []
    for ski in skis:
        own = [point for point in points if point.ski == ski.name and point.turn is not None]
        if not own:
            continue
        rows = [["radius (m) with one less, one more", *(f"{np.degrees(point.edge):.0f}°" for point in own)]]
        for index, source in enumerate(UNCERTAIN):
            rows.append([f"{source.name}, {source.amount}", *(_radii(point.curvatures[index]) for point in own)])
        if ski.uncertainty is not None:
            shares = (ski.uncertainty.bending, ski.uncertainty.torsion, ski.uncertainty.outline)
            for index, (word, share) in enumerate(zip(_OWN, shares, strict=True)):
                rows.append([f"{word}, {100.0 * share:.1f} %", *(_radii(point.own[index]) for point in own)])
        blocks += [Heading(ski.name), Grid(rows)]
    return tuple(blocks)


def _radii(pair: tuple[float | None, float | None]) -> str:
    return ", ".join("none" if value is None or value <= 0.0 else f"{1.0 / value:.2f}" for value in pair)


def _sources() -> tuple[str, ...]:
    return tuple(
        f"{uncertain.name}, one standard deviation {uncertain.amount}: {uncertain.source}" for uncertain in UNCERTAIN
    )


def _ski_tables(skis: Sequence[Ski]) -> tuple[Block, ...]:
    """Return a table of the skis' sizes and one of their stiffness at the boot centre."""
    sizes = [["", "length", "width behind", "waist", "width ahead", "sidecut radius", "mass"]]
    stiffness = [["at the boot centre", "EI", "GJ"]]
    for ski in skis:
        behind, waist, ahead = (f"{1e3 * float(ski.width(s)):.0f} mm" for s in ski.widest_and_waist())
        radius, boot = ski.sidecut_radius(), ski.s_of_x(0.0)
        lengths = [f"{ski.length:.2f} m", behind, waist, ahead]
        sizes.append([ski.name, *lengths, f"{radius:.1f} m" if np.isfinite(radius) else "none", f"{ski.mass:.2f} kg"])
        values = float(ski.bending_stiffness(boot)), float(ski.torsional_stiffness(boot))
        errors = (None, None) if ski.uncertainty is None else (ski.uncertainty.bending, ski.uncertainty.torsion)
        stiffness.append([ski.name, *(_stiffness(*pair) for pair in zip(values, errors, strict=True))])
    return Grid(sizes), Grid(stiffness)


def _stiffness(value: float, error: float | None) -> str:
    return f"{value:.0f} N m²" if error is None else f"{value:.0f} ± {error * value:.0f} N m²"


def _snow_rows(case: TurnCase) -> list[tuple[str, str, str]]:
    about = quantities(type(case.law))
    return [
        (about[name].meaning, f"{value:g} {unit_text(about[name].unit)}".rstrip(), about[name].source)
        for name, value in parameters(case.law).items()
    ]
