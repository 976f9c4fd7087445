"""A reference to one number of a model: which part has it, and its name there.

Text becomes a reference once, where it enters: in a script, on the command line, in a file.  A reference is written as
its text, so that files and tables keep the names that people type.
"""

from __future__ import annotations

from typing import Final


class NumberRef(str):
    """A number of a model, as ``friction.mu_t``, ``gust#2.w_f`` or ``surface.mode_1``.

    owner : what has it, as ``Model.owner`` knows it: ``gust#2``
    part : the kind of that: ``gust``, or ``start`` or ``surface``
    ordinal : which of that kind, from 1 on
    key : the number's name there: ``w_f``

    Examples
    --------
    >>> ref = NumberRef("gust#2.w_f")
    >>> ref.owner, ref.part, ref.ordinal, ref.key
    ('gust#2', 'gust', 2, 'w_f')
    """

    owner: str
    part: str
    ordinal: int
    key: str

    def __new__(cls, text: str) -> NumberRef:
        ref = super().__new__(cls, text)
        ref.owner, _, ref.key = text.partition(".")
        ref.part, ref.ordinal = split_owner(ref.owner)
        return ref

    @classmethod
    def of(cls, owner: str, key: str) -> NumberRef:
        """Return the reference to the number ``key`` of an owner."""
        return cls(f"{owner}.{key}")


def split_owner(owner: str) -> tuple[str, int]:
    """Return the kind of an owner, and which of that kind: ``gust#2`` is the second gust; 0 where that is no count."""
    part, _, count = owner.partition("#")
    if not count:
        return part, 1
    return part, int(count) if count.isdecimal() else 0


def number_ref(name: str) -> NumberRef:
    """Return the reference that a name is, or makes."""
    return name if isinstance(name, NumberRef) else NumberRef(str(name))


MU_T: Final = NumberRef("friction.mu_t")
MU_N: Final = NumberRef("friction.mu_n")
FRICTION: Final = (MU_T, MU_N)
"""Friction along and across the skis."""
EPS: Final = NumberRef("friction.eps")
SLIP: Final = NumberRef("friction.slip")
SHARPNESS: Final = NumberRef("friction.sharpness")
"""Slip speed and tangent of the slip angle over which friction builds up, and how sharply it then becomes constant."""
START_F: Final = NumberRef("start.f")
START_L: Final = NumberRef("start.l")
VELOCITY_F: Final = NumberRef("start.velocity_f")
VELOCITY_L: Final = NumberRef("start.velocity_l")
HEIGHT: Final = NumberRef("start.height")
VELOCITY_N: Final = NumberRef("start.velocity_n")
HEADING_OFFSET: Final = NumberRef("start.heading_offset")
CLOCK_OFFSET: Final = NumberRef("start.clock_offset")
STIFFNESS: Final = NumberRef("penetration.k")
DAMPING: Final = NumberRef("penetration.c")
EXPONENTS: Final = (NumberRef("penetration.m1"), NumberRef("penetration.m3"))
"""The snow's resistance to penetration."""
COMPLIANCE: Final = NumberRef("legs.compliance")
"""Of each leg, beyond what the capture shows."""
