"""Compile the kernels of most tests into Numba's cache: ``python compile_kernels.py WHAT``."""

from __future__ import annotations

import sys

import numpy as np
from gliding import model, standing

from sssi_exudyn.bodies.muscles.muscles import skier_muscles
from sssi_exudyn.bodies.muscles.paths import muscle_paths
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, average_geometry
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.simulation.turns.steady_turn import TurnCase, edges_of, start_rolling, steady_turn


def compile_carved() -> None:
    """Compile the reduced model with its tangents where edges cut, and a ski in a turn: one module holds all three."""
    carving = model((Carving(),))
    sensitivities(carving, prepare(carving, standing(0.1)), ["carving.mu"], lambda _, run: run.pelvis)
    steady_turn(TurnCase(0.5), start_rolling(edges_of(carving.ski)))


def compile_others() -> None:
    """Compile the reduced model with its tangents where edges do not cut, both full models and the muscles' paths."""
    skier, carving = model(), model((Carving(),))
    prepared = prepare(skier, standing(0.1))
    simulate_reduced(skier, prepared)
    sensitivities(skier, prepared, ["friction.mu_t"], lambda _, run: run.pelvis)
    simulate(skier, standing(0.1), stop=0.02)
    simulate(carving, standing(0.1, pelvis_list=0.05), stop=0.02)
    muscle_paths(skier_muscles(average_geometry(1.75)).model, np.zeros((1, len(PRESCRIBED))))


WHAT = {"carved": compile_carved, "others": compile_others}
"""Parts of about equal duration, for parallel processes."""


if __name__ == "__main__":
    WHAT[sys.argv[1]]()
