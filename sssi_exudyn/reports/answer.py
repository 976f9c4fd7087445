"""The answer of a result in a handful of figures: the tiles of its page and the lines of a terminal."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.analysis.biomechanics import WEDGE_DEG
from sssi_exudyn.core.text import metres
from sssi_exudyn.reports.section import Tile
from sssi_exudyn.reports.sentences import SKIDDED_DEG, mean_of, steering_is_assumed
from sssi_exudyn.reports.verdict import verdict_of
from sssi_exudyn.results.summary import Estimate, Summary

PLUS_MINUS: Final = (
    "± is one standard deviation: of the error of an estimate, and of the spread between turns. A 90\u00a0% interval"
    " holds the true value nine times in ten."
)
"""What ± means, said once on a page."""


def tiles_of(summary: Summary) -> tuple[Tile, ...]:
    """Return friction, turns, technique, and agreement with track and load; what is not known is left out."""
    tiles = (*_friction(summary), _turns(summary), _technique(summary), _track(summary), _load(summary))
    return tuple(tile for tile in tiles if tile is not None)


def lines_of(summary: Summary) -> tuple[str, ...]:
    """Return the answer in four lines: friction, turns with technique, agreement, and the verdict."""
    verdict = verdict_of(summary)
    turns = [_turns(summary), _technique(summary)]
    agreement = [_track(summary), _load(summary)]
    return (
        f"{summary.recording}: {_joined(_friction(summary)) or 'no friction is known'}",
        f"turns: {_joined([tile for tile in turns if tile is not None]) or 'none is known'}",
        f"agreement: {_joined([tile for tile in agreement if tile is not None]) or 'there is no GPS track'}",
        f"verdict: {verdict.words}. {verdict.sentence}",
    )


def _joined(tiles: list[Tile]) -> str:
    """Return tiles as clauses of a line."""
    clauses = []
    for tile in tiles:
        name = tile.name if tile.short is None else tile.short
        clauses.append(f"{name} {tile.value}".strip() + (f" ({tile.note})" if tile.note else ""))
    return "; ".join(clauses)


def _friction(summary: Summary) -> list[Tile]:
    """Return the coefficients with their intervals, those of edges that cut where edges cut.

    Few sensors tell effective friction best: it comes first there.
    """
    cut = summary.carving
    if cut is not None:
        note = _certainty(summary, "mu", cut.mu)
        return [_coefficient("μ along the edges", cut.mu, note)] if cut.mu.value is not None else []
    named = (("μ_t", "mu_t", "along the ski"), ("μ_n", "mu_n", "largest lateral load ratio"))
    tiles = [] if summary.posture is None else _effective(summary.posture.effective_friction)
    for name, key, meaning in named:
        estimate: Estimate = getattr(summary.friction, key)
        if estimate.value is not None:
            tiles.append(_coefficient(name, estimate, _certainty(summary, key, estimate), meaning))
    return tiles


def _effective(estimate: Estimate) -> list[Tile]:
    if estimate.value is None:
        return []
    error = "" if estimate.se is None else f"± {estimate.se:.3f}, "
    return [Tile("effective friction", f"{estimate.value:.3f}", f"{error}skidding included")]


def _coefficient(name: str, estimate: Estimate, note: str, meaning: str = "") -> Tile:
    return Tile(f"{name}, {meaning}" if meaning else name, f"{estimate.value:.3f}", note, short=name)


def _certainty(summary: Summary, key: str, estimate: Estimate) -> str:
    uncertainty = summary.uncertainty
    if uncertainty is not None and key in uncertainty.interval_90:
        interval = uncertainty.interval_90[key]
        return f"90\u00a0% interval {interval.low:.3f} to {interval.high:.3f}"
    if estimate.se is not None:
        return f"± {estimate.se:.3f}"
    return "stated, not fitted" if summary.fit.method is None else "no interval"


def _turns(summary: Summary) -> Tile | None:
    count, seconds = summary.turns.count, summary.solver.simulated_s
    if count is None or seconds is None:
        return None
    speed, radius = mean_of(summary, "mean_speed_mps"), mean_of(summary, "turn_radius_m")
    note = f"in {seconds:.0f} s"
    if speed is not None and radius is not None:
        note += f", {speed:.1f} m/s, radius {radius:.1f} m"
    return Tile("turns", str(count), note, short="")


def _technique(summary: Summary) -> Tile | None:
    style = summary.technique
    if style is not None:
        likely = f"{100.0 * getattr(style, style.most_likely):.0f}\u00a0% probable, from friction, slope and speed"
        return Tile("technique", style.most_likely, likely, short="")
    apart, steering = mean_of(summary, "ski_angle_mean_deg"), mean_of(summary, "steering_angle_mean_deg")
    if apart is None or steering is None or steering_is_assumed(summary):
        return None
    edge = "skidded" if steering >= SKIDDED_DEG else "almost carved"
    note = f"skis {steering:.0f}° off their path"
    if summary.posture is not None:  # which sets the skis parallel, and the load on them
        return Tile("technique", edge, note, short="")
    skis = f"wedge of {apart:.0f}°" if apart >= WEDGE_DEG else f"parallel to {apart:.0f}°"
    share = mean_of(summary, "outside_force_share", "control")
    load = "" if share is None else f", outside ski bears {100.0 * share:.0f}\u00a0% in mid-turn"
    return Tile("technique", f"{edge}, {skis}", note + load, short="")


def _track(summary: Summary) -> Tile | None:
    trajectory = summary.trajectory
    if trajectory.mean_error_m is None:
        return None
    most = "" if trajectory.max_error_m is None else f", {metres(trajectory.max_error_m)} m at most"
    return Tile("track", f"{metres(trajectory.mean_error_m)} m", f"from the GPS on average{most}")


def _load(summary: Summary) -> Tile | None:
    ratio = summary.pressure_ratio
    if ratio.correlation is None:
        return None
    note = f"from the insoles, correlation {ratio.correlation:.3f}"
    value = "–" if ratio.rmsd is None else f"{100.0 * ratio.rmsd:.0f}\u00a0%"
    return Tile("load share", value, f"rms {note}" if ratio.rmsd is not None else note)
