"""A law of friction that is in no list, found from several runs of a day.

Friction along the ski may change with a sum of products of speed, edge angle, load, slip and place
(``FrictionLaw``).  Every sum of at most three of them is compared by the evidence of all runs.  Its coefficients, the
friction that all share, and all that is uncertain of each run are integrated out: posture, instruments, snow surface,
start.  So an error of the posture, which moves edge angle and load, is in the comparison.  Few products are probable
beforehand (a spike at zero, or a slab).  The best sum is fitted to all runs with the real term, as the laws of the list
are, and competes with them.

Sources: T. J. Mitchell, J. J. Beauchamp, J. Am. Stat. Assoc. 83 (1988) 1023 (spike and slab); MacKay 2003, ch. 28.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.contact.maths import ArrayMath
from sssi_exudyn.contact.term import FootState
from sssi_exudyn.contact.terms.friction_law import POWERS, VARIABLES, FrictionLaw
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.evidence import Freedom, log_factors, uncertain, whiten_columns
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.instruments.gps import enu_from
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Number
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities
from sssi_exudyn.validation.diagnosis.search.search_result import SeparateFit
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import (
    SHARED,
    DayExplanation,
    DayRun,
    Joint,
    Law,
    by_size,
    day_run,
    fit_own_numbers,
    fit_to_all,
    numbers_of,
    on_one_snow,
    responses,
)
from sssi_exudyn.validation.diagnosis.state import fitted_run, last_estimate, linear_model
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds

BASIS: Final = tuple(POWERS)
"""Names of the products."""
_OWN: Final = f"{FrictionLaw.name}.c_"
"""What the names of coefficients begin with."""
INCLUDED: Final = 1.0 / len(BASIS)
"""Prior probability of each product: one of them, on average."""


@dataclass(frozen=True)
class Variable:
    """What a law depends on, over all runs: it is counted from ``mean`` in units of ``standard_deviation``."""

    mean: float
    standard_deviation: float
    unit: str


@dataclass(frozen=True)
class FoundLaw:
    """The most probable sum of products, and what there is for it.

    offered : whether it is clearly more probable than nothing and every law of the list
    products : names of the products in it
    probability : among all laws of the list and nothing
    log_evidence : as an explanation's of the day;  over_nothing, over_best_named : by how much it is above theirs
    numbers : of friction, and the coefficients
    inclusion_probability : of every product, over all sums
    fitted : whether it was fitted to all runs with the real term; otherwise it is as linear responses have it
    """

    offered: bool
    formula: str
    products: tuple[str, ...]
    probability: float
    log_evidence: float
    log_evidence_over_nothing: float
    best_named: str
    log_evidence_over_best_named: float
    numbers: dict[str, Number]
    variables: dict[str, Variable]
    inclusion_probability: dict[str, float]
    fitted: bool


@dataclass(frozen=True)
class Selection:
    """All sums of at most three of k products.

    subsets : indices of the products of each, the empty one first
    log_evidence : (s,) above the empty one's;  probability : (s,)
    """

    subsets: tuple[tuple[int, ...], ...]
    log_evidence: Array
    probability: Array

    @property
    def best(self) -> int:
        """The place of the most probable sum that is not empty."""
        return 1 + int(np.argmax(self.probability[1:]))

    @property
    def chosen(self) -> list[int]:
        """The products of that."""
        return list(self.subsets[self.best])

    def inclusion(self, product: int) -> float:
        """Return the probability that a product is in the sum."""
        return float(sum(p for s, p in zip(self.subsets, self.probability, strict=True) if product in s))


def what_runs_know(
    runs: Sequence[DayRun], columns: Sequence[Array], size: float = THRESHOLDS.product_size
) -> tuple[Array, Array]:
    """Return what all runs know of k products, each of its usual ``size``: information (k, k) and pull (k,).

    columns : (N, k) of each run

    What is uncertain of each run alone, and then the friction that all share, has taken its part.
    """
    first = 1 + len(SHARED)
    total = np.zeros((first + columns[0].shape[1],) * 2)
    for run, own in zip(runs, columns, strict=True):
        free, shared = run.linear.free, list(run.shared)
        alone = Freedom(np.delete(free.columns, shared, axis=1), np.delete(free.scales, shared))
        known = uncertain(replace(run.linear, free=alone), run.levels)
        common = np.hstack([free.columns[:, shared] * free.scales[shared], size * own])
        table = np.column_stack([known.residual, whiten_columns(run.linear, run.levels, common)])
        total += table.T @ known.remove_from(table)
    friction = total[:, 1:first]
    total -= friction @ np.linalg.solve(friction[1:first] + np.eye(first - 1), friction.T)
    return total[first:, first:], total[first:, 0]


def select(gram: Array, pull: Array, thresholds: Thresholds = THRESHOLDS) -> Selection:
    """Compare all sums, from ``what_runs_know``."""
    sizes = thresholds.sizes
    subsets: list[tuple[int, ...]] = [()]
    gains = [0.0]
    for count in range(1, thresholds.most_products + 1):
        some = list(itertools.combinations(range(len(BASIS)), count))
        at = np.array(some)
        by_size = log_factors(gram[at[:, :, None], at[:, None, :]], pull[at][..., None], sizes)[..., 0]
        subsets += some
        gains += list(np.logaddexp.reduce(by_size) - np.log(len(sizes)))
    logs = np.array([log_prior_of(len(s)) for s in subsets]) + thresholds.temper * np.array(gains)
    odds = np.exp(logs - logs.max())
    return Selection(tuple(subsets), np.array(gains), np.asarray(odds / odds.sum()))


def log_prior_of(count: int) -> float:
    """Return the log prior probability of a sum of so many products, among all sums."""
    return float(count * np.log(INCLUDED) + (len(BASIS) - count) * np.log1p(-INCLUDED))


def probability_of_sum(
    explanations: Sequence[DayExplanation], log_evidence: float, count: int, thresholds: Thresholds = THRESHOLDS
) -> float:
    """Return the probability of a sum of so many products, next to all explanations of the day."""
    nothing = next(explanation for explanation in explanations if explanation.name == NOTHING_MISSING)
    laws = [explanation for explanation in explanations if explanation is not nothing]
    evidence = np.array([*(explanation.log_evidence for explanation in laws), log_evidence])
    weights = np.array([*(BY_NAME[explanation.name].weight for explanation in laws), np.exp(log_prior_of(count))])
    return float(probabilities(nothing.log_evidence, evidence, weights, thresholds)[-1])


def find_law(
    runs_alone: Sequence[SeparateFit],
    explanations: Sequence[DayExplanation],
    progress: Advance = silent,
) -> tuple[FoundLaw, tuple[SeparateFit, ...]]:
    """Return the most probable sum of products next to the day's ``explanations`` and, if offered, every run fitted
    with it.

    It is fitted with the real term where none is less than half probable among the sums.
    """
    progress(None, "a law of friction that is in no list")
    runs_alone = on_one_snow(runs_alone)
    thresholds = runs_alone[0].problem.thresholds
    feet = [_feet(own) for own in runs_alone]
    away = [downhill(own, runs_alone[0]) for own in runs_alone]
    variables = _variables(feet, away)

    def law_of(subset: Sequence[int]) -> Law:
        return _law([BASIS[i] for i in subset], variables, away, thresholds)

    nothing = next(explanation for explanation in explanations if explanation.name == NOTHING_MISSING)
    selection, joint = _about_own_fits(law_of, runs_alone)
    joint = replace(joint, evidence=nothing.log_evidence + float(selection.log_evidence[selection.best]))
    if selection.probability[0] < 0.5:
        progress(None, "all runs fitted with it")
        try:
            selection, values = _about_itself(law_of, runs_alone, selection, joint.values)
            joint = fit_to_all(law_of(selection.chosen), runs_alone, values)
        except SimulationDiverged as error:
            progress(None, f"it is compared by its linear response: {error}")
    law = law_of(selection.chosen)
    probability = probability_of_sum(explanations, joint.evidence, len(law.keys), thresholds)
    fits = tuple(_with_numbers(law, own, joint, fit) for own, fit in zip(runs_alone, joint.fits, strict=False))
    possible = bool(fits) and all(_brakes(alone.fit.model, seen) for alone, seen in zip(fits, feet, strict=True))
    offered = possible and probability > thresholds.law_offered
    named = max(
        (explanation for explanation in explanations if explanation is not nothing),
        key=lambda explanation: explanation.log_evidence,
    )
    numbers = numbers_of(law, runs_alone[0], joint)
    law_found = FoundLaw(
        offered=offered,
        formula=formula_of(numbers, variables),
        products=tuple(BASIS[i] for i in selection.chosen),
        probability=probability,
        log_evidence=joint.evidence,
        log_evidence_over_nothing=joint.evidence - nothing.log_evidence,
        best_named=named.name,
        log_evidence_over_best_named=joint.evidence - named.log_evidence,
        numbers=numbers,
        variables=variables,
        inclusion_probability={name: selection.inclusion(i) for i, name in enumerate(BASIS)},
        fitted=bool(fits),
    )
    return law_found, fits if offered else ()


def _about_own_fits(
    law_of: Callable[[Sequence[int]], Law], runs_alone: Sequence[SeparateFit]
) -> tuple[Selection, Joint]:
    """Compare all sums by the responses about the runs' own fits; return them, and the numbers of the best one."""
    columns = [some[0] for some in responses(runs_alone, [law_of(range(len(BASIS)))])]
    runs = [day_run(own, linear_model(own.problem, own.state, own.fit), own.state.levels) for own in runs_alone]
    thresholds = runs_alone[0].problem.thresholds
    selection = select(*what_runs_know(runs, columns, thresholds.product_size), thresholds)
    chosen = [of_run[:, selection.chosen] for of_run in columns]
    return selection, by_size(law_of(selection.chosen), runs, chosen, thresholds)


def _about_itself(
    law_of: Callable[[Sequence[int]], Law], runs_alone: Sequence[SeparateFit], selection: Selection, values: Array
) -> tuple[Selection, Array]:
    """Compare all sums by the responses about the best one until it stays the best; return the selection and the best
    sum's numbers.

    About the runs' own fits, errors of start, posture and snow stand for part of what is missing.
    """
    every, thresholds = law_of(range(len(BASIS))), runs_alone[0].problem.thresholds
    for _ in range(thresholds.regression_rounds):
        before, shared = selection.chosen, len(SHARED)
        all_values = np.zeros(shared + len(BASIS))
        all_values[[*range(shared), *(shared + i for i in before)]] = values
        runs_with_law = fit_own_numbers(every, all_values, runs_alone)
        runs, columns = [run for run, _, _ in runs_with_law], [some for _, some, _ in runs_with_law]
        selection = select(*what_runs_know(runs, columns, thresholds.product_size), thresholds)
        law = law_of(selection.chosen)
        values = by_size(law, runs, [of_run[:, selection.chosen] for of_run in columns], thresholds).values
        if selection.chosen == before:
            break
    return selection, values


def formula_of(numbers: dict[str, Number], variables: dict[str, Variable]) -> str:
    """Return the law in characters: friction along the ski, then every variable that is in it."""
    line, used = f"μ_t = {numbers[SHARED[0]].value:.3f}", []
    for name, number in numbers.items():
        if name.startswith(_OWN):
            powers = POWERS[name.removeprefix(_OWN)]
            used += [variable for variable in powers if variable not in used]
            product = "·".join(f"x_{variable}{'²' if power == 2 else ''}" for variable, power in powers.items())
            line += f" {'−' if number.value < 0.0 else '+'} {abs(number.value):.3f}·{product}"
    return "; ".join([line, *(f"x_{name} = {_counted(name, variables[name])}" for name in used)])


def _counted(name: str, variable: Variable) -> str:
    """Return how a variable is counted, with angles in degrees."""
    words = {"edge": "edge angle", "load": "load on a ski", "slip": "slip |v_n|/|v|", "place": "place downhill"}
    angle = variable.unit == "rad"
    factor, unit = (np.degrees(1.0), "°") if angle else (1.0, "" if variable.unit == "1" else f" {variable.unit}")
    mean, width = (f"{factor * value:.3g}{unit}" for value in (variable.mean, variable.standard_deviation))
    return f"({words.get(name, name)} − {mean})/({width})"


def _feet(own: SeparateFit) -> FootState:
    """Return both skis at all instants of a run, (n, 2) each, on the slope's plane."""
    return fitted_run(own.problem, own.state, own.fit).run.feet()


def downhill(own: SeparateFit, first: SeparateFit) -> float:
    """Return by how much (m) a run's first fix, from which its places count, lies below the first run's."""
    here, there = own.problem.gps, first.problem.gps
    model = first.fit.model
    apart = enu_from(np.zeros((1, 3)), here.origin, there.origin)[0]
    return float(apart @ slope_to_enu(model.inclination, model.fall_line_azimuth)[:, 0])


def _variables(feet: Sequence[FootState], away: Sequence[float]) -> dict[str, Variable]:
    """Return means and standard deviations over all runs, each instant weighed by its load.  Places count from the
    first run's first fix.
    """
    seen = [FrictionLaw().variables(ArrayMath(), replace(run, f=run.f + d)) for run, d in zip(feet, away, strict=True)]
    loads, about = np.concatenate([run.load.ravel() for run in feet]), quantities(FrictionLaw)
    variables = {}
    for name in VARIABLES:
        values = np.concatenate([run[name].ravel() for run in seen])
        mean = float(np.average(values, weights=loads))
        width = float(np.sqrt(np.average((values - mean) ** 2, weights=loads)))
        scale = about[f"{name}_scale"]
        variables[name] = Variable(mean, float(np.clip(width, scale.low, scale.high)), scale.unit)
    return variables


def _law(products: Sequence[str], variables: dict[str, Variable], away: Sequence[float], thresholds: Thresholds) -> Law:
    """Return a sum of products, in each run with places that count from its own first fix."""
    counted = {f"{name}_ref": variable.mean for name, variable in variables.items()}
    counted |= {f"{name}_scale": variable.standard_deviation for name, variable in variables.items()}
    parts = tuple(FrictionLaw(**{**counted, "place_ref": counted["place_ref"] - distance}) for distance in away)
    return Law(
        FrictionLaw.name,
        tuple(f"c_{name}" for name in products),
        np.full(len(products), thresholds.product_size),
        parts,
    )


def _with_numbers(law: Law, own: SeparateFit, joint: Joint, fit: Refit) -> SeparateFit:
    """Return a run fitted with the law, with the numbers that all runs share."""
    known = {p.names[0]: p.prior.mean for p in own.fit.parameters}
    names = (*SHARED, *law.amplitudes)
    values = {name: known.get(name, 0.0) + float(shift) for name, shift in zip(names, joint.values, strict=True)}
    bounded = {name: float(np.clip(value, *fit.model.bounds(name))) for name, value in values.items()}
    return replace(own, fit=replace(fit, model=fit.model.with_values(bounded)))


def model_with_law(run: SeparateFit) -> Model:
    """Return the model of a run that was fitted with a law, once all that is uncertain of that run is estimated again.

    The reduced model estimates it; where it cannot, the model is the fit's.
    """
    try:
        posterior = last_estimate(run.problem, run.state, run.fit, full=False)
    except SimulationDiverged:
        return run.fit.model
    if posterior is None:
        return run.fit.model
    shared = [name for p in run.fit.parameters for name in p.names if name in SHARED or name.startswith(_OWN)]
    return posterior.model_where({name: run.fit.model.value(name) for name in shared})


def _brakes(model: Model, feet: FootState) -> bool:
    """Return whether the snow brakes wherever the skis were."""
    law = model.owner(FrictionLaw.name)
    assert isinstance(law, FrictionLaw)
    return bool(np.min(model.friction.mu_t + law.change(ArrayMath(), feet)) > 0.0)
