"""What simulated runs of a recording had hidden that look like it."""

from __future__ import annotations

from dataclasses import dataclass

from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class SimilarWorld:
    """The world that looks most like the recording.

    name : of its answer
    recorded, simulated : (c, 3) N along, across and normal, the force that does what the model lacks, of both
    """

    name: str
    recorded: Array
    simulated: Array


@dataclass(frozen=True)
class Judgement:
    """What runs that look like a recording had hidden.

    runs : simulated
    probabilities : of each answer by its name, the most probable first
    outside : share of simulated runs that are farther from the middle of their kind than the recording
    best_possible : of each answer by its name, its probability on average by the best possible method, were it true
    similar : the simulated run that looks most like the recording
    about : name of the finding that they vary, or of nothing
    edges : (c + 1,) s of the cells of time of ``similar``
    """

    runs: int
    probabilities: dict[str, float]
    outside: float
    best_possible: dict[str, float]
    similar: SimilarWorld
    about: str
    edges: Array
