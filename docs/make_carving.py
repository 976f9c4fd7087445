"""Makes ``docs/notebook/carving.md``: every figure with which the law of edges that cut was compared.

Run it as ``python docs/make_carving.py``; it takes half an hour.  The closed forms use the tests' skis, so
``PYTHONPATH`` must hold ``tests/support/models``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from carved_slope import greatest_slope, turn_table
from carving_runs import (
    both_laws,
    headings,
    long_derivatives,
    long_headings,
    models_apart,
    ski_against_ski,
    stiffnesses,
    tiers,
)
from carving_skis import FIRM, LENGTH, SIDECUT, StiffSideways, WithoutGroove, WithoutPlay, bent_ski
from carving_text import END, TEXT

from sssi_exudyn.bodies.ski.ski import Profile, Ski, read_ski
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.simulation.turns.steady_turn import (
    NoSteadyTurn,
    SteadyTurn,
    TurnCase,
    edges_of,
    start_rolling,
    steady_turn,
)
from sssi_exudyn.simulation.turns.turn_rig import UNCERTAIN, RigPoint, difference, rig_points

SLALOM, GIANT = read_ski("slalom_165", "."), read_ski("giant_slalom_183", ".")
SHOP = ("fischer_rc4_sc_165", "rossignol_9gs_174", "volkl_kendo_184", "voile_v6_183", "dynastar_team_stc_150")
USUAL = Carving()
FIRMER = Carving(hardness=2e8)
SOFTER = Carving(strength=2.5e5)
EDGES = (30.0, 45.0, 60.0, 65.0, 70.0)


def turn(
    ski: Ski, edge_deg: float, law: Carving = USUAL, points: int = 100, steps: float = 1.0, **others: float
) -> SteadyTurn:
    case = TurnCase(np.radians(edge_deg).item(), law, **others)
    return steady_turn(case, start_rolling(edges_of(ski, points)), steps)[0]


@cache
def slalom(edge_deg: float) -> SteadyTurn:
    return turn(SLALOM, edge_deg)


@cache
def finest(edge_deg: float) -> SteadyTurn:
    """Return the same turn with four times the points."""
    return turn(SLALOM, edge_deg, points=400)


def metres(steady: SteadyTurn) -> str:
    return "slips" if steady.radius is None or steady.sideslip > np.radians(10.0) else f"{steady.radius:.1f}"


def percent(changed: SteadyTurn, usual: SteadyTurn) -> str:
    change = 100.0 * (usual.curvature / changed.curvature - 1.0)
    return "slips" if changed.radius is None else f"{change:+.1f} %".replace("-", "−")


def widened(ski: Ski, factor: float) -> Ski:
    """Return the ski with ``factor`` times its sidecut's depth."""
    width, waist = ski.width, min(ski.width.value)
    return replace(ski, width=Profile(width.s, tuple(waist + factor * (w - waist) for w in width.value), width.between))


def within(value: float, expected: float, tolerance: float) -> str:
    return f"{100.0 * tolerance:g} %: {'yes' if abs(value / expected - 1.0) <= tolerance else 'no'}"


def _each_within(values: Sequence[float], expected: Sequence[float], tolerance: float) -> str:
    """State whether all are within the tolerance, and by how much the others differ."""
    errors = [a / b - 1.0 for a, b in zip(values, expected, strict=True)]
    missed = ", ".join(
        f"{b:.3g} by {100.0 * error:+.0f} %"
        for b, error in zip(expected, errors, strict=True)
        if abs(error) > tolerance
    )
    return f"{100.0 * tolerance:g} %: " + (f"no: {missed}" if missed else "yes").replace("-", "−")


def rows() -> Iterator[tuple[str, str, str, str]]:
    yield from closed_forms()
    yield from sketches()
    yield from skis_and_snow()
    yield from measurements()
    yield from numbers()


def closed_forms() -> Iterator[tuple[str, str, str, str]]:
    radii, expected = [], []
    for edge_deg in (10.0, 30.0, 50.0, 70.0):
        edge = np.radians(edge_deg).item()
        radii.append(turn(bent_ski(edge), edge_deg, FIRM).radius)
        expected.append(SIDECUT * np.cos(edge))
    worst = max(abs(a / b - 1.0) for a, b in zip(radii, expected, strict=True))
    yield (
        "parabolic sidecut, edge in the snow's plane, 10, 30, 50, 70° (Howe; Jentschura)",
        "R_sc·cosθ = " + ", ".join(f"{radius:.2f}" for radius in expected) + " m",
        ", ".join(f"{radius:.2f}" for radius in radii) + " m",
        within(1.0 + worst, 1.0, 0.02),
    )
    edge, deeper, law = np.radians(60.0).item(), 2e-3, WithoutGroove(strength=1e7)
    change = turn(bent_ski(edge, deeper), 60.0, law).curvature - turn(bent_ski(edge), 60.0, law).curvature
    exact = 2.0 * deeper * np.tan(edge) / (0.5 * LENGTH) ** 2
    yield (
        "snow that springs back, middle 2 mm deeper, 60°: change of 1/R",
        f"2Δ·tanθ/ℓ² = {exact:.4f} 1/m",
        f"{change:.4f} 1/m",
        within(change, exact, 0.05),
    )
    ratios = []
    for edge_deg in EDGES[:3]:
        one = slalom(edge_deg)
        ratios.append((one.friction + one.compaction + one.skid) / one.power)
    worst = max(abs(ratio - 1.0) for ratio in ratios)
    yield (
        "energy at 30, 45, 60°: friction + compaction + skid against what is given",
        "1",
        f"{1.0 + worst:.5f} at worst",
        within(1.0 + worst, 1.0, 0.005),
    )
    start = start_rolling(edges_of(SLALOM))
    case = TurnCase(np.radians(45.0).item())
    left = steady_turn(case, start)[0]
    right = steady_turn(replace(case, edge=-case.edge), replace(start, edge=-start.edge))[0]
    yield (
        "mirrored turn",
        "mirrored",
        f"{abs(right.curvature / left.curvature + 1.0):.0e} apart",
        "1e-9: " + ("yes" if abs(right.curvature / left.curvature + 1.0) < 1e-9 else "no"),
    )
    balanced = [np.sqrt(GRAVITY * slalom(edge_deg).radius * np.tan(np.radians(edge_deg))) for edge_deg in EDGES[:3]]
    mean = mean_radius(SLALOM)
    exact_speeds = [np.sqrt(GRAVITY * mean * np.sin(np.radians(edge_deg))) for edge_deg in EDGES[:3]]
    yield (
        "balanced carve on the flat at 30, 45, 60°: speed",
        "√(g·R_sc·sinθ) = " + ", ".join(f"{speed:.1f}" for speed in exact_speeds) + " m/s",
        ", ".join(f"{speed:.1f}" for speed in balanced) + " m/s",
        _each_within(balanced, exact_speeds, 0.05)
        + "; of how much the radius is larger than R_sc·cosθ, speed has half",
    )
    yield "sideslip at 90°: force", "S_f·a·L + ρ_s·a·L·v²", "exact", "`tests/contact/test_carving.py`"


def mean_radius(ski: Ski) -> float:
    """Return the harmonic mean of the sidecut's radii, ahead of the waist and behind it (m)."""
    s, w = np.asarray(ski.width.s), np.asarray(ski.width.value)
    ahead, behind = (s[3] - s[2]) * ski.length, (s[2] - s[1]) * ski.length
    return float(2.0 / ((w[3] - w[2]) / ahead**2 + (w[1] - w[2]) / behind**2))


def sketches() -> Iterator[tuple[str, str, str, str]]:
    old = (11.2, 9.6, 6.8, 5.8, 4.8)
    slaloms = [slalom(edge_deg) for edge_deg in EDGES]
    yield (
        "slalom_165 at 30, 45, 60, 65, 70°",
        ", ".join(f"{radius:g}" for radius in old) + " m [Q, 2.5e5 Pa]",
        ", ".join(metres(steady) for steady in slaloms) + " m",
        _each_within([steady.radius or 0.0 for steady in slaloms], old, 0.1),
    )
    softer = [turn(SLALOM, edge_deg, SOFTER) for edge_deg in EDGES]
    yield (
        "the same with 2.5e5 Pa",
        "as above",
        ", ".join(metres(steady) for steady in softer) + " m",
        _each_within([steady.radius or 0.0 for steady in softer], old, 0.1)
        + f"; side reserve at 60° {softer[2].side_reserve:.2f}: the wall yields",
    )
    giant, small = turn(GIANT, 60.0, FIRMER), turn(SLALOM, 60.0, FIRMER)
    yield (
        "giant_slalom_183 and slalom_165, 60°, H = 2e8",
        "11.1 and 6.7 m [Q]",
        f"{metres(giant)} and {metres(small)} m",
        _each_within([giant.radius or 0.0, small.radius or 0.0], (11.1, 6.7), 0.1)
        + f"; side reserve {giant.side_reserve:.2f} and {small.side_reserve:.2f}: the wall yields",
    )
    usual = slalom(60.0)
    deeper, flatter = (turn(widened(SLALOM, factor), 60.0) for factor in (1.2, 0.8))
    share = 100.0 * (deeper.curvature / usual.curvature - 1.0) / 0.2
    yield (
        "sidecut's depth ×1.2, ×0.8, 60°",
        "−17, +25 % [Q]",
        f"{percent(deeper, usual)}, {percent(flatter, usual)}",
        f"sign: yes; 3 points: no: the sidecut makes {share:.0f} % of the curvature, the middle's greater depth the rest",
    )
    stiffer, softer_ski = (replace(SLALOM, young_modulus=f * SLALOM.young_modulus) for f in (1.2, 0.8))
    twisted = replace(SLALOM, shear_modulus=2.0 * SLALOM.shear_modulus)
    yield (
        "EI ×1.2, ×0.8; GJ ×2, 60°",
        "−1.3, +2.1 %; −0.4 % [Q]; torsion small (Yoneyama 2008)",
        ", ".join(percent(turn(ski, 60.0), usual) for ski in (stiffer, softer_ski, twisted)),
        "sign: yes; factor 2: no for EI, whose effect is as small as what turns are settled to, 0.2 %",
    )
    bears = turn(SLALOM, 60.0, FIRMER).most.sum() / turn(SLALOM, 60.0, WithoutGroove(hardness=2e8)).most.sum()
    yield (
        "groove's memory on/off: what the wall bears, 60°, H = 2e8",
        "×1.8 [Q]; higher (Mössner)",
        f"×{bears:.2f}",
        f"1.4 to 2.2: {'yes' if 1.4 <= bears <= 2.2 else 'no'}",
    )
    poor = turn(SLALOM, 45.0, Carving(hardness=2e8, strength=1e5))
    yield (
        "lean = θ: held at 65 and 70°; S_f = 1e5, H = 2e8 at 45°",
        "held, held; slips [Q]",
        f"{metres(slalom(65.0))} m, {metres(slalom(70.0))} m; {metres(poor)}",
        "yes" if metres(poor) == "slips" and "slips" not in (metres(slalom(65.0)), metres(slalom(70.0))) else "no",
    )


def skis_and_snow() -> Iterator[tuple[str, str, str, str]]:
    greatest = []
    ratios = (0.24, 0.48, 0.96, 1.92, 3.84)
    for ratio in ratios:
        law = Carving(strength=max(ratio * 1e-3 * USUAL.hardness, 4e4) if ratio >= 0.4 else 2.4e4)
        held, rolling = 0.0, start_rolling(edges_of(SLALOM))
        for edge_deg in np.arange(15.0, 76.0, 5.0):
            try:
                one, rolling = steady_turn(TurnCase(np.radians(edge_deg).item(), law), rolling)
            except NoSteadyTurn:
                break
            if one.radius is None or one.sideslip > np.radians(3.0):
                break
            held = edge_deg
        greatest.append(held)
    yield (
        "greatest edge angle that holds over S_f/H = 0.24, 0.48, 0.96, 1.92, 3.84 mm (sideslip below 3°)",
        "rises, 40 to 70° (Brown 1989; his angle differs)",
        ", ".join(f"{edge:.0f}" if edge else "below 15" for edge in greatest) + "°",
        "trend: " + ("yes" if list(greatest) == sorted(greatest) and greatest[-1] > greatest[0] else "no"),
    )
    ice = Carving(hardness=1e9, strength=2e6)
    usual = turn(SLALOM, 45.0, ice)
    stiff = turn(replace(SLALOM, young_modulus=1.2 * SLALOM.young_modulus), 45.0, ice)
    twist = turn(replace(SLALOM, shear_modulus=1.2 * SLALOM.shear_modulus), 45.0, ice)
    changes = [100.0 * (ski_turn.most.sum() / usual.most.sum() - 1.0) for ski_turn in (stiff, twist)]
    counts = [np.count_nonzero(ski_turn.depth) for ski_turn in (usual, stiff)]
    yield (
        "grip on ice (H = 1e9, S_f = 2e6, 45°): what the wall bears, EI +20 %, GJ +20 %",
        "−8.5 %, +24 % (secondary text)",
        ", ".join(f"{change:+.1f} %" for change in changes),
        "sign: "
        + ("yes" if changes[0] < 0.0 < changes[1] else "no")
        + f"; {counts[1]} points instead of {counts[0]} lie in the snow where the ski is stiffer, and the wall is counted along"
        " all of them",
    )
    pressed = slalom(45.0)
    inside = pressed.pressure > 0.0
    area = np.where(inside, pressed.depth / np.tan(pressed.local_edge + 1e-9), np.inf)
    kilopascals = 1e-3 * pressed.pressure / area
    mean = 1e-3 * pressed.normal / float(np.sum(area[inside]) * (pressed.place[1] - pressed.place[0]))
    yield (
        "pressure under the edge, 45°: mean, greatest",
        "50, 300 kPa (Sports Eng. 10:145)",
        f"{mean:.0f}, {kilopascals.max():.0f} kPa",
        "factor 5: " + ("yes" if 10.0 < mean < 250.0 and 60.0 < kilopascals.max() < 1500.0 else "no"),
    )


def measurements() -> Iterator[tuple[str, str, str, str]]:
    for edge_deg, radius, error, gates in ((65.7, 3.96, 0.23, 10), (71.0, 4.94, 0.59, 13)):
        steady = turn(SLALOM, edge_deg)
        yield (
            f"Reid 2020, slalom, gates {gates} m, least radius at his greatest edge angle {edge_deg:g}°; his ski is unknown",
            f"{radius:.2f} ± {error:.2f} m",
            f"{metres(steady)} m",
            within(steady.radius or 0.0, radius, 0.25)
            + f"; R_sc·cosθ of this ski is {mean_radius(SLALOM) * np.cos(np.radians(edge_deg)):.1f} m, his radius asks for a "
            f"sidecut of {radius / np.cos(np.radians(edge_deg)):.1f} m",
        )
    slopes = {
        mu: [greatest_slope(table, turns) for turns in (1, 10)]
        for mu, table in ((mu, turn_table(SLALOM, Carving(mu=mu))) for mu in (0.05, 0.1))
    }
    yield (
        "steepest slope, every 0.5°, of carved turns from traverse to traverse, balanced in each instant, out of the rig's turns "
        "up to 70°, without air: one turn, ten to both sides; the same with μ = 0.1 (`tests/simulation/turns/test_whole_turn.py`)",
        "8 to 20° by μ (Komissarov 2019): 5° yes, 25° no",
        "; ".join(", ".join(f"{slope:g}" for slope in steepest) for steepest in slopes.values()) + "°",
        "8 to 20°: "
        + ("yes" if all(8.0 <= slope <= 20.0 for steepest in slopes.values() for slope in steepest) else "no"),
    )


def numbers() -> Iterator[tuple[str, str, str, str]]:
    counts, angles = (50, 66, 100, 132), (30.0, 45.0, 60.0)
    off = {edge: abs(slalom(edge).curvature / finest(edge).curvature - 1.0) for edge in angles}
    for edge in angles:
        yield (
            f"points an edge 50, 66, 100, 132 against 400, {edge:g}°",
            "−4.5, −0.6, –, −0.1 % [Q, against 264]",
            ", ".join(percent(turn(SLALOM, edge, points=count), finest(edge)) for count in counts),
            "1 % at 100: " + ("yes" if off[edge] < 0.01 else "no"),
        )
    shortest = turn(SLALOM, 45.0, steps=0.5)
    steps = (1.0, 2.0, 4.0)
    gap = float(np.diff(edges_of(SLALOM).station).min()) / 10.0
    yield (
        "steps of " + ", ".join(f"{1e3 * gap * step:.1f}" for step in steps) + f" ms against {0.5e3 * gap:.1f} ms, 45°",
        "1 %",
        ", ".join(percent(turn(SLALOM, 45.0, steps=step), shortest) for step in steps),
        f"1 % at the rig's {1e3 * gap:.1f} ms: "
        + ("yes" if abs(slalom(45.0).curvature / shortest.curvature - 1.0) < 0.01 else "no"),
    )
    usual = slalom(60.0)
    yield (
        "centre of pressure 0.1 m back, ahead; δ = 2 mm, 60°",
        "+28, +3 %; +44 % [Q]",
        f"{percent(turn(SLALOM, 60.0, pressure=-0.1), usual)}, {percent(turn(SLALOM, 60.0, pressure=0.1), usual)}; "
        f"{percent(turn(SLALOM, 60.0, replace(USUAL, recovery=2e-3)), usual)}",
        "report",
    )
    along = (usual.friction + usual.compaction) / usual.case.speed / usual.normal
    yield (
        "as the paper's coefficients, 60°: μ_t = Σ|f|/ΣF_N, μ_n = |Σq|/ΣF_N",
        "0.06 and 0.55, 0.19 and 0.9 (the paper's fits)",
        f"{along:.3f} and {usual.lateral / usual.normal:.2f} (the lean's tangent)",
        "report",
    )


def plateau() -> str:
    """Show the radius with and without play between the walls of the groove, one thing changed at a time."""
    angles = (30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0)
    stiff = StiffSideways.of(SLALOM)
    cases: dict[str, tuple[Ski, Carving]] = {
        "walls with play": (SLALOM, USUAL),
        "the same, ρ_i = 0": (SLALOM, Carving(inside=0.0)),
        "the same, a ski that does not bend sideways": (stiff, USUAL),
        "without play": (SLALOM, WithoutPlay()),
        "without play, ρ_i = 0": (SLALOM, WithoutPlay(inside=0.0)),
        "without play, ρ_i = 1": (SLALOM, WithoutPlay(inside=1.0)),
        "without play, a ski that does not bend sideways": (stiff, WithoutPlay()),
    }
    lines = ["| | " + " | ".join(f"{edge:.0f}°" for edge in angles) + " |", "|---" * (len(angles) + 1) + "|"]
    exact = [mean_radius(SLALOM) * np.cos(np.radians(edge)) for edge in angles]
    lines.append("| R_sc·cosθ | " + " | ".join(f"{radius:.1f}" for radius in exact) + " |")
    for name, (ski, law) in cases.items():
        rolling, cells = start_rolling(edges_of(ski)), []
        for edge in angles:
            steady, rolling = steady_turn(TurnCase(np.radians(edge).item(), law), rolling)
            cells.append(metres(steady))
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def shop_table() -> str:
    skis = [read_ski(name, ".") for name in ("slalom_165", *SHOP)]
    edges = (30.0, 45.0, 60.0)
    points = rig_points(skis, [np.radians(edge) for edge in edges], TurnCase(), lambda *_: None)
    lines = [
        "\n## Skis\n",
        "Radius in metres with its bar, and side reserve, 700 N at 10 m/s (for the junior's ski more than its skier weighs).\n",
        "| ski | " + " | ".join(f"{edge:.0f}°" for edge in edges) + " |",
        "|---" * (len(edges) + 1) + "|",
    ]
    for ski in skis:
        cells = [
            _cell(point.radius, point.radius_low, point.radius_high, point.side_reserve)
            for point in points
            if point.ski == ski.name
        ]
        lines.append(f"| {ski.name} | " + " | ".join(cells) + " |")
    lines += ["\nThe same against slalom_165, whose snow and posture are the same:\n", lines[2], lines[3]]
    for ski in skis[1:]:
        pairs = [[p for p in points if p.ski == name] for name in (ski.name, "slalom_165")]
        lines.append(f"| {ski.name} | " + " | ".join(_against(*pair) for pair in zip(*pairs, strict=True)) + " |")
    lines.append("\nSources:\n")
    lines += [f"- {ski.name}: {ski.source}" for ski in skis]
    return "\n".join(lines) + "\n"


def _against(point: RigPoint, other: RigPoint) -> str:
    change = difference(point, other)
    return (
        "one may slip"
        if change is None
        else f"{100.0 * change.share:+.1f} ± {100.0 * change.error:.1f} %".replace("-", "−")
    )


def _cell(radius: float | None, low: float | None, high: float | None, reserve: float | None) -> str:
    if radius is None or low is None or reserve is None:
        return "no turn"
    return f"{radius:.1f} ({low:.1f} to {'slips' if high is None else f'{high:.1f}'}), {reserve:.2f}"


def table(lines: Sequence[tuple[str, str, str, str]]) -> str:
    return "\n".join("| " + " | ".join(row) + " |" for row in lines) + "\n"


def main() -> None:
    names = ", ".join(f"{source.name} ({source.amount})" for source in UNCERTAIN)
    head = TEXT.format(
        uncertain=names, stiffnesses=stiffnesses(),
        laws=both_laws(), headings=headings(), long_headings=long_headings(), against=ski_against_ski(), costs=tiers(),
        derivatives=long_derivatives(), plateau=plateau(), apart=models_apart(),
    )  # fmt: skip
    Path(__file__).with_name("notebook").joinpath("carving.md").write_text(
        head + table(list(rows())) + shop_table() + END, encoding="utf-8"
    )


if __name__ == "__main__":
    main()
