"""A run of the reduced model with its exact derivatives by any numbers: one pass, whatever their count.

The compiled loop carries the tangents of pelvis and skis along (``tangents_kernel``).  What NumPy
computes before and after it, the tables of the posture and what instruments report, is differentiated by a complex
step (``tangent_inputs``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from math import ceil
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.contact.codegen.compiled import (
    in_order,
    law_parameters,
    parameter_index,
    parameter_values,
)
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.term import Term, WindTerm
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.core.number_ref import (
    HEADING_OFFSET,
    HEIGHT,
    START_F,
    START_L,
    VELOCITY_F,
    VELOCITY_L,
    VELOCITY_N,
    NumberRef,
    number_ref,
)
from sssi_exudyn.model.faults import CaptureSensor
from sssi_exudyn.model.legs import Legs
from sssi_exudyn.model.model import Model, mode_index
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.runtime.threads import cores_used, side_by_side
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.heading import spread_inertia
from sssi_exudyn.simulation.reduced.carved_derivatives import CarvedLinearisation
from sssi_exudyn.simulation.reduced.carved_run import CarvedMoment
from sssi_exudyn.simulation.reduced.derivative_inputs import (
    STEP,
    Direction,
    climb_at_start,
    listed_parameters,
    of_foot,
    place_at_start,
    put_back,
    rank,
    run_slopes,
    slope_of,
    table_slopes,
    tangent_inputs,
)
from sssi_exudyn.simulation.reduced.prepared import (
    Prepared,
    ReducedRun,
    empty_series,
    load_at_start,
    prepare,
    reduced_run,
)
from sssi_exudyn.simulation.reduced.run import Rest, StartOfRun, reduced_module, start_of_run
from sssi_exudyn.simulation.reduced.ski_tangents import FURTHER, LOAD, MODAL, MODES, PLACE, SPIN, TURN
from sssi_exudyn.simulation.ski_on_snow.structs import (
    ModalContact,
    TangentInputs,
    TangentSeries,
)
from sssi_exudyn.terrain.surface import PATCH, Surface

_TABLES: Final = 300_000
"""Numbers that change the posture's tables in one pass, times instants: each takes 1 kB of memory an instant, and
larger arrays cost more to be had than they save."""
_LEAST: Final = 24
"""Of them in a pass that is worth its run."""
_START: Final = {START_F: 0, START_L: 1, HEIGHT: 2, VELOCITY_F: 3, VELOCITY_L: 4, VELOCITY_N: 5}


@dataclass(frozen=True)
class TableChange:
    """The tables of a capture that is other by a size.

    apply : a formula that NumPy continues to complex sizes, over tables of the instants from ``first`` to ``stop``
    first, stop : instants outside which nothing changes; None for the last
    """

    apply: Callable[[Prepared, complex], Prepared]
    first: int = 0
    stop: int | None = None

    def direction(self, model: Model, prepared: Prepared) -> Direction:
        """Return what changes with the size, about a model's run."""
        part = prepared.part(slice(self.first, self.stop))
        return Direction(tables=self.apply(part, 1j * STEP).correct_capture(model), first=self.first)


Addition = tuple[Model, str]
"""A model with one part more, a term or a fault, that does nothing yet; and the name of the number that is its
strength."""


def complex_model(model: Model, name: str) -> Model:
    """Return the model with the complex step of one number."""
    return model.with_values({name: model.value(name) + 1j * STEP})


def run_tangents(
    model: Model,
    prepared: Prepared,
    names: Sequence[str],
    changes: Sequence[TableChange] = (),
    begin: CarvedMoment | None = None,
) -> tuple[ReducedRun, ReducedRun]:
    """Return a run, and its derivatives by the model's numbers of those names, then by the size of those changes, at
    size 0.  Each field has one axis more, last.

    Numbers that only instruments know (a late clock, faults of GPS and insoles) change nothing of the run.

    begin : of a run that goes on, on snow that edges cut; numbers and changes do nothing before it

    Raises SimulationDiverged as ``simulate_reduced`` does, InputError for an unknown name.
    """
    numbers = [number_ref(name) for name in names]
    makers = [lambda number=number: _of_number(model, prepared, number) for number in numbers]
    makers += [partial(change.direction, model, prepared) for change in changes]
    tabular = [i for i, number in enumerate(numbers) if _turns_capture(model, number)]
    tabular += range(len(numbers), len(makers))
    plain = [i for i in range(len(makers)) if i not in tabular]
    carved = is_carved(model.terms)
    most = max(1, _TABLES // len(prepared.time))
    count = cores_used(None) * ceil(len(tabular) / (most * cores_used(None)))  # as many on each core
    count = min(count, ceil(len(tabular) / _LEAST))
    groups = [group for group in (tabular[i::count] for i in range(count)) if group] or [[]]
    groups[-1] = sorted(groups[-1] + plain)
    if carved:
        derivatives = CarvedLinearisation(model, prepared, begin).derivatives
    else:
        reduced_module()  # once, before threads ask for it
        derivatives = partial(_pass, model, prepared.correct_capture(model))
    passes = side_by_side(lambda group: derivatives([makers[i]() for i in group]), groups)
    if len(groups) == 1:
        return passes[0][0], ReducedRun(**passes[0][1])
    slopes: dict[str, Array] = {}
    for group, (_, derivatives_in_group) in zip(groups, passes, strict=True):
        for name, array in derivatives_in_group.items():
            if name not in slopes:
                slopes[name] = np.moveaxis(np.empty((len(makers), *array.shape[:-1])), 0, -1)
            slopes[name][..., group] = array
    return passes[0][0], ReducedRun(**slopes)


def host_of(addition: Addition) -> Model:
    """Return the model whose run is linearised for an addition: one run serves as many as possible.

    Forces of terms add up, and so do heights, so that a term has the same derivative in the place of another of its
    class.  Only the air's velocity must be whole, since drag is no linear function of it.
    """
    model, name = addition
    part = model.owner(number_ref(name).owner)
    others = tuple(term for term in model.terms if term is not part)
    if isinstance(part, WindTerm) or not any(type(term) is type(part) for term in others):
        return model
    return replace(model, terms=others)


def with_classes_of(model: Model, terms: Sequence[Term]) -> Model:
    """Return the model with a term of every class of ``terms`` that it has none of: those, which must do nothing."""
    present = {type(term) for term in model.terms}
    lacking = {type(term): term for term in terms if type(term) not in present}
    return replace(model, terms=(*model.terms, *lacking.values()))


def run_additions(host: Model, prepared: Prepared, additions: Sequence[Addition]) -> tuple[ReducedRun, ReducedRun]:
    """Return a run, and its derivatives by the strengths of those additions, as ``run_tangents`` does.  One pass is
    enough, although each addition has numbers of its own that say where and when it acts.

    host : ``host_of`` any of them, ``with_classes_of`` those of all; that of an added term has the same laws
    """
    directions = [_of_addition(host, prepared, addition) for addition in additions]
    run, slopes = _pass(host, prepared.correct_capture(host), directions)
    return run, ReducedRun(**slopes)


def _of_addition(host: Model, prepared: Prepared, addition: Addition) -> Direction:
    model, number = addition[0], number_ref(addition[1])
    part = model.owner(number.owner)
    if not isinstance(part, Term):
        return _of_number(model, prepared, number)
    terms, extended = in_order(host.terms), in_order(with_classes_of(model, host.terms).terms)
    if len(extended) > len(terms):
        other = next(term for term in terms if type(term) is type(part))
        extended = tuple(part if term is other else term for term in terms)
    return Direction(parameter=parameter_index(extended, part, number.key), values=parameter_values(extended))


def skier_mass_change(model: Model, motion: Motion, prepared: Prepared) -> TableChange:
    """Return the change of the tables by a skier who is heavier by a size (kg), without other proportions.

    Masses and what they weigh are linear in the skier's mass, so that two skiers give it exactly.
    """
    heavier = replace(model, skier=replace(model.skier, mass=model.skier.mass + 1.0))
    start, stop = float(prepared.time[0]), float(prepared.time[-1])
    other = prepare(heavier, motion, start=start, stop=stop, step=prepared.step)
    light, heavy = (
        np.array([parts.inertias[SEGMENT[name]].mass for name in parts.areas])[:, None]
        for parts in (Parts(model, motion), Parts(heavier, motion))
    )

    def change(tables: Prepared, size: complex) -> Prepared:
        body = prepared.body_mass + size * (other.body_mass - prepared.body_mass)
        segments = light + size * (heavy - light)

        def mean(name: str) -> Array:
            first, second = (tables.body_mass * getattr(tables, name) for tables in (prepared, other))
            return np.asarray((first + size * (second - first)) / body)

        first, second = light * prepared.exposed_velocity, heavy * other.exposed_velocity
        place, velocity = mean("com_place"), mean("com_velocity")
        (turning, swinging), (more, faster) = prepared.body_about_pelvis(), other.body_about_pelvis()
        masses: dict[str, Any] = {
            "mass": prepared.mass + size * (other.mass - prepared.mass),
            "body_mass": body,
            "com_inertia": turning + size * (more - turning) - spread_inertia(np.array([body]), place[:, None]),
            "com_momentum": swinging + size * (faster - swinging) - body * cross(place, velocity),
        }
        return replace(
            tables,
            **masses,
            com_place=place,
            com_velocity=velocity,
            com_acceleration=mean("com_acceleration"),
            exposed_velocity=(first + size * (second - first)) / segments,
        )

    return TableChange(change)


def along(run: ReducedRun, slopes: ReducedRun, index: int) -> ReducedRun:
    """Return the run with the complex step of one of the numbers that it was differentiated by."""
    parts = {entry.name: getattr(run, entry.name) for entry in fields(ReducedRun)}
    for name in parts.keys() - {"time"}:
        stepped = np.empty(parts[name].shape, dtype=np.complex128)
        stepped.real = parts[name]
        np.multiply(getattr(slopes, name)[..., index], STEP, out=stepped.imag)
        parts[name] = stepped
    return ReducedRun(**parts)


def _turns_capture(model: Model, name: NumberRef) -> bool:
    return name == HEADING_OFFSET or isinstance(model.owner(name.owner), CaptureSensor)


def _of_number(model: Model, prepared: Prepared, name: NumberRef) -> Direction:
    part, key = model.owner(name.owner), name.key
    if isinstance(part, Surface):
        return Direction(surface=part.mode_coefficients[mode_index(key)])
    if isinstance(part, Term):
        return Direction(parameter=parameter_index(model.terms, part, key))
    if isinstance(part, Legs):
        return Direction(leg=_of_legs(model, prepared, name))
    if name in _START:
        return Direction(start=_START[name])
    if _turns_capture(model, name):
        return Direction(tables=prepared.correct_capture(complex_model(model, name)))
    return Direction()


def _of_legs(model: Model, prepared: Prepared, name: NumberRef) -> tuple[float, float]:
    """Return how stiffness and damping of the rise change with a number of legs that give.

    Raises InputError where they do not: the stiffness of a leg that holds has no derivative.
    """
    if not model.legs.give:
        raise InputError("model", name, "legs that do not give have no derivative", "give legs.compliance above 0")
    stiffness, damping = (slope_of(rate) for rate in prepared.leg_rates(complex_model(model, name).legs))
    return float(stiffness), float(damping)


def _pass(model: Model, at: Prepared, directions: Sequence[Direction]) -> tuple[ReducedRun, dict[str, Array]]:
    """Return the run, and of each of its fields the derivatives in those directions."""
    kernel, contact = reduced_module(), at.kernel_contact(model)
    parameters = law_parameters(model.terms)
    start = start_of_run(model, at, kernel, parameters, contact)
    order = sorted(range(len(directions)), key=lambda i: (rank(directions[i].tables), -directions[i].first))
    ordered = [directions[i] for i in order]
    listed, by_parameter = listed_parameters(model.terms, ordered)
    inputs = tangent_inputs(at, ordered, listed, by_parameter, len(contact.omega))
    place, velocity, eta = _start_tangents(kernel, parameters, contact, at, start, ordered, inputs)
    begin = np.minimum.accumulate(np.array([direction.first for direction in ordered], dtype=np.int64))
    inputs = inputs._replace(begins=begin, place=place, velocity=velocity, eta=eta)
    motion, many = at.kernel_motion(), len(ordered)
    series = empty_series(len(at.time))
    slopes = TangentSeries(*(np.zeros((*array.shape, many)) for array in series))
    done = kernel.run_tangents(parameters, contact, motion, start.state, inputs, series, slopes)
    run = reduced_run(at, series, done)
    slopes_by_field = run_slopes(at, ordered, slopes, table_slopes(at, ordered, "foot_rotation")[..., 0, :])
    return run, put_back(slopes_by_field, order)


def _start_tangents(
    kernel: Any, parameters: LawParameters, contact: ModalContact, at: Prepared, start: StartOfRun,
    ordered: Sequence[Direction], inputs: TangentInputs,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return derivatives of the pelvis' place and velocity (3, d) and of the modes' amplitudes (2k, d) at the start.

    At rest the skis carry the load and each mode its share, g(height, η, p) = 0: the implicit function theorem gives
    how height and amplitudes move.
    """
    many, modes = len(ordered), len(contact.omega)
    moving = [direction.tables_at_start(at) for direction in ordered]
    place, velocity = place_at_start(at, ordered)
    eta, share = np.zeros((2 * modes, many)), np.zeros((2, many))
    given = np.array([0.5, 0.5])
    for rest in start.rests:
        load = np.array(
            [slope_of(load_at_start(tables, given + 1j * STEP * share[:, k])) for k, tables in enumerate(moving)]
        )
        eta, place[2], share = _rest_tangents(parameters, contact, at, start, rest, place, load, inputs)
        given = rest.share
    rising, own = zip(
        *(
            climb_at_start(
                kernel, parameters, contact.surface, at, (start.place, start.velocity), (place, velocity), inputs, foot
            )
            for foot in range(2)
        ),
        strict=True,
    )
    for foot in range(2):
        velocity[2] += share[foot] * rising[foot] + start.rests[1].share[foot] * own[foot]
    for k, direction in enumerate(ordered):
        place[2, k] += direction.start == _START[HEIGHT]
        velocity[2, k] += direction.start == _START[VELOCITY_N]
    return place, velocity, eta


def _rest_tangents(
    parameters: LawParameters, contact: ModalContact, at: Prepared, start: StartOfRun, rest: Rest, place: Array,
    load: Array, inputs: TangentInputs,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return derivatives of the modes' amplitudes (2k, d), of the pelvis' height (d,) and of the feet's shares (2, d)
    at rest.

    place : (3, d) of the pelvis, its height not yet counted;  load : (d,) N
    """
    kernel = reduced_module()
    many, modes, count = len(load), len(contact.omega), len(inputs.columns.index)
    fixed = MODES + 2 * modes
    still, none = (0.0, 0.0, 0.0), np.zeros(modes)
    work = kernel.ski_work(2 * len(contact.length), modes, len(parameters.values))
    size = fixed + count + PATCH
    skis = np.zeros((2, MODAL + modes + FURTHER, size))
    z = np.zeros((2, size, many))
    matrix = np.zeros((1 + 2 * modes, 1 + 2 * modes))
    right = np.zeros((1 + 2 * modes, many))
    right[0] = load
    for ski in range(2):
        at_foot = np.array([start.place[0], start.place[1], rest.height]) + at.foot_place[0, ski]
        foot = (tuple(at_foot), still, at.foot_rotation[0, ski], still)
        kernel.linearise_ski(
            parameters, contact, inputs.columns, float(at.time[0]), foot, rest.eta[ski], none, 1.0 - 2.0 * ski, work,
            skis[ski],
        )  # fmt: skip
        z[ski, PLACE : PLACE + 3] = of_foot(inputs, ski, 0)
        z[ski, PLACE : PLACE + 2] += place[:2]
        z[ski, TURN:SPIN] = of_foot(inputs, ski, 6)
        z[ski, fixed : fixed + count] = inputs.parameters
        kernel.collect_patch(z[ski], inputs, contact.surface, at_foot[0], at_foot[1])
        rows = slice(1 + ski * modes, 1 + (ski + 1) * modes)
        linear, modal = skis[ski], slice(MODAL, MODAL + modes)
        matrix[0, 0] += linear[2, PLACE + 2]
        matrix[0, rows] = linear[2, MODES : MODES + modes]
        matrix[rows, 0] = -linear[modal, PLACE + 2]
        matrix[rows, rows] = np.diag(contact.omega**2) - linear[modal, MODES : MODES + modes]
        right[0] -= linear[2] @ z[ski]
        right[rows] = linear[modal] @ z[ski]
        right[rows.stop - 1] -= inputs.leg[0] * rest.eta[ski, -1]
    solution: Array = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    loads = np.zeros((2, many))
    for ski in range(2):
        z[ski, PLACE + 2] += solution[0]
        z[ski, MODES : MODES + modes] = solution[1 + ski * modes : 1 + (ski + 1) * modes]
        loads[ski] = skis[ski, MODAL + modes + LOAD] @ z[ski]
    shares = loads - rest.share[:, None] * loads.sum(axis=0)
    return solution[1:], solution[0], np.asarray(shares / rest.loads.sum())
