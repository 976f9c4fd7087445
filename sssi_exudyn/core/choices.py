"""Words that a user chooses from: each set is written once, as a type; signatures, files and the command line read it.

The module imports nothing of the package, so that the command line knows every choice before anything heavy is loaded.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

Backend = Literal["fastest", "compiled", "numpy", "symbolic", "python"]
"""How the force terms are evaluated: machine code, arrays, Exudyn's expressions, or the interpreter as reference."""
BACKENDS: Final[tuple[Backend, ...]] = get_args(Backend)
Method = Literal["joint", "paper"]
"""How friction is fitted: together with the recording's nuisance parameters, or the paper's two parameters alone."""
METHODS: Final[tuple[Method, ...]] = get_args(Method)
Snow = Literal["paper", "carving"]
"""What lies under the skis: friction at the foot as in the paper, or snow that edges cut."""
SnowKind = Literal["fresh", "wet", "groomed", "icy"]
"""What snow a run was skied on, as ``[snow] kind`` of a recording states it."""
SNOW_KINDS: Final[tuple[SnowKind, ...]] = get_args(SnowKind)
HeadingMode = Literal["replay", "track", "free"]
"""What holds the skier's heading on snow that edges cut: the capture, a spring to the capture, or the snow alone."""
HEADING_MODES: Final[tuple[HeadingMode, ...]] = get_args(HeadingMode)
Concealed = Literal["all", "nothing", "listed", "unlisted", "pairs", "whole_runs"]
"""What the cases of a benchmark conceal: everything in its turn, nothing in any of them, single effects that the
diagnosis has a name for, or has none for, two effects at a time, or single effects and nothing in whole runs."""
MuscleSet = Literal["full", "paper"]
"""Which muscles: all of the legs, 322 with those of the trunk, or the paper's 284."""
Power = Literal[2, 3]
"""Exponent of the activations in the sum that static optimisation minimises."""
POWERS: Final[tuple[Power, ...]] = get_args(Power)
Cluster = Literal["local", "slurm"]
"""The Dask cluster that a sweep starts."""
Keep = Literal["movement", "path", "rhythm", "speed", "line"]
"""What a skier keeps of his recorded run on other snow or another ski."""
KEEPS: Final[tuple[Keep, ...]] = get_args(Keep)
Sex = Literal["male", "female"]
"""Which anthropometric table describes the skier."""
SEXES: Final[tuple[Sex, ...]] = get_args(Sex)
