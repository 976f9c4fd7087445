"""A diagnosis as a part of the result's page: the sentence, the evidence, the missing force, before and after."""

from __future__ import annotations

from html import escape

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.html import Section, figure, table
from sssi_exudyn.validation.diagnosis.findings import Diagnosis, Finding
from sssi_exudyn.validation.diagnosis.missing_force import DIRECTIONS, MissingForce
from sssi_exudyn.validation.diagnosis.search import Round

_COLOURS = (plots.SIMULATED, plots.MEASURED, plots.OTHER)


def diagnosis_section(diagnosis: Diagnosis) -> Section:
    """What was missing, as a section of the page."""
    parts = [
        f"<p>{escape(diagnosis.sentence)}</p>\n",
        figure(
            _error_svg(diagnosis),
            "Horizontal distance between simulated antenna and GPS, before and after; the band is the noise's σ"
            + (", shaded where something was found" if diagnosis.findings else ""),
        ),
        figure(
            _force_svg(diagnosis.missing, "missing"),
            "Force that the model lacks, with twice its standard deviation; dots stand out from what noise shows",
        ),
    ]
    if diagnosis.findings:
        parts.append(
            figure(_force_svg(diagnosis.left, "left"), "The same once everything that was found is in the model")
        )
    parts += [_finding(finding) for finding in diagnosis.findings]
    parts.append(_weighed(diagnosis.rounds[0]))
    parts.append(table("Noise as it is", _noise_rows(diagnosis)))
    return Section("What was left out", "".join(parts))


def _finding(finding: Finding) -> str:
    before, after = finding.before, finding.after
    rows = [
        (name, f"{n.value:.4g} {'' if n.unit == '1' else n.unit}", f"90 % interval {n.low:.4g} to {n.high:.4g}")
        for name, n in finding.parameters.items()
    ]
    rows += [
        ("mean error (m)", f"{after.trajectory_error:.3f}", f"{before.trajectory_error:.3f} before"),
        ("on turns not fitted (m)", f"{after.held_out_error:.3f}", f"{before.held_out_error:.3f} before"),
        (
            "the same, placebos (m)",
            f"{np.median(finding.placebos):.3f}",
            f"median of {len(finding.placebos)} forces drawn at random in its place; the best of them "
            f"{np.min(finding.placebos):.3f}",
        ),
        ("χ² per degree of freedom", f"{after.chi2_per_dof:.2f}", f"{before.chi2_per_dof:.2f} before; 1 is noise"),
        ("memory of what is left", f"{after.whiteness:+.2f}", f"{before.whiteness:+.2f} before; 0 is noise"),
    ]
    if finding.where is not None:
        where = finding.where
        place = f"{where.distance[0]:.1f} m to {where.distance[1]:.1f} m of the path; {', '.join(where.phases)}"
        rows.insert(0, ("when", f"{where.t0:.1f} s to {where.t1:.1f} s", place))
    return table(f"{finding.name.replace('_', ' ')} ({finding.probability:.0%})", rows)


def _weighed(weighed: Round) -> str:
    """Every hypothesis with its probability, the most probable first."""
    none = weighed.nothing.log_evidence
    rows = [
        (
            (v.name or "nothing is missing").replace("_", " "),
            f"{v.probability:.1%}",
            ""
            if not v.name
            else f"log evidence {v.log_evidence - none:+.1f} against nothing" + ("" if v.fit is None else "; refitted"),
        )
        for v in weighed.verdicts
    ]
    return table("Every hypothesis weighed", rows)


def _noise_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    noise = diagnosis.noise
    return [
        ("GPS (m)", f"{noise.gps.sigma:.3f}", f"remembers for {noise.gps.correlation_time:.1f} s"),
        ("GPS height (m)", f"{noise.height.sigma:.3f}", f"remembers for {noise.height.correlation_time:.1f} s"),
        ("insoles, total (N)", f"{noise.load.sigma:.0f}", ""),
        ("insoles, left less right (N)", f"{noise.difference.sigma:.0f}", ""),
        ("capture (°)", f"{np.degrees(noise.capture):.2f}", "of each segment's orientation, wandering over seconds"),
    ]


def _error_svg(diagnosis: Diagnosis) -> str:
    measurements, blocks = diagnosis.measurements, diagnosis.measurements.blocks

    def draw(axes: Axes) -> None:
        for finding in diagnosis.findings:
            if finding.where is not None:
                axes.axvspan(finding.where.t0, finding.where.t1, color=plots.OTHER, alpha=0.15, linewidth=0)
        axes.axhspan(0.0, diagnosis.noise.gps.sigma, color=plots.MEASURED, alpha=0.2, linewidth=0, label="GPS σ")
        shown = [("before", diagnosis.residual_before, plots.MEASURED, "--")]
        if diagnosis.findings:
            shown.append(("after", diagnosis.residual_after, plots.SIMULATED, "-"))
        for label, residual, colour, style in shown:
            distance = np.hypot(residual[blocks["x"]], residual[blocks["y"]])
            axes.plot(measurements.fixes, distance, color=colour, linestyle=style, label=label)
        axes.set(xlabel="time (s)", ylabel="distance (m)", ylim=(0.0, None))

    return plots.svg("diagnosis-error", draw)


def _force_svg(missing: MissingForce, name: str) -> str:
    middles = 0.5 * (missing.edges[1:] + missing.edges[:-1])

    def draw(axes: Axes) -> None:
        for k, (direction, colour) in enumerate(zip(DIRECTIONS, _COLOURS, strict=True)):
            force, band = missing.force[:, k], missing.band[:, k]
            axes.fill_between(middles, force - 2.0 * band, force + 2.0 * band, color=colour, alpha=0.12, linewidth=0)
            axes.plot(middles, force, color=colour, linestyle=("-", "--", ":")[k], label=direction)
            out = missing.stands_out[:, k]
            axes.plot(middles[out], force[out], "o", color=colour, markersize=4.0)
        axes.axhline(0.0, color=plots.INK, linewidth=0.6)
        axes.set(xlabel="time (s)", ylabel="force (N)")

    return plots.svg(f"diagnosis-force-{name}", draw)
