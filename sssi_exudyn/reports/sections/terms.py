"""The force terms of the model: each law with its formula and its numbers."""

from __future__ import annotations

from collections.abc import Sequence

from sssi_exudyn.contact.term import Term, formula, parameters
from sssi_exudyn.contact.terms.friction_corrections import Braking
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.reports.section import Block, Grid, Heading, Runs, Section, Text, say_of_each, section_of_each
from sssi_exudyn.reports.sections.tables import number, unit_text, with_spread
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Estimate

_HEAD = ["", "value", "unit", "least", "greatest", "", "source"]


def terms(runs: Runs) -> Section:
    """Show every term with each number: value, unit, bounds, whether it was fitted, and its source."""
    return section_of_each("Force terms in the model", runs, _blocks, say_of_each(runs, _counts))


def _counts(run: StoredRun) -> str:
    """State how many terms act, and how many of their numbers were fitted."""
    numbers = sum(len(parameters(term)) for term in run.model.terms)
    owners = {term.name for term in run.model.terms}
    fitted = sum(name.partition(".")[0].partition("#")[0] in owners for name in run.summary.fit.parameters or {})
    return f"{len(run.model.terms)} force terms act, and {fitted} of their {numbers} numbers were fitted"


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    fitted = run.summary.fit.parameters or {}
    blocks: list[Block] = []
    seen: dict[str, int] = {}
    in_time = [term for term in run.model.terms if isinstance(term, Braking)]
    if in_time:
        blocks += [Heading(f"{len(in_time)} of {Braking.name}"), Text(formula(Braking)), _courses(in_time)]
    for term in run.model.terms:
        if isinstance(term, Braking):
            continue
        seen[term.name] = seen.get(term.name, 0) + 1
        owner = term.name if seen[term.name] == 1 else f"{term.name}#{seen[term.name]}"
        blocks.append(Heading(owner.replace("_", " ")))
        if formula(type(term)):
            blocks.append(Text(formula(type(term))))
        own = {name: fitted[f"{owner}.{name}"] for name in parameters(term) if f"{owner}.{name}" in fitted}
        blocks.append(Grid([_HEAD, *_rows(term, own)]))
    return tuple(blocks)


def _courses(terms: Sequence[Term]) -> Grid:
    """Return a row for each of many terms of one class: together they are a course in time."""
    names = list(parameters(terms[0]))
    about = quantities(terms[0])
    head = [f"{name} ({about[name].unit})" for name in names]
    return Grid([head, *([number(parameters(term)[name], 3) for name in names] for term in terms)])


def _rows(term: Term, fitted: dict[str, Estimate]) -> list[list[str]]:
    """Return a row a number; ``fitted`` holds those of the term that were fitted."""
    rows = []
    for name, value in parameters(term).items():
        about = quantities(term)[name]
        estimate = fitted.get(name)
        se = None if estimate is None else estimate.se
        rows.append(
            [
                name,
                number(value, 4) if se is None else with_spread(value, se),
                unit_text(about.unit),
                number(about.low),
                number(about.high),
                "fixed" if estimate is None else "fitted",
                about.source,
            ]
        )
    return rows
