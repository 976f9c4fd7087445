"""A law of friction that is in no list, as a day of runs might have it."""

from __future__ import annotations

from sssi_exudyn.validation.diagnosis.diagnosis_data import Number
from sssi_exudyn.validation.diagnosis.several_runs.friction_regression import BASIS, FoundLaw, Variable, formula_of


def number(value: float, unit: str = "1") -> Number:
    return Number(value, value - 0.002, value + 0.002, unit)


NUMBERS = {
    "friction.mu_t": number(0.21),
    "friction.mu_n": number(0.9),
    "friction_law.c_speed2": number(0.025),
    "friction_law.c_speed_edge": number(-0.0104),
}
VARIABLES = {
    "speed": Variable(10.62, 0.871, "m/s"),
    "edge": Variable(0.6, 0.25, "rad"),
    "load": Variable(537.0, 196.0, "N"),
    "slip": Variable(0.033, 0.039, "1"),
    "place": Variable(87.3, 21.6, "m"),
}


def law_as_found(offered: bool) -> FoundLaw:
    inclusion = {name: 0.99 if name in ("speed2", "speed_edge") else 0.02 for name in BASIS}
    formula = formula_of(NUMBERS, VARIABLES)
    products = ("speed2", "speed_edge")
    return FoundLaw(
        offered, formula, products, 0.98, 52.0, 48.0, "drag_area", 30.0, NUMBERS, VARIABLES, inclusion, fitted=offered
    )
