"""A diagnosis: the sentence, the evidence, the missing force, before and after."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import (
    Block,
    Drawing,
    Facts,
    Heading,
    Runs,
    Section,
    Text,
    say_of_each,
    section_of_each,
)
from sssi_exudyn.reports.sections.similar_run import similar_run
from sssi_exudyn.reports.sections.tables import in_reading_units
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.validation.diagnosis.diagnosis_data import (
    NOTHING_MISSING,
    Chance,
    Change,
    Diagnosis,
    Finding,
    ForceByFoot,
    ForceOverTime,
    LatentForce,
    Likeness,
    Next,
    Noise,
    Number,
    Smallest,
    TrackDistance,
    Way,
    Weighed,
)
from sssi_exudyn.validation.diagnosis.search.missing_force import DIRECTIONS
from sssi_exudyn.validation.diagnosis.wording.sentence import percent

Row = tuple[str, str, str]
_BARS = 10
"""Greatest number of explanations that are drawn, and their least probability."""
_DRAWN = 0.005
_LEAST_SAID = 5e-4
"""Probability below which no number is said: a search is not so certain."""
_LONGEST = 0.12
"""Length of the longest arrow, as a share of the path's."""


def diagnosis(runs: Runs) -> Section:
    """Show what was missing; figures without data in the diagnosis are left out."""
    return section_of_each(
        "Diagnosis",
        runs,
        lambda run: () if run.diagnosis is None else diagnosis_blocks(run.diagnosis),
        say_of_each(runs, _first_sentence),
    )


def _first_sentence(run: StoredRun) -> str:
    """Return the first sentence of a diagnosis, without its full stop; numbers hold points, but none before a space."""
    return "" if run.diagnosis is None else run.diagnosis.sentence.partition(". ")[0].rstrip(".")


def diagnosis_blocks(diagnosis: Diagnosis) -> tuple[Block, ...]:
    """Return the section of one diagnosis."""
    blocks: list[Block] = [Text(diagnosis.sentence)]
    if diagnosis.paragraph:
        blocks += [Heading("For the coach"), Text(diagnosis.paragraph)]
    if diagnosis.track_distance is not None:
        distance = diagnosis.track_distance
        blocks.append(Drawing(_distance_caption(diagnosis), lambda axes: _draw_distance(axes, diagnosis, distance)))
    if diagnosis.latent_force is not None:
        before, after = diagnosis.latent_force.before, diagnosis.latent_force.after
        caption = (
            "Force that the model lacks, about the first fit, with twice its standard deviation of a force of unknown "
            "size; dots exceed what noise alone would show where nothing is missing, a narrower limit"
        )
        blocks.append(Drawing(caption, lambda axes: draw_force(axes, before)))
        if diagnosis.findings:
            caption = f"The same with {_captions(diagnosis)} in the model"
            blocks.append(Drawing(caption, lambda axes: draw_force(axes, after)))
        if before.by_foot is not None:
            for side, on_foot in _by_foot(before, before.by_foot):
                caption = f"The same force on the {side} foot, if the snow exerts it, as the insoles show it"
                blocks.append(Drawing(caption, partial(draw_force, missing=on_foot)))
        rows = _force_rows(diagnosis.latent_force)
        blocks += [Facts(rows)] if rows else []
        if diagnosis.way is not None:
            path = diagnosis.way
            caption = (
                "The slope from above, the fall line to the right. Arrows are the missing force in the snow's plane, "
                f"the longest {_longest_force(before):.0f} N; circles are its standard deviation, and thin "
                "arrows are less than that"
            )
            blocks.append(Drawing(caption, lambda axes: _draw_slope(axes, path, before), 3.6))
    for finding in diagnosis.findings:
        fixes = 0 if diagnosis.track_distance is None else len(diagnosis.track_distance.time_s)
        title = f"{finding.name.replace('_', ' ')} ({percent(finding.probability)})"
        blocks += [Heading(title), Facts(_finding(finding, fixes))]
    if diagnosis.next:
        blocks += [Heading("What to measure next"), Facts(_next(diagnosis.next))]
    if diagnosis.friction_averaged is not None:
        blocks += [Heading("Friction over all explanations"), Facts(_friction(diagnosis.friction_averaged))]
    if diagnosis.weighed:
        weighed = diagnosis.weighed[0]
        caption = "Probability of every explanation, before anything was added"
        blocks += [Heading(caption), Drawing(caption, lambda axes: draw_probabilities(axes, weighed), 3.2)]
        blocks += [Facts(_hypotheses(weighed) + ([] if diagnosis.chance is None else [_chance(diagnosis.chance)]))]
    if diagnosis.likeness is not None:
        blocks += [Heading("What simulated runs had hidden that look like this one"), *_likeness(diagnosis.likeness)]
    if diagnosis.smallest_noticed:
        blocks += [
            Heading("Sizes of effects that would have been noticed in half of such runs"),
            Facts(_smallest(diagnosis.smallest_noticed)),
        ]
    return (*blocks, Heading("Noise of the instruments"), Facts(_noise_rows(diagnosis.noise)))


def _force_rows(latent: LatentForce) -> list[Row]:
    """State how much more probable the measurements are with some force, whatever its course, than with none."""
    forces = (("some force is missing, against none", latent.before), ("the same, with all findings", latent.after))
    rows: list[Row] = [
        (name, f"{force.log_bayes_factor:+.1f}", "log Bayes factor; above 3 a force is missing, below −3 none is")
        for name, force in forces
        if force.log_bayes_factor is not None
    ]
    feet = latent.before.by_foot
    if feet is not None:
        meaning = "log Bayes factor; it has twice as many unknowns, and does not prove that the snow acts"
        rows.append(("some force missing on the feet, against none", f"{feet.log_bayes_factor:+.1f}", meaning))
    return rows


def _by_foot(missing: ForceOverTime, feet: ForceByFoot) -> tuple[tuple[str, ForceOverTime], ...]:
    """Return the force on each foot as one over time; deviations from noise are not marked foot by foot."""
    nowhere = ((False, False, False),) * len(missing.force_N)
    pairs = (("left", feet.left_N, feet.left_band_N), ("right", feet.right_N, feet.right_band_N))
    return tuple((side, ForceOverTime(missing.edges_s, force, band, nowhere)) for side, force, band in pairs)


def _captions(diagnosis: Diagnosis) -> str:
    return " and ".join(finding.caption or finding.name.replace("_", " ") for finding in diagnosis.findings)


def _distance_caption(diagnosis: Diagnosis) -> str:
    noise = "the band is the standard deviation of the GPS noise"
    if diagnosis.held_out:
        noise += (
            ". Each stretch between two dotted lines was left out of a fit once, and the bars are what that fit misses "
            "there on average; numbers are those of turns"
        )
    if not diagnosis.findings:
        return f"Horizontal distance between simulated antenna and GPS; {noise}"
    shaded = "; shaded while it acts" if any(finding.where for finding in diagnosis.findings) else ""
    return (
        f"Horizontal distance between simulated antenna and GPS, before, and after with {_captions(diagnosis)} in the "
        f"model{shaded}; {noise}"
    )


def _finding(finding: Finding, fixes: int) -> list[Row]:
    """Return the numbers of a finding and the evidence for it; ``fixes`` is how many were met."""
    evidence = finding.evidence
    rows: list[Row] = [
        (n.meaning or name, in_reading_units(n.value, n.unit), f"90 % interval {_ends(n)} ({name})")
        for name, n in finding.parameters.items()
    ]
    rows.append(_change("mean error (m)", evidence.trajectory_error_m, ".3f"))
    rows.append(_change("on turns not fitted (m)", evidence.held_out_error_m, ".3f"))
    placebos = evidence.placebo_held_out_error_m
    if placebos is not None:
        count = f"{len(placebos.each)} forces" if placebos.each else "forces"
        meaning = f"median of {count} drawn at random in its place; the best of them {placebos.least:.3f}"
        rows.append(("the same, placebos (m)", f"{placebos.median:.3f}", meaning))
    rows.append(_change("χ² per degree of freedom", evidence.chi2_per_dof, ".2f", "; 1 is noise"))
    if evidence.residual_memory is not None:
        noise = "; 0 is noise" + (f", up to ±{2.0 / np.sqrt(fixes):.2f} by chance" if fixes else "")
        rows.append(_change("autocorrelation of the residual", evidence.residual_memory, "+.2f", noise))
    if evidence.force_explained is not None:
        share = f"{100.0 * evidence.force_explained:.0f} %"
        rows.append(
            ("missing force explained", share, "share of the integral of its square, about the estimate with it")
        )
    if finding.where is not None:
        where = finding.where
        path = f"{where.distance_m[0]:.1f} m to {where.distance_m[1]:.1f} m of the path"
        place = "; ".join([path, *([", ".join(where.phase)] if where.phase else [])])
        rows.insert(0, ("when", f"{where.t0_s:.1f} s to {where.t1_s:.1f} s", place))
    return rows


def _ends(number: Number) -> str:
    return " to ".join(in_reading_units(value, number.unit) for value in (number.low, number.high))


def _change(what: str, change: Change, form: str, scale: str = "") -> Row:
    before, after = ("–" if value is None else format(value, form) for value in (change.before, change.after))
    return what, after, f"{before} before{scale}"


def _hypotheses(posteriors: tuple[Weighed, ...]) -> list[Row]:
    """Return every hypothesis with its probability, the most probable first."""
    nothing = next((hypothesis.log_evidence for hypothesis in posteriors if hypothesis.name == NOTHING_MISSING), None)

    def meaning(hypothesis: Weighed) -> str:
        words = [] if hypothesis.by_fits is None else [f"{hypothesis.by_fits:.1%} by the fits alone"]
        if hypothesis.name != NOTHING_MISSING:
            if hypothesis.log_evidence is None or nothing is None:
                return "not possible"
            words.insert(0, f"log evidence {hypothesis.log_evidence - nothing:+.1f} against nothing")
        return "; ".join([*words, "refitted"] if hypothesis.refitted else words)

    return [
        (
            "nothing is missing" if hypothesis.name == NOTHING_MISSING else hypothesis.name.replace("_", " "),
            "< 0.1%" if hypothesis.probability < _LEAST_SAID else f"{hypothesis.probability:.1%}",
            meaning(hypothesis),
        )
        for hypothesis in posteriors
    ]


def _chance(chance: Chance) -> Row:
    meaning = (
        f"of {chance.runs} simulated runs with nothing hidden, compared by linear responses. That nothing is missing "
        f"is {chance.nothing_probability:.1%} probable here, and below {chance.nothing_probability_5_percent:.0%} in "
        "one of twenty simulated runs"
    )
    return "share of runs that look as conspicuous by chance", _share(chance.as_strong, chance.runs), meaning


def _share(share: float, runs: int) -> str:
    """Return a share of simulated runs; where none of them was so, what it is below."""
    return f"below {share:.1%}: none of {runs}" if share * (runs + 1) < 1.5 else f"{share:.1%}"


def _likeness(likeness: Likeness) -> list[Block]:
    """Return the sentence, how many simulated runs are as unlike their kind, and the one that is most like it."""
    meaning = "of the simulated runs; below 1 % the recording looks like none of them"
    rows: list[Row] = [("runs that are farther from their kind", f"{likeness.outside:.0%}", meaning)]
    if likeness.best_possible is not None:
        meaning = (
            "probability on average, were the answer true, by a method that knows all the simulated runs; rather too "
            "low, since each run is compared with the others alone"
        )
        rows.append(("the best that can be said", f"{likeness.best_possible:.0%}", meaning))
    blocks: list[Block] = [Text(likeness.sentence), Facts(rows)]
    return blocks if likeness.similar is None else [*blocks, similar_run(likeness.similar)]


def _friction(averaged: dict[str, Number]) -> list[Row]:
    meaning = "mean over all explanations, weighted with their probabilities; 90 % interval"
    return [(name, f"{n.value:.3f}", f"{meaning} {n.low:.3f} to {n.high:.3f}") for name, n in averaged.items()]


def _next(measurements: tuple[Next, ...]) -> list[Row]:
    def meaning(measurement: Next) -> str:
        first, second = (name.replace("_", " ") for name in measurement.distinguishes)
        return f"probability that only {first} or {second} is then left"

    return [
        (measurement.measurement, f"{measurement.probability:.0%}", meaning(measurement))
        for measurement in measurements
    ]


def _smallest(noticed: dict[str, Smallest]) -> list[Row]:
    """Return the size of each hypothesis from which it would have been found as often as not."""
    return [
        (
            name.replace("_", " "),
            in_reading_units(smallest.value, smallest.unit),
            f"{smallest.meaning} ({smallest.number})" if smallest.meaning else smallest.number,
        )
        for name, smallest in noticed.items()
    ]


def _noise_rows(noise: Noise) -> list[Row]:
    rows: list[Row] = [("GPS (m)", f"{noise.gps_sigma_m:.3f}", f"correlated over {noise.gps_correlation_s:.1f} s")]
    if noise.height_sigma_m is not None:
        seconds = noise.height_correlation_s
        meaning = "" if seconds is None else f"correlated over {seconds:.1f} s"
        rows.append(("GPS height (m)", f"{noise.height_sigma_m:.3f}", meaning))
    if noise.load_sigma_N is not None:
        rows.append(("insoles, total (N)", f"{noise.load_sigma_N:.0f}", ""))
    if noise.difference_sigma_N is not None:
        rows.append(("insoles, left less right (N)", f"{noise.difference_sigma_N:.0f}", ""))
    if noise.capture_sigma_deg is not None:
        meaning = "of each segment's orientation, correlated over seconds"
        rows.append(("capture (°)", f"{noise.capture_sigma_deg:.2f}", meaning))
    return rows


def _draw_distance(axes: Axes, diagnosis: Diagnosis, distance: TrackDistance) -> None:
    for finding in diagnosis.findings:
        if finding.where is not None:
            axes.axvspan(finding.where.t0_s, finding.where.t1_s, color=plots.OTHER, alpha=0.15, linewidth=0)
    axes.axhspan(0.0, diagnosis.noise.gps_sigma_m, color=plots.MEASURED, alpha=0.2, linewidth=0, label="GPS σ")
    axes.plot(distance.time_s, distance.before_m, color=plots.MEASURED, linestyle="--", label="before")
    if diagnosis.findings:
        axes.plot(distance.time_s, distance.after_m, color=plots.SIMULATED, label="after")
    if diagnosis.held_out:
        _draw_held_out(axes, diagnosis)
    axes.set(xlabel="time (s)", ylabel="distance (m)", ylim=(0.0, None))


def _draw_held_out(axes: Axes, diagnosis: Diagnosis) -> None:
    """Draw stretches that were left out of a fit, and its mean error there."""
    stretches = diagnosis.held_out
    begin, end = [stretch.t0_s for stretch in stretches], [stretch.t1_s for stretch in stretches]
    for instant in {*begin, *end}:
        axes.axvline(instant, color=plots.INK, linewidth=0.8, linestyle=":", alpha=0.6)
    before, after = [stretch.before_m for stretch in stretches], [stretch.after_m for stretch in stretches]
    drawn = [("before, left out", before, plots.MEASURED), ("after, left out", after, plots.SIMULATED)]
    for label, errors, colour in drawn[: 2 if diagnosis.findings else 1]:
        axes.hlines(errors, begin, end, label=label, color=colour, linewidth=4.0, alpha=0.45)
    for stretch in stretches:
        if stretch.turn is not None:
            place = 0.5 * (stretch.t0_s + stretch.t1_s), 0.98
            above = axes.get_xaxis_transform()
            axes.text(*place, f"{stretch.turn}", transform=above, ha="center", va="top", fontsize="small")


def draw_probabilities(axes: Axes, weighed: tuple[Weighed, ...]) -> None:
    """Draw bars of the most probable explanations."""
    shown = [explanation for explanation in weighed[:_BARS] if explanation.probability >= _DRAWN][::-1]
    names = [
        "nothing is missing" if explanation.name == NOTHING_MISSING else explanation.name.replace("_", " ")
        for explanation in shown
    ]
    bars = axes.barh(names, [explanation.probability for explanation in shown], color=plots.SIMULATED)
    axes.bar_label(bars, [f"{explanation.probability:.0%}" for explanation in shown], padding=3.0)
    axes.set(xlabel="probability", xlim=(0.0, 1.1))


def _draw_slope(axes: Axes, path: Way, missing: ForceOverTime) -> None:
    time, f, l = (np.array(part) for part in (path.time_s, path.f_m, path.l_m))  # noqa: E741
    axes.plot(f, l, color=plots.MEASURED, linewidth=1.5, label="path")
    edges, force, band = np.array(missing.edges_s), np.array(missing.force_N), np.array(missing.band_N)
    middles = 0.5 * (edges[1:] + edges[:-1])
    course = [np.interp(middles, time, np.gradient(part, time)) for part in (f, l)]
    forward = np.stack(course) / np.hypot(*course)
    left = np.stack([-forward[1], forward[0]])
    arrow = force[:, 0] * forward + force[:, 1] * left
    place = np.stack([np.interp(middles, time, part) for part in (f, l)])
    size = np.hypot(*arrow)
    spread = np.hypot(band[:, 0], band[:, 1]) / np.sqrt(2.0)
    scale = _LONGEST * float(np.ptp(f)) / max(float(size.max()), float(spread.max()), 1.0)
    for k in range(len(middles)):
        clear = size[k] > spread[k]
        colour = plots.SIMULATED if clear else plots.OTHER
        end = place[:, k] + scale * arrow[:, k]
        head = {"arrowstyle": "->", "color": colour, "linewidth": 1.4 if clear else 0.8, "alpha": 1.0 if clear else 0.5}
        axes.annotate("", xy=(end[0], end[1]), xytext=(place[0, k], place[1, k]), arrowprops=head)
        axes.add_patch(Circle((end[0], end[1]), scale * spread[k], color=colour, alpha=0.08, linewidth=0))
    axes.set(xlabel="down the fall line (m)", ylabel="left (m)", aspect="equal")


def _longest_force(missing: ForceOverTime) -> float:
    """Return the largest force in the snow's plane, N."""
    return float(np.hypot(*np.array(missing.force_N)[:, :2].T).max(initial=0.0))


def draw_force(axes: Axes, missing: ForceOverTime) -> None:
    """Draw a missing force over time, with twice its standard deviation."""
    edges = np.array(missing.edges_s)
    middles = 0.5 * (edges[1:] + edges[:-1])
    forces, bands, stands_out = np.array(missing.force_N), np.array(missing.band_N), np.array(missing.stands_out)
    for k, (direction, colour) in enumerate(zip(DIRECTIONS, plots.OF_DIRECTIONS, strict=True)):
        force, band, out = forces[:, k], bands[:, k], stands_out[:, k]
        axes.fill_between(middles, force - 2.0 * band, force + 2.0 * band, color=colour, alpha=0.12, linewidth=0)
        axes.plot(middles, force, color=colour, linestyle=("-", "--", ":")[k], label=direction)
        axes.plot(middles[out], force[out], "o", color=colour, markersize=4.0)
    axes.axhline(0.0, color=plots.INK, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="force (N)")
