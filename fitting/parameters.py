"""The numbers that are sought of a run, each with what is known of it beforehand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.term import parameters
from sssi_exudyn.contact.terms.air import FrontalAreas
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.number_ref import (
    CLOCK_OFFSET,
    COMPLIANCE,
    DAMPING,
    EPS,
    EXPONENTS,
    HEADING_OFFSET,
    HEIGHT,
    MU_N,
    MU_T,
    SHARPNESS,
    SLIP,
    START_F,
    START_L,
    STIFFNESS,
    VELOCITY_F,
    VELOCITY_L,
    VELOCITY_N,
    NumberRef,
)
from sssi_exudyn.core.text import did_you_mean
from sssi_exudyn.fitting.objective import Prior, Problem
from sssi_exudyn.fitting.posture_errors import LEANS, TURNS, PostureError, errors_of
from sssi_exudyn.model.faults import BootCuff, InsoleDelay, InsoleGain, InsoleOffset, LeverArm, Sensor
from sssi_exudyn.model.legs import USUAL_COMPLIANCE
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.few_sensors.complete import FootSigma
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.uncertainty import Uncertainty

FREE: Final = {MU_T: Prior(0.1, 0.1), MU_N: Prior(0.6, 0.4)}
"""Friction beforehand: published values of gliding and of skidding, widely."""
CUTTING: Final = {
    NumberRef("carving.mu"): Prior(0.1, 0.1),
    NumberRef("carving.hardness"): Prior(1e8, 4e7),
    NumberRef("carving.strength"): Prior(4e5, 1e5),
}
"""The same where edges cut: friction widely, hardness and strength about a firm piste's
(``docs/theory/carving.md``)."""
_START: Final = {
    START_F: (3.0, 1.0),
    START_L: (3.0, 1.0),
    VELOCITY_F: (2.0, 4.0),
    VELOCITY_L: (2.0, 4.0),
}
"""m and m/s, at least, and errors of the first guess: where and how fast a run starts, so widely that the fixes alone
decide.  These are measurements; counted beforehand too, as a fit to the track alone takes them, they hold the start
where a late clock or an antenna elsewhere would move it: a clock 0.139 s late came out as 0.105 ± 0.005 s.
"""
BOUNCE: Final = {HEIGHT: Prior(0.0, 0.005), VELOCITY_N: Prior(0.0, 0.1)}
"""m and m/s by which a skier is not at rest on the snow at the start.  A run begun at rest differs from one begun two
seconds before by 7 % of the load in the first 0.2 s, some by twice as much (36 starts of 12 skiers): by 2 to 4 mm, and
0.1 m/s.  In snow that damps little that lasts for seconds.
"""
USUAL_CUFF: Final = 0.06
"""Share of the load that a boot's cuff takes usually."""
ONSET: Final = {EPS: (0.1, 1.0), SLIP: (0.003, 1.0), SHARPNESS: (2.0, 0.2)}
"""Numbers of how friction builds up between rest and full slip: medians beforehand (m/s, 1 and 1) where the model
states none, and standard deviations of their logarithms.  Published friction of skis does not resolve them.
"""
_LIFT: Final = tuple(NumberRef.of(law, "c_l") for law in ("air", "posture_air"))
FIRST_COMPLIANCE: Final = 5e-6
"""m/N at which a search for that of legs begins.  From softer ones the run of a skier whose legs hold ended in another
minimum, where log evidence is lower by 8; legs of 25 kN/m are found from either.
"""
MASS: Final = "skier's mass"
DRAG: Final = "drag"
SURFACE: Final = "snow surface"
_GROUPS: Final = {
    "friction": "friction's own prior",
    "carving": "snow's own prior",
    "penetration": "snow's stiffness",
    "legs": "legs' give",
    "air": DRAG,
    "posture_air": DRAG,
    "start": "start",
    "surface": SURFACE,
    BootCuff.name: "insoles",
    InsoleGain.name: "insoles",
    InsoleOffset.name: "insoles",
    InsoleDelay.name: "insoles",
    LeverArm.name: "antenna",
}
"""Where a number's uncertainty is counted, by what owns it."""
_POSTURE: Final = {
    "yaw": "feet's yaw",
    "roll": "feet's roll",
    "pitch": "feet's pitch",
    "height": "feet's height",
    "forward": "feet's place",
}


@dataclass(frozen=True)
class Parameter:
    """A number that is fitted: its names in the model (several move together), and what is known of it beforehand.

    logarithmic : whether its logarithm is estimated, whose prior then is ``prior``; for numbers known to a factor
    """

    names: tuple[NumberRef, ...]
    prior: Prior
    logarithmic: bool = False

    @property
    def name(self) -> NumberRef:
        """The first of its names."""
        return self.names[0]

    def of(self, model: Model) -> float:
        """Return what is estimated of a model: its number, or the logarithm of that."""
        value = model.value(self.name)
        return math.log(value) if self.logarithmic else value

    def slope(self, model: Model) -> float:
        """Return the derivative of the model's number by what is estimated."""
        return model.value(self.name) if self.logarithmic else 1.0

    @property
    def is_positive(self) -> bool:
        """Return whether the number must stay above zero, where its logarithm or the legs' stiffness has no end."""
        return self.logarithmic or self.name == COMPLIANCE

    @property
    def group(self) -> str:
        """Return where its uncertainty is counted."""
        special = {HEADING_OFFSET: "heading", CLOCK_OFFSET: "clock"} | dict.fromkeys(ONSET, "friction's onset")
        special |= dict.fromkeys(_LIFT, "lift of the air")
        return special.get(self.name) or _GROUPS.get(self.name.owner, "what was found")


def group_of(error: PostureError) -> str:
    """Return where the uncertainty of an error of the posture is counted."""
    return _POSTURE.get(error.kind, "trunk's lean")


def with_unknown_parts(model: Model, recording: Recording, *, compliance: float = 0.0) -> Model:
    """Return the model with the parts whose numbers are estimated too: those of the instruments, friction's onset, and
    the legs.

    An onset of zero, of which no logarithm can be estimated, becomes its median beforehand, and legs that hold get the
    ``compliance`` (m/N); 0 leaves them.
    """
    parts: list[Sensor] = [LeverArm()]
    if recording.insoles is not None:
        parts += [BootCuff(USUAL_CUFF), InsoleGain(), InsoleOffset(), InsoleDelay()]
    known = {sensor.name for sensor in model.sensors}
    model = replace(model, sensors=(*model.sensors, *(part for part in parts if part.name not in known)))
    if is_carved(model.terms):
        return model
    if recording.uncertainty.leg_compliance > 0.0 and not model.legs.give:
        model = model.with_values({COMPLIANCE: compliance})
    if recording.uncertainty.friction_onset == 0.0:
        return model
    return model.with_values({name: median for name, (median, _) in ONSET.items() if model.value(name) == 0.0})


def _air_law(model: Model) -> str:
    """Return the name of the law of the air: the posture's, or the paper's."""
    return "posture_air" if "posture_air" in [term.name for term in model.terms] else "air"


def drag_coefficient(model: Model) -> NumberRef:
    """Return the name of the drag coefficient."""
    return NumberRef.of(_air_law(model), "c_d")


def known_to_a_share(stated: Model, about: Uncertainty) -> dict[NumberRef, Prior]:
    """Return the numbers that are known to a share of what is stated, with their priors: the snow's stiffness, where no
    edge cuts, and drag.
    """
    snow = {} if is_carved(stated.terms) else {STIFFNESS: about.snow_stiffness}
    shares = {**snow, drag_coefficient(stated): about.drag}
    return {name: Prior(stated.value(name), share * stated.value(name)) for name, share in shares.items()}


def lift_number(model: Model, about: Uncertainty) -> dict[NumberRef, float]:
    """Return the lift coefficient, with its standard deviation beforehand."""
    frontal = sum(FrontalAreas().of_height(model.skier.height).values())
    return {NumberRef.of(_air_law(model), "c_l"): about.lift_area / frontal}


def started_anywhere(priors: Mapping[NumberRef, Prior]) -> dict[NumberRef, Prior]:
    """Return the priors, those of the start so wide that the fixes alone decide."""
    wide = dict(priors)
    for name in _START.keys() & priors.keys():
        least, times = _START[name]
        wide[name] = replace(priors[name], sigma=max(times * priors[name].sigma, least))
    return wide


def snow_beforehand(model: Model) -> Mapping[NumberRef, Prior]:
    """Friction, and where edges cut what the snow bears, as known before anything is measured."""
    return CUTTING if is_carved(model.terms) else FREE


def unknown_numbers(stated: Model, priors: Mapping[NumberRef, Prior], recording: Recording) -> tuple[Parameter, ...]:
    """Return the numbers that are unknown of laws, start and instruments, with priors about those of the model as it
    was ``stated``; ``priors`` are those of the fit to the track.
    """
    about = recording.uncertainty
    beforehand = {**snow_beforehand(stated), **started_anywhere(priors)}
    beforehand |= known_to_a_share(stated, about)
    beforehand[CLOCK_OFFSET] = Prior(stated.value(CLOCK_OFFSET), about.clock)
    known = lift_number(stated, about) | antenna_numbers(about)
    beforehand |= {name: Prior(stated.value(name), sigma) for name, sigma in known.items()}
    if recording.insoles is not None:
        if not is_carved(stated.terms):
            beforehand |= BOUNCE
        beforehand |= {name: Prior(stated.value(name), sigma) for name, sigma in insole_numbers(about).items()}
    numbers = tuple(Parameter((name,), prior) for name, prior in beforehand.items() if prior.sigma > 0.0)
    return (*numbers, *law_unknowns(stated, about))


def antenna_numbers(about: Uncertainty) -> dict[NumberRef, float]:
    """Return the numbers of the antenna's place, each with its standard deviation (m) beforehand."""
    return {NumberRef.of(LeverArm.name, axis): about.antenna for axis in ("forward", "left", "up")}


def insole_numbers(about: Uncertainty) -> dict[NumberRef, float]:
    """Return the numbers of insoles in working order, each with its standard deviation beforehand."""
    sides = ("left", "right")
    return {
        NumberRef.of(BootCuff.name, "share"): about.boot_cuff,
        **{NumberRef.of(InsoleGain.name, side): about.insole_gain for side in sides},
        **{NumberRef.of(InsoleOffset.name, side): about.insole_zero for side in sides},
        NumberRef.of(InsoleDelay.name, "late"): about.insole_clock,
    }


def law_unknowns(stated: Model, about: Uncertainty) -> tuple[Parameter, ...]:
    """Return the numbers of friction's onset and of the snow's resistance to penetration that the paper leaves open.

    Those of legs that give are among them, each with its prior about what the model states.  None where edges cut.
    """
    if is_carved(stated.terms):
        return ()
    factors = {
        name: (stated.value(name) or median, about.friction_onset * sigma) for name, (median, sigma) in ONSET.items()
    }
    if stated.value(DAMPING) > 0.0:
        factors[DAMPING] = (stated.value(DAMPING), about.snow_damping)
    unknowns = [
        Parameter((name,), Prior(math.log(median), sigma), logarithmic=True)
        for name, (median, sigma) in factors.items()
    ]
    for name in EXPONENTS:
        exponent = stated.value(name)
        unknowns.append(Parameter((name,), Prior(exponent, about.snow_exponents * exponent)))
    if stated.legs.give:
        beforehand = Prior(stated.value(COMPLIANCE), about.leg_compliance * USUAL_COMPLIANCE)
        unknowns.append(Parameter((COMPLIANCE,), beforehand))
    return tuple(unknown for unknown in unknowns if unknown.prior.sigma > 0.0)


def posture_errors(
    about: Uncertainty, start: float, stop: float, assumed: FootSigma | None = None
) -> tuple[PostureError, ...]:
    """Return all ways in which the posture may be wrong from ``start`` to ``stop`` (s); ``assumed`` says how wrong feet
    may be whose posture was not captured.
    """
    sizes = dict.fromkeys(TURNS, (about.foot, about.foot_wander))
    sizes["forward"] = (about.foot_place, about.foot_place_wander)
    sizes["height"] = (about.foot_height, about.foot_height_wander)
    if assumed is not None:
        sizes |= {kind: (getattr(assumed, kind),) * 2 for kind in (*TURNS, "height")}
    sizes |= dict.fromkeys(LEANS, (about.trunk, about.trunk_wander))
    return errors_of(sizes, start, stop)


def seek_too(problem: Problem, names: Sequence[str]) -> Problem:
    """Return the problem with further numbers of the model's terms estimated, by their names (``my_snow.c``).

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
    """Return the names of all numbers of a model's terms; those of a second term of a kind are ``name#2.number``."""
    names, seen = [], dict[str, int]()
    for term in model.terms:
        seen[term.name] = seen.get(term.name, 0) + 1
        owner = term.name if seen[term.name] == 1 else f"{term.name}#{seen[term.name]}"
        names += [NumberRef.of(owner, number) for number in parameters(term)]
    return tuple(names)
