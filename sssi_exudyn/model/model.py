"""A model as pure data: skier, skis, slope, force terms and the start of the run.

``model.toml`` holds a whole model, so that it can be run again without the recording's other files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, SupportsFloat, TypeVar

import numpy as np

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.registry import PAPER_TERMS, is_carved
from sssi_exudyn.contact.term import Term, terrain_height
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.core.choices import HeadingMode
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef, number_ref, split_owner
from sssi_exudyn.core.quantity import Quantity, check_bounds, quantities, quantity
from sssi_exudyn.core.text import did_you_mean, one_line
from sssi_exudyn.model.faults import CaptureSensor, Sensor
from sssi_exudyn.model.heading import REPLAY, Heading
from sssi_exudyn.model.legs import RIGID, Legs
from sssi_exudyn.motion.correction import PostureCorrection
from sssi_exudyn.recording.recording import Equipment, Skier
from sssi_exudyn.terrain.surface import Surface

_CHOICE = "chosen; see docs/notebook/verification.md for what it does to the result"
_MODE = Quantity(
    name="mode",
    default=0.0,
    unit="1",
    low=-6.0,
    high=6.0,
    source="posterior of the heights",
    meaning="standard deviations of a shape by which the snow surface may differ from its estimate",
)
Name = TypeVar("Name", bound=str)
"""The name of a number: a ``NumberRef``, or in a script its text."""


_AT_REST: Final = "0: at rest on the snow apart from his speed"


@dataclass(frozen=True)
class Start:
    """Place, velocity and heading offset at the run's start, fitted because no instrument gives them exactly."""

    f: float = quantity(0.0, "m", low=-1e5, high=1e5, source="GPS", meaning="the antenna's place down the slope")
    l: float = quantity(0.0, "m", low=-1e5, high=1e5, source="GPS", meaning="the antenna's place to the left")  # noqa: E741
    velocity_f: float = quantity(
        0.0, "m/s", low=-50.0, high=50.0, source="GPS", meaning="the antenna's speed down the slope"
    )
    velocity_l: float = quantity(
        0.0, "m/s", low=-50.0, high=50.0, source="GPS", meaning="the antenna's speed to the left"
    )
    height: float = quantity(
        0.0,
        "m",
        low=-0.2,
        high=0.2,
        source=_AT_REST,
        meaning="how much higher the skier stands than at rest on the snow",
    )
    velocity_n: float = quantity(
        0.0, "m/s", low=-2.0, high=2.0, source=_AT_REST, meaning="how fast he rises beyond what his posture does"
    )
    heading_offset: float = quantity(
        0.0, "rad", low=-0.35, high=0.35, source="prior of 1 degree", meaning="turn of the whole capture about gravity"
    )
    clock_offset: float = quantity(
        0.0, "s", low=-3.0, high=3.0, source="known in most recordings", meaning="lag of the GPS clock"
    )


@dataclass(frozen=True)
class Solver:
    """Settings of the integration of the equations of motion (Exudyn's implicit generalised-α method)."""

    step: float = quantity(1.0 / 150.0, "s", low=1e-4, high=0.02, source=_CHOICE, meaning="longest time step")
    elements: int = quantity(50, "1", low=10, high=200, source="paper 2.2.2", meaning="beam elements of a ski")
    spectral_radius: float = quantity(
        0.8, "1", low=0.0, high=0.95, source=_CHOICE, meaning="numerical damping: 1 none, 0 most"
    )
    relative_tolerance: float = quantity(
        1e-4, "1", low=1e-10, high=1e-2, source=_CHOICE, meaning="tolerance of Newton's method, of the first residual"
    )
    absolute_tolerance: float = quantity(
        1e-4, "1", low=1e-9, high=1e-1, source=_CHOICE, meaning="tolerance of Newton's method, of the residual"
    )


PRESETS: Final[Mapping[str, Solver]] = {"paper": Solver(), "fast": Solver(step=0.006, elements=14)}
"""Settings by name.  ``fast`` takes half the time of ``paper``.  Against 50 elements in steps of 1 ms its track is
within 2 mm and its soles' forces within 1 N rms (``docs/notebook/performance.md``), which steps of 8 ms are not:
fewer beams save more than longer steps for the error that they make."""


@dataclass(frozen=True, repr=False)
class Model:
    """A model holds everything that is simulated except the movement.

    inclination, fall_line_azimuth : rad
    terms : the laws that act, in the order in which their forces are reported
    sensors : faults of the recording's instruments
    surface : the snow's heights over the slope's plane; None for the plane
    posture : correction of the captured posture; None for none
    heading : treatment of the skier's heading on snow that edges cut
    legs : give of the legs on other snow

    Examples
    --------
    >>> model = sssi_exudyn.model_of("examples/beginner").with_values({"friction.mu_t": 0.12})
    >>> model.value("friction.mu_t")
    0.12
    """

    name: str
    skier: Skier
    equipment: Equipment
    ski: Ski
    inclination: float
    fall_line_azimuth: float
    terms: tuple[Term, ...] = PAPER_TERMS
    start: Start = field(default_factory=Start)
    solver: Solver = field(default_factory=Solver)
    sensors: tuple[Sensor, ...] = ()
    surface: Surface | None = None
    posture: PostureCorrection | None = None
    heading: Heading = REPLAY
    legs: Legs = RIGID

    def __repr__(self) -> str:
        parts = ", ".join([*(term.name for term in self.terms), *(sensor.name for sensor in self.sensors)])
        return f"<Model {one_line(self.name)}: {parts}; {np.degrees(self.inclination):.1f}° steep>"

    def term(self, name: str) -> Term:
        """Return the term of that name.  Raises InputError when the model has none."""
        for term in self.terms:
            if term.name == name:
                return term
        raise InputError("model", name, "the model has no such term", did_you_mean(name, [t.name for t in self.terms]))

    @property
    def friction(self) -> AnisotropicFriction:
        """Return the friction of the snow."""
        friction = self.term(AnisotropicFriction.name)
        assert isinstance(friction, AnisotropicFriction)
        return friction

    def value(self, name: str) -> float:
        """Return a declared number by its name, ``friction.mu_t`` or ``start.velocity_f``.

        A second term of one name is ``name#2``.  The snow surface's amounts of modes are ``surface.mode_1`` and so on.
        Raises InputError for an unknown name.
        """
        number = number_ref(name)
        part = self._checked_owner(number)
        if isinstance(part, Surface):
            return float(np.real(part.amounts[mode_index(number.key)]))
        return float(np.real(getattr(part, number.key)))

    def about(self, name: str) -> Quantity:
        """Return the declaration of the number of that name: unit, least and greatest value, meaning.

        Raises InputError for an unknown name.
        """
        number = number_ref(name)
        part = self._checked_owner(number)
        return replace(_MODE, name=number.key) if isinstance(part, Surface) else quantities(part)[number.key]

    def bounds(self, name: str) -> tuple[float, float]:
        """Return the least and greatest value that the number of that name may have."""
        about = self.about(name)
        return about.low, about.high

    def capture_yaw(self, time: Array) -> Array:
        """Return the angle (n,) rad by which the capture is turned to the left at ``time`` (n,) s.

        It is the heading offset and the contribution of the capture's faults, a straight line in time.
        """
        faults = [sensor.yaw(time) for sensor in self.sensors if isinstance(sensor, CaptureSensor)]
        return np.asarray(sum(faults, np.full(np.shape(time), self.start.heading_offset)))

    def snow(self, places: Array) -> tuple[Array, Array]:
        """Return heights (n,) m of the snow over the slope's plane and its slopes (n, 2) at places (n, ≥ 2) m."""
        ground = np.array(
            [terrain_height(FloatMath(), self.terms, *place) for place in places[:, :2].tolist()], dtype=np.float64
        )
        if self.surface is not None:
            ground = ground + self.surface.at(places)[:, :3]
        return ground[:, 0], ground[:, 1:]

    def with_values(self, values: Mapping[Name, complex]) -> Model:
        """Return the model with other values of declared numbers, by their names; a complex one carries a derivative.

        Fits try values beyond the bounds, so these are checked where the model is used (``check_numbers``).

        Raises InputError for an unknown name, with the nearest one, and for a value that is no number.
        """
        if not isinstance(values, Mapping):
            fix = 'give names with their values, such as {"friction.mu_t": 0.1}'
            raise InputError("model", "values", f"a {type(values).__name__} is no mapping", fix)
        changed = self
        for name, value in values.items():
            number = number_ref(name)
            old = changed._checked_owner(number)
            if isinstance(value, bool) or not isinstance(value, complex | SupportsFloat):
                raise InputError("model", str(name), f"{one_line(value)!r} is no number", "give a number")
            if isinstance(old, Surface):
                changed = replace(changed, surface=old.with_amount(mode_index(number.key), value))
                continue
            new = replace(old, **{number.key: value if isinstance(value, complex) else float(value)})  # type: ignore[arg-type]
            if isinstance(new, Start):
                changed = replace(changed, start=new)
            elif isinstance(new, Legs):
                changed = replace(changed, legs=new)
            elif isinstance(new, Term):
                changed = replace(changed, terms=tuple(new if term is old else term for term in changed.terms))
            else:
                kept = tuple(new if sensor is old else sensor for sensor in changed.sensors)
                changed = replace(changed, sensors=kept)
        return changed

    def check_numbers(self) -> None:
        """Raise InputError for the first number of terms, sensors, start and legs that is outside its declared bounds.

        A ``model.toml`` with such a number would be refused too.
        """
        parts: list[tuple[str, Term | Sensor | Start | Legs]] = [(term.name, term) for term in self.terms]
        parts += [(sensor.name, sensor) for sensor in self.sensors]
        for name, part in [*parts, ("start", self.start), ("legs", self.legs)]:
            for key, about in quantities(part).items():
                check_bounds(about, float(np.real(getattr(part, key))), "model", f"{name}.{key}")

    def with_terms(self, terms: Sequence[Term]) -> Model:
        """Return the model with those force terms in place of its own.

        Where they make edges cut the snow, the legs hold: the joints at the boots give there.
        """
        return replace(self, terms=tuple(terms), legs=RIGID if is_carved(terms) else self.legs)

    def with_heading(self, mode: HeadingMode | None) -> Model:
        """Return the model with that heading, or with its own if it is None."""
        return self if mode is None else replace(self, heading=replace(self.heading, mode=mode))

    def without(self, owners: Iterable[str]) -> Model:
        """Return the model without the terms and sensors of those names; a further one of a kind is ``name#2``.

        Raises InputError for an unknown one.
        """
        gone = [self.owner(name) for name in owners]
        return replace(
            self,
            terms=tuple(term for term in self.terms if not any(term is part for part in gone)),
            sensors=tuple(sensor for sensor in self.sensors if not any(sensor is part for part in gone)),
        )

    def owner(self, name: str) -> Term | Start | Legs | Sensor | Surface:
        """Return the term, sensor, start, legs or surface of that name.  Raises InputError for an unknown one."""
        if name == "start":
            return self.start
        if name == "legs":
            return self.legs
        if name == "surface" and self.surface is not None:
            return self.surface
        kind, index = split_owner(name)
        parts: tuple[Term | Sensor, ...] = (*self.terms, *self.sensors)
        matches = [part for part in parts if part.name == kind]
        if not 1 <= index <= len(matches):
            surface = ("surface",) if self.surface is not None else ()
            known = [*(part.name for part in parts), "start", "legs", *surface]
            raise InputError("model", name, "the model has no such term", did_you_mean(name, known))
        return matches[index - 1]

    def _checked_owner(self, number: NumberRef) -> Term | Start | Legs | Sensor | Surface:
        """Return what has a number.  Raises InputError where the model has no such part, or that no such number."""
        part = self.owner(number.owner)
        if isinstance(part, Surface):
            if not 0 <= mode_index(number.key) < len(part.amounts):
                raise _no_mode(number.key)
        elif number.key not in quantities(part):
            fix = did_you_mean(str(number), [f"{number.owner}.{key}" for key in quantities(part)])
            raise InputError("model", str(number), f"{number.owner} has no such number", fix)
        return part


def mode_index(key: str) -> int:
    """Return the index of the mode that ``mode_1``, ``mode_2`` … names.  Raises InputError for another name."""
    kind, _, count = key.partition("_")
    if kind != "mode" or not count.isdecimal() or int(count) < 1:
        raise _no_mode(key)
    return int(count) - 1


def _no_mode(key: str) -> InputError:
    return InputError(
        "model", f"surface.{key}", "the surface has no such number", "use surface.mode_1, surface.mode_2 …"
    )


def along_snow(model: Model, feet: Array, velocity: Array, foot_velocity: Array, share: Array) -> float:
    """Return the pelvis' speed along the normal (m/s) at the start: that with which its feet keep their depth, and what
    the model's start adds.

    Parameters
    ----------
    feet : (2, 3) m, their places
    velocity : (3,) m/s of the pelvis; only its part along the slope counts
    foot_velocity : (2, 3) m/s of the feet, relative to the pelvis
    share : (2,) weight of each foot, its share of the load
    """
    slopes = model.snow(feet)[1]
    rising = np.sum(slopes * (velocity[:2] + foot_velocity[:, :2]), axis=1)
    return float(share @ (rising - foot_velocity[:, 2])) + model.start.velocity_n


def add_part(model: Model, part: Term | Sensor) -> Model:
    """Return the model with one more term or fault."""
    if isinstance(part, Term):
        return replace(model, terms=(*model.terms, part))
    return replace(model, sensors=(*model.sensors, part))


def name_in_model(model: Model, part: Term | Sensor) -> str:
    """Return the name by which ``Model.value`` finds the part once it is added."""
    parts: Sequence[Term | Sensor] = (*model.terms, *model.sensors)
    count = sum(other.name == part.name for other in parts) + 1
    return part.name if count == 1 else f"{part.name}#{count}"
