"""The common result of several runs of a day: in a sentence, and as a page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from urllib.parse import quote

from matplotlib.axes import Axes

from sssi_exudyn.core.number_ref import MU_N, number_ref
from sssi_exudyn.model.model import Model
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.html import document, grid, tiles_html
from sssi_exudyn.reports.section import Block, Drawing, Grid, Markup, Section, Text, Tile
from sssi_exudyn.results.day import Day
from sssi_exudyn.results.folder import LAW, MODEL
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Alternative, Number
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.several_runs.friction_regression import FoundLaw
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import DayExplanation
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import SamePlace, gains_of
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.wording.sentence import list_alternatives


def sentence_of_day(
    explanations: Sequence[DayExplanation], runs: int, model: Model, law: FoundLaw | None = None
) -> str:
    """State in one sentence what acts on all runs alike.

    It is nothing, unless that is improbable as in a single diagnosis; or a law that is in no list, where it is offered.

    model : model of one of the runs
    """
    if law is not None and law.offered:
        return (
            f"In {runs} runs together friction along the ski follows a law that is in no list ({law.probability:.0%} "
            f"probable): {law.formula}. The nearest law of the list is {law.best_named}. "
            f"μ_n, the largest lateral load ratio, is {_around(law.numbers[MU_N])}."
        )
    best = _best(explanations)
    numbers = {number_ref(name).key: number for name, number in best.numbers.items()}
    named = best.name != NOTHING_MISSING
    what = BY_NAME[best.name].sentence(numbers, model) if named else "nothing is missing that acts on all alike"
    unlisted = 0.0 if law is None else law.probability
    probability = best.probability * (1.0 - unlisted)
    others = [
        Alternative(explanation.name, explanation.probability * (1.0 - unlisted))
        for explanation in explanations
        if explanation is not best and explanation.probability >= THRESHOLDS.worth_naming
    ]
    if unlisted >= THRESHOLDS.worth_naming:
        others.append(Alternative("a law in no list", unlisted))
    unsure = named and probability < THRESHOLDS.sure and others
    alternatives = f"; {list_alternatives(best.name, others)}" if unsure else ""
    friction = f"μ_t is {_around(numbers['mu_t'])} and μ_n, the largest lateral load ratio, {_around(numbers['mu_n'])}"
    return f"In {runs} runs together {what} ({probability:.0%} probable{alternatives}). {friction}."


def _best(explanations: Sequence[DayExplanation]) -> DayExplanation:
    """Return the most probable explanation; it is nothing, unless that is improbable."""
    nothing = next(explanation for explanation in explanations if explanation.name == NOTHING_MISSING)
    return nothing if nothing.probability > THRESHOLDS.stands_out else explanations[0]


def tiles_of_day(day: Day) -> tuple[Tile, ...]:
    """Return what acts on all runs, how sure that is, and friction with its interval."""
    best = _best(day.explanations)
    numbers = {number_ref(name).key: number for name, number in best.numbers.items()}
    others = [other for other in day.explanations if other is not best and other.probability >= THRESHOLDS.worth_naming]
    named = ", ".join(f"{other.name.replace('_', ' ')} {other.probability:.0%}" for other in others)
    what = "nothing is missing" if best.name == NOTHING_MISSING else best.name.replace("_", " ")
    friction = [
        Tile(name, f"{numbers[key].value:.3f}", f"90\u00a0% interval {numbers[key].low:.3f} to {numbers[key].high:.3f}")
        for name, key in (("μ_t, along the ski", "mu_t"), ("μ_n, largest lateral load ratio", "mu_n"))
        if key in numbers
    ]
    sure = Tile("how sure", f"{best.probability:.0%}", f"else {named}" if named else "no other explanation remains")
    return (Tile("what acts on all runs", what, f"{len(day.recordings)} runs compared"), sure, *friction)


def day_page(day: Day) -> str:
    """Return the page: tiles, the sentence, every explanation with its numbers, and links to each run's own page."""
    rows = [["", "probability", "log evidence", "numbers, 90 % intervals"]]
    none = next(explanation.log_evidence for explanation in day.explanations if explanation.name == NOTHING_MISSING)
    for explanation in day.explanations:
        values = "; ".join(f"{name} {_between(number)}" for name, number in explanation.numbers.items())
        title = explanation.name.replace("_", " ") + ("" if explanation.fitted else " (by its linear response)")
        rows.append([title, f"{explanation.probability:.1%}", f"{explanation.log_evidence - none:+.1f}", values])
    runs = "".join(f'<li><a href="{quote(name)}/report.html">{escape(name)}</a></li>\n' for name in day.recordings)
    sections = [
        Section("What may act on all runs alike", (Markup(grid(rows)),)),
        *([] if day.found_law is None else [_law_section(day.found_law)]),
        *([Section("The same place in other runs", _same_place(day.same_place))] if day.same_place else []),
        Section("Each run by itself", (Markup(f"<ul>\n{runs}</ul>\n"),)),
    ]
    lead = f"{tiles_html(tiles_of_day(day))}<p>{escape(day.sentence)}</p>\n"
    return document(f"{len(day.recordings)} runs of a day", lead, sections)


def _same_place(places: Sequence[SamePlace]) -> tuple[Markup | Text, ...]:
    """Compare findings with other runs: a table of probabilities before and after, and of the passes."""
    rows = [["found in", "what it may be", "by that run alone", "with the others", "passed by", "log evidence there"]]
    for place in places:
        passed = ", ".join(f"{passing.run} ({passing.metres:.0f} m)" for passing in place.passes)
        gains = gains_of(place.passes)
        for i, (name, probability) in enumerate(place.after.items()):
            gain = f"{gains[name]:+.1f}" if name in gains else ""
            first = (place.run, passed) if i == 0 else ("", "")
            rows.append([
                first[0], name.replace("_", " "), f"{place.before[name]:.1%}", f"{probability:.1%}", first[1], gain,
            ])  # fmt: skip
    return Markup(grid(rows)), *(Text(place.sentence) for place in places)


def _law_section(law: FoundLaw) -> Section:
    """Describe the law that is in no list: its formula, its numbers, and its evidence."""
    verdict = (
        "It is clearly more probable than nothing and than every law of the list."
        if law.offered
        else "It is not clearly more probable than nothing or a law of the list, so it is not offered."
    )
    blocks: list[Block] = [
        Text(
            "Every sum of at most three products of speed, edge angle, load, slip and place was compared with the runs."
            f" The most probable is {law.formula}. Compared with nothing and all laws of the list, its probability is "
            f"{law.probability:.1%}; its log evidence is {law.log_evidence_over_nothing:+.1f} against nothing and "
            f"{law.log_evidence_over_best_named:+.1f} against {law.best_named.replace('_', ' ')}. {verdict}"
        ),
        Text(
            "Each x is within ±3; speeds and loads are those of each ski, places count from the first run's first fix."
            + ("" if law.fitted else " The numbers are those of linear responses.")
        ),
        Grid([["", "90 % interval"], *([name, _between(number)] for name, number in law.numbers.items())]),
        Drawing("How probable each product is to be in the law", lambda axes: _draw_inclusion(axes, law), 3.6),
    ]
    if law.offered:
        use = f"sssi simulate FOLDER --model RUN/{LAW}/{MODEL} --out OTHER simulates a run with it."
        blocks.append(Text(f"The folder {LAW} of each run holds the run's model with this law: {use}"))
    return Section("A law of friction that is in no list", tuple(blocks))


def _draw_inclusion(axes: Axes, law: FoundLaw) -> None:
    """Draw bars of the products, the most probable on top."""
    ordered = sorted(law.inclusion_probability.items(), key=lambda item: item[1])
    names, shares = [name.replace("_", " × ").replace("2", "²") for name, _ in ordered], [p for _, p in ordered]
    bars = axes.barh(names, shares, color=plots.SIMULATED)
    axes.bar_label(bars, [f"{share:.0%}" for share in shares], padding=3.0)
    axes.set(xlabel="probability", xlim=(0.0, 1.1))


def _around(number: Number) -> str:
    return f"{number.value:.3f} ± {number.high - number.value:.3f}"


def _between(number: Number) -> str:
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{number.value:.3g} ({number.low:.3g} to {number.high:.3g}){unit}"
