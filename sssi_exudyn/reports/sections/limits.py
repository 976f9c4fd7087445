"""What a result rests on: what every run assumes, and what was assumed of these."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.reports.section import Block, Items, Runs, Section, section_of_each
from sssi_exudyn.results.stored import StoredRun

_ALWAYS: Final = (
    "The movement is prescribed as it was captured: on other snow the skier would move otherwise.",
    "Snow is of one kind along the run but for what a diagnosis found.",
    "Segments' masses are an average person's of that sex, mass and height; boots carry no moment, poles no force.",
)


def limits(runs: Runs) -> Section:
    """A list before everything else: what every run assumes, then what holds of each of these."""
    return Section("Limits and assumptions", (Items(_ALWAYS), *section_of_each("", runs, _own).blocks))


def _own(run: StoredRun) -> tuple[Block, ...]:
    lines = tuple(_lines(run))
    return (Items(lines),) if lines else ()


def _lines(run: StoredRun) -> list[str]:
    summary = run.summary
    found, moment = summary.uncertainty, summary.residual_moment
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
    if summary.fit.method is not None and found is None and summary.posture is None:
        lines.append("Standard errors count the track's residual alone, not posture, mass or antenna.")
    if found is not None and not found.fits_priors:
        worst = found.largest[0]
        much = f"had to be corrected by {abs(worst.sigmas):.1f} standard deviations"
        what = worst.what[:1].upper() + worst.what[1:]
        lines.append(f"{what} {much}: what is stated of it, or the model, is wrong.")
    if found is not None and found.missed is not None:
        kind, times = found.missed
        lines.append(
            f"What is left over of the {kind} is {times:.0f} times the noise of such instruments: the model leaves"
            " something out, such as waves of the snow that no height shows, and the intervals may not hold that."
        )
    if moment.verdict == "bad":
        size = f"{moment.rms_Nm:.0f} N m rms, {moment.peak_Nm:.0f} N m at most"
        lines.append(
            f"The residual moment at the pelvis ({size}) is bad by OpenSim's thresholds:"
            " moments of hips and trunk are as uncertain."
        )
    if run.diagnosis is not None and run.diagnosis.tier == "reduced":
        lines.append("Diagnosed by the reduced model alone: no fit was confirmed by the full one.")
    return lines
