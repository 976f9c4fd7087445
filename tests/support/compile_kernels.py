"""Compile what most tests simulate with, into Numba's cache: ``python compile_kernels.py full|reduced``."""

from __future__ import annotations

import sys

from gliding import model, standing

from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.terms.friction_corrections import SnowPatch
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.reduced import prepare, simulate_reduced

SETS = (PAPER_TERMS, (*PAPER_TERMS, SnowPatch()))
"""The paper's terms, and one more, which takes the kernel of all terms."""


def compile_full() -> None:
    """The full model."""
    for terms in SETS:
        simulate(model(terms), standing(0.1), stop=0.02)


def compile_reduced() -> None:
    """The reduced model."""
    for terms in SETS:
        skier = model(terms)
        simulate_reduced(skier, prepare(skier, standing(0.1)))


if __name__ == "__main__":
    {"full": compile_full, "reduced": compile_reduced}[sys.argv[1]]()
