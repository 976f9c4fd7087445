"""The uncertainty of a fit: friction's intervals and their sources, and the corrections of the posture."""

from __future__ import annotations

from sssi_exudyn.reports.section import Block, Grid, Heading, Runs, Section, Text, say_of_each, section_of_each
from sssi_exudyn.reports.sections.tables import number
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Estimate, Summary, UncertaintyFigures

_NAMES = {
    "mu_t": "μ_t, along the ski",
    "mu_n": "μ_n, across it: largest lateral load ratio",
    "mu": "μ, along the edges",
    "hardness": "H, hardness (N/m³)",
    "strength": "S_f, strength (Pa)",
}
_UNITS = {"fixes": "m", "height": "m", "speed": "m/s", "load": "N", "load difference": "N", "moment": "N m"}
"""By the name of a measurement in a summary."""
_LARGE = 10.0
"""Size from which three digits are shown."""
_LEAST = 0.005
"""Least share of a variance that is shown."""


def uncertainty(runs: Runs) -> Section:
    """Show intervals, their budget, noise of the instruments, and corrections of the posture."""
    return section_of_each("Uncertainty", runs, _blocks, say_of_each(runs, _sources))


def _sources(run: StoredRun) -> str:
    """State where most of the first number's uncertainty comes from."""
    figures = run.summary.uncertainty
    if figures is None:
        return ""
    if figures.withheld is not None or not figures.shares:
        return f"there are no intervals: {figures.withheld or 'nothing was estimated'}"
    name, shares = next(iter(figures.shares.items()))
    largest = sorted(shares.items(), key=lambda part: -part[1])[:2]
    sources = " and ".join(f"{group} ({100.0 * share:.0f}\u00a0%)" for group, share in largest)
    return f"most of the uncertainty of {_NAMES[name].partition(',')[0]} comes from {sources}"


def _value(summary: Summary, key: str) -> float | None:
    """Return the number to which an interval belongs."""
    cut = summary.carving
    if cut is None:
        estimate: Estimate = getattr(summary.friction, key)
        return estimate.value
    return {"mu": cut.mu, "hardness": cut.hardness_N_m3, "strength": cut.strength_Pa}[key].value


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    figures = run.summary.uncertainty
    if figures is None:
        return ()
    if figures.withheld is not None:
        return (Text(f"There are no intervals: {figures.withheld}."), *_noise_and_corrections(figures))
    intervals = [["friction", "estimate", "90 % interval"]]
    for key, interval in figures.interval_90.items():
        low, high = (f"{end:.4f}" if abs(end) < _LARGE else f"{end:.3g}" for end in (interval.low, interval.high))
        intervals.append([_NAMES[key], number(_value(run.summary, key), 4), f"{low} to {high}"])
    groups = sorted(
        {group for parts in figures.shares.values() for group, part in parts.items() if part >= _LEAST},
        key=lambda group: -max(parts.get(group, 0.0) for parts in figures.shares.values()),
    )
    budget = [["share of the variance", *(_NAMES[key] for key in figures.shares)]]
    budget += [
        [group, *(f"{100.0 * parts.get(group, 0.0):.0f} %" for parts in figures.shares.values())] for group in groups
    ]
    return (
        Grid(intervals),
        Heading("Sources of the uncertainty"),
        Grid(budget),
        *_noise_and_corrections(figures),
    )


def _noise_and_corrections(figures: UncertaintyFigures) -> tuple[Block, ...]:
    noise = [["measurement", "standard deviation", "times the usual", "correlated over (s)"]]
    noise += [
        [
            name,
            f"{level.sigma:.3g} {_UNITS.get(name, '')}".rstrip(),
            "" if level.times_usual is None else f"{level.times_usual:.1f}",
            f"{level.correlation_s:.2g}",
        ]
        for name, level in figures.noise.items()
    ]
    posture = [["joint coordinate", "corrected by (° rms)"]]
    posture += [[name.replace("_", " "), f"{degrees:.2f}"] for name, degrees in figures.posture_rms_deg.items()]
    largest = [["correction", "standard deviations"]]
    largest += [[correction.what, f"{correction.sigmas:+.1f}"] for correction in figures.largest]
    verdict = (
        "All corrections are within three standard deviations of what the instruments allow."
        if figures.fits_priors
        else "At least one correction is beyond three standard deviations. The posture, or what was stated, "
        "contradicts the measurements by more than the known errors of the instruments."
    )
    return (
        Heading("Noise of the measurements"),
        Grid(noise),
        Heading("Largest corrections, and those of the posture"),
        Text(verdict),
        Grid(largest),
        Grid(posture),
    )
