"""Other numbers of a model fitted along with friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sssi_exudyn.contact.term import parameters
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.core.text import did_you_mean
from sssi_exudyn.fitting.objective import Prior, Problem
from sssi_exudyn.model.model import Model


def seek_too(problem: Problem, names: Sequence[str]) -> Problem:
    """The problem with further numbers of the model's terms sought, by their names (``my_snow.c``).

    Beforehand each is known to half the range of its bounds, as one standard deviation; the paper's bare objective
    knows nothing of any.  Raises InputError for a number that no term of the model has, or that is sought already.
    """
    known = numbers_of_terms(problem.model)
    priors = dict(problem.priors)
    for name in map(NumberRef, names):
        if name not in known:
            raise InputError(
                "--parameter", name, "no force term of the model has this number", did_you_mean(name, known)
            )
        if name in problem.names:
            raise InputError("--parameter", name, "this number is fitted anyway", "leave it out")
        if priors:
            low, high = problem.model.bounds(name)
            priors[name] = Prior(problem.model.value(name), 0.5 * (high - low))
    return replace(problem, names=(*problem.names, *dict.fromkeys(map(NumberRef, names))), priors=priors)


def numbers_of_terms(model: Model) -> tuple[NumberRef, ...]:
    """Names of all numbers of a model's terms; those of a second term of a kind are ``name#2.number``."""
    found, seen = [], dict[str, int]()
    for term in model.terms:
        seen[term.name] = seen.get(term.name, 0) + 1
        owner = term.name if seen[term.name] == 1 else f"{term.name}#{seen[term.name]}"
        found += [NumberRef.of(owner, number) for number in parameters(term)]
    return tuple(found)
