"""The basis of a result: the assumptions of every run, and those of these runs."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.reports.section import Block, Items, Runs, Section, section_of_each
from sssi_exudyn.reports.verdict import moment_sentence
from sssi_exudyn.results.stored import StoredRun

_ALWAYS: Final = (
    "The movement is prescribed as it was captured: on other snow the skier would move differently.",
    "The model assumes uniform snow, except where the diagnosis found otherwise.",
    "Segments' masses are an average person's of that sex, mass and height.",
    "A boot's cuff is a spring. Poles push on the snow only where a measurement or the diagnosis says so.",
)


def limits(runs: Runs) -> Section:
    """List before everything else the assumptions of every run, then those of each of these."""
    own = section_of_each("", runs, _own).blocks
    count = len(_ALWAYS) + sum(len(block.lines) for block in own if isinstance(block, Items))
    sentence = f"The movement is prescribed as it was captured; the result rests on {count} assumptions."
    return Section("Limits and assumptions", (Items(_ALWAYS), *own), sentence)


def _own(run: StoredRun) -> tuple[Block, ...]:
    lines = tuple(_lines(run))
    return (Items(lines),) if lines else ()


def _lines(run: StoredRun) -> list[str]:
    summary = run.summary
    uncertainty = summary.uncertainty
    lines = [notice for notice in summary.notices if notice.startswith("assumed")]
    if summary.carving is None:
        lines.append("Friction acts at the foot, not along the edge.")
    else:
        kept = "heading and balance are" if summary.carving.heading == "replay" else "balance is"
        lines.append(f"Edges cut the snow, but the skier's {kept} captured.")
    if summary.posture is not None:
        measured = ", ".join(summary.posture.measured)
        lines.append(f"Few sensors: measured {measured}; all else of the posture is assumed.")
    if summary.fit.method is None:
        lines.append("Nothing was fitted: the run was simulated with the friction that its model states.")
    elif summary.fit.converged is False:
        lines.append(f"The fit did not converge: {summary.fit.reason or 'no reason is given'}.")
    if summary.fit.method is not None and uncertainty is None and summary.posture is None:
        lines.append("Standard errors count the track's residual alone, not posture, mass or antenna.")
    if uncertainty is not None and uncertainty.withheld is not None:
        lines.append(f"{uncertainty.withheld[:1].upper()}{uncertainty.withheld[1:]}.")
    if uncertainty is not None and not uncertainty.fits_priors:
        worst = uncertainty.largest[0]
        much = f"had to be corrected by {abs(worst.sigmas):.1f} standard deviations"
        what = worst.what[:1].upper() + worst.what[1:]
        lines.append(f"{what} {much}: its stated value or the model is wrong.")
    if uncertainty is not None and uncertainty.missed is not None:
        kind, times = uncertainty.missed
        lines.append(
            f"The residual of the {kind} is {times:.0f} times the noise of such instruments. The model leaves something"
            " out, such as waves of the snow that no height shows, and the intervals may not hold that."
        )
    if summary.residual_moment.verdict == "bad":
        lines.append(f"{moment_sentence(summary)} Moments of hips and trunk are as uncertain as the residual moment.")
    if run.diagnosis is not None and run.diagnosis.tier == "reduced":
        lines.append("Diagnosed by the reduced model alone: no fit was confirmed by the full one.")
    return lines
