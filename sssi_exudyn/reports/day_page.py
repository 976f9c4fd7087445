"""What several runs of a day say together: in a sentence, and as a page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from urllib.parse import quote

from sssi_exudyn.model.model import Model
from sssi_exudyn.reports.html import document, grid
from sssi_exudyn.reports.section import Markup, Section, Text
from sssi_exudyn.results.day import Day
from sssi_exudyn.validation.diagnosis.day import DayExplanation
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.result import NOTHING_MISSING, Alternative, Number
from sssi_exudyn.validation.diagnosis.same_place import SamePlace, gains_of
from sssi_exudyn.validation.diagnosis.search_result import SURE, WORTH_NAMING
from sssi_exudyn.validation.diagnosis.statistics.probabilities import STANDS_OUT
from sssi_exudyn.validation.diagnosis.words.sentence import list_alternatives


def sentence_of_day(explanations: Sequence[DayExplanation], runs: int, model: Model) -> str:
    """What acts on all runs alike, in one sentence: nothing, unless that is improbable as in a single diagnosis.

    model : of one of the runs
    """
    nothing = next(each for each in explanations if each.name == NOTHING_MISSING)
    best = nothing if nothing.probability > STANDS_OUT else explanations[0]
    numbers = {name.partition(".")[2]: number for name, number in best.numbers.items()}
    found = best.name != NOTHING_MISSING
    what = BY_NAME[best.name].sentence(numbers, model) if found else "nothing is missing that acts on all alike"
    others = [
        Alternative(each.name, each.probability)
        for each in explanations
        if each is not best and each.probability >= WORTH_NAMING
    ]
    unsure = found and best.probability < SURE and others
    beside = f"; {list_alternatives(best.name, others)}" if unsure else ""
    friction = f"μ_t is {_around(numbers['mu_t'])} and μ_n {_around(numbers['mu_n'])}"
    return f"In {runs} runs together {what} ({best.probability:.0%} probable{beside}); {friction}."


def day_page(day: Day) -> str:
    """The page: the sentence, every explanation with its numbers, and the way to each run's own page."""
    rows = [["", "probability", "log evidence", "numbers, 90 % intervals"]]
    none = next(each.log_evidence for each in day.explanations if each.name == NOTHING_MISSING)
    for each in day.explanations:
        values = "; ".join(f"{name} {_between(number)}" for name, number in each.numbers.items())
        title = each.name.replace("_", " ") + ("" if each.fitted else " (by its linear response)")
        rows.append([title, f"{each.probability:.1%}", f"{each.log_evidence - none:+.1f}", values])
    runs = "".join(f'<li><a href="{quote(name)}/report.html">{escape(name)}</a></li>\n' for name in day.recordings)
    sections = [
        Section("What may act on all runs alike", (Markup(grid(rows)),)),
        *([Section("The same place in other runs", _same_place(day.same_place))] if day.same_place else []),
        Section("Each run by itself", (Markup(f"<ul>\n{runs}</ul>\n"),)),
    ]
    return document(f"{len(day.recordings)} runs of a day", f"<p>{escape(day.sentence)}</p>\n", sections)


def _same_place(places: Sequence[SamePlace]) -> tuple[Markup | Text, ...]:
    """What other runs say of findings: a table of probabilities before and after, and of the passes."""
    rows = [["found in", "what it may be", "by that run alone", "with the others", "passed by", "log evidence there"]]
    for place in places:
        passed = ", ".join(f"{each.run} ({each.metres:.0f} m)" for each in place.passes)
        gains = gains_of(place.passes)
        for i, (name, probability) in enumerate(place.after.items()):
            gain = f"{gains[name]:+.1f}" if name in gains else ""
            first = (place.run, passed) if i == 0 else ("", "")
            rows.append([
                first[0], name.replace("_", " "), f"{place.before[name]:.1%}", f"{probability:.1%}", first[1], gain,
            ])  # fmt: skip
    return Markup(grid(rows)), *(Text(place.sentence) for place in places)


def _around(number: Number) -> str:
    return f"{number.value:.3f} ± {number.high - number.value:.3f}"


def _between(number: Number) -> str:
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{number.value:.3g} ({number.low:.3g} to {number.high:.3g}){unit}"
