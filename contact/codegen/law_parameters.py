"""The parameters of all terms as the compiled laws take them, as a named tuple, which Numba compiles as it is."""

from __future__ import annotations

from typing import Any, NamedTuple

from sssi_exudyn.core.frames import Array


class LawParameters(NamedTuple):
    """The parameters of all terms, those of a class together.

    values : (n,) in the terms' units
    first : (c + 1,) where those of each class begin, and n
    others : the sum of 2ⁱ for the functions i that classes outside the registry have; no array, so that a loop over
        contact points need not look again
    addresses : (o,) of these functions, each for all such classes (``compiled``), 0 where there is none; at last where
        the winds' parameters among theirs begin and end
    """

    values: Array
    first: Any
    others: int
    addresses: Any
