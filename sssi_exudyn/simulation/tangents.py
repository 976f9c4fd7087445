"""A run of the reduced model with its exact derivatives by any numbers: one pass, whatever their count.

The compiled loop carries the tangents of pelvis and skis along (``contact.backends.reduced_tangents``).  What NumPy
computes before and after it, the tables of the posture and what instruments report, is differentiated by a complex
step: a number is given an imaginary part of ``STEP`` times its change, and the result's imaginary part is the
derivative, without the cancellation of a difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from math import ceil
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.contact.backends.compiled import (
    in_order,
    law_parameters,
    parameter_index,
    parameter_values,
    place_parameters,
)
from sssi_exudyn.contact.backends.reduced_tangents import FURTHER, LOAD, MODAL, MODES, PLACE, SPIN, TURN
from sssi_exudyn.contact.backends.structs import (
    LawParameters,
    ModalContact,
    ParameterColumns,
    PrescribedMotion,
    TangentInputs,
    TangentSeries,
)
from sssi_exudyn.contact.term import Term, WindTerm
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import CaptureSensor
from sssi_exudyn.model.model import Model, mode_index
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.runtime.threads import cores_used, side_by_side
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.prepared import Prepared, ReducedRun, empty_series, load_at_start, prepare, reduced_run
from sssi_exudyn.simulation.reduced import Rest, StartOfRun, reduced_module, start_of_run
from sssi_exudyn.terrain.surface import PATCH, Surface, grid_patch, patch_under

STEP: Final = 1e-20
"""Of a complex step; its square is lost beside any number, so that nothing but the derivative is left."""
_TABLES: Final = 100_000
"""Numbers that change the posture's tables in one pass, times instants: each takes 1 kB of memory an instant, and
larger arrays cost more to be had than they save."""
_LEAST: Final = 24
"""Of them in a pass that is worth its run."""
_OVER_TIME: Final = ("antenna", "foot", "com", "exposed")
"""How names of tables over time begin, each with one row an instant."""
_START: Final = {"start.f": 0, "start.l": 1, "start.velocity_f": 2, "start.velocity_l": 3}

TableChange = Callable[[Prepared, complex], Prepared]
"""The tables of a capture that is other by a size, as a formula that NumPy continues to complex sizes."""
Addition = tuple[Model, str]
"""A model with one part more, a term or a fault, that does nothing yet; and the name of the number that is its
strength."""


@dataclass(frozen=True)
class Direction:
    """What changes with one number.

    parameter : where it stands among the laws' parameters, −1 for none of them
    values : the laws' parameters at which the derivative is taken; None for the run's own
    start : where it stands among the antenna's place and velocity at the start (f, l, f, l), −1 for none of them
    surface : (nf + 2, nl + 2) m, change of the snow surface's coefficients; None where it does not change
    tables : the posture's tables with the number's complex step; None where they do not change
    """

    parameter: int = -1
    values: Array | None = None
    start: int = -1
    surface: Array | None = None
    tables: Prepared | None = None


def complex_model(model: Model, name: str) -> Model:
    """The model with the complex step of one number."""
    return model.with_values({name: model.value(name) + 1j * STEP})


def run_tangents(
    model: Model, prepared: Prepared, names: Sequence[str], changes: Sequence[TableChange] = ()
) -> tuple[ReducedRun, ReducedRun]:
    """A run, and its derivatives by the model's numbers of those names, then by the size of those changes, at size 0:
    each field with one axis more, last.

    Numbers that only instruments know (a late clock, faults of GPS and insoles) change nothing of the run.
    Raises SimulationDiverged as ``simulate_reduced`` does, KeyError for an unknown name.
    """
    makers = [lambda name=name: _of_number(model, prepared, name) for name in names]
    makers += [lambda change=change: Direction(tables=_changed(model, prepared, change)) for change in changes]
    at = prepared.correct_capture(model)
    tabular = [i for i, name in enumerate(names) if _turns_capture(model, name)]
    tabular += range(len(names), len(makers))
    plain = [i for i in range(len(makers)) if i not in tabular]
    most = max(1, _TABLES // len(prepared.time))
    count = cores_used(None) * ceil(len(tabular) / (most * cores_used(None)))  # as many on each core
    count = min(count, ceil(len(tabular) / _LEAST))
    groups = [group for group in (tabular[i::count] for i in range(count)) if group] or [[]]
    groups[-1] = groups[-1] + plain
    reduced_module()  # once, before threads ask for it
    passes = side_by_side(lambda group: _pass(model, at, [makers[i]() for i in group]), groups)
    slopes: dict[str, Array] = {}
    for group, (_, found) in zip(groups, passes, strict=True):
        for name, array in found.items():
            slopes.setdefault(name, np.zeros((*array.shape[:-1], len(makers))))[..., group] = array
    return passes[0][0], ReducedRun(**slopes)


def host_of(addition: Addition) -> Model:
    """The model whose run is linearised for an addition: one run serves as many as possible.

    Forces of terms add up, and so do heights, so that a term has the same derivative in the place of another of its
    class.  Only the air's velocity must be whole, since drag is no linear function of it.
    """
    model, name = addition
    part = model.owner(name.partition(".")[0])
    others = tuple(term for term in model.terms if term is not part)
    if isinstance(part, WindTerm) or not any(type(term) is type(part) for term in others):
        return model
    return replace(model, terms=others)


def with_classes_of(model: Model, terms: Sequence[Term]) -> Model:
    """The model with a term of every class of ``terms`` that it has none of: those, which must do nothing."""
    present = {type(term) for term in model.terms}
    lacking = {type(term): term for term in terms if type(term) not in present}
    return replace(model, terms=(*model.terms, *lacking.values()))


def run_additions(host: Model, prepared: Prepared, additions: Sequence[Addition]) -> tuple[ReducedRun, ReducedRun]:
    """A run, and its derivatives by the strengths of those additions, as ``run_tangents`` gives them: one pass,
    although each addition has numbers of its own that say where and when it acts.

    host : ``host_of`` any of them, ``with_classes_of`` those of all; that of an added term has the same laws
    """
    directions = [_of_addition(host, prepared, addition) for addition in additions]
    run, slopes = _pass(host, prepared.correct_capture(host), directions)
    return run, ReducedRun(**slopes)


def _of_addition(host: Model, prepared: Prepared, addition: Addition) -> Direction:
    model, name = addition
    owner, _, key = name.partition(".")
    part = model.owner(owner)
    if not isinstance(part, Term):
        return _of_number(model, prepared, name)
    terms, extended = in_order(host.terms), in_order(with_classes_of(model, host.terms).terms)
    if len(extended) > len(terms):
        other = next(term for term in terms if type(term) is type(part))
        extended = tuple(part if term is other else term for term in terms)
    return Direction(parameter=parameter_index(extended, part, key), values=parameter_values(extended))


def skier_mass_change(model: Model, motion: Motion, prepared: Prepared) -> TableChange:
    """The change of the tables by a skier who is heavier by a size (kg), without other proportions.

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
            first, second = (each.body_mass * getattr(each, name) for each in (prepared, other))
            return np.asarray((first + size * (second - first)) / body)

        first, second = light * prepared.exposed_velocity, heavy * other.exposed_velocity
        masses: dict[str, Any] = {
            "mass": prepared.mass + size * (other.mass - prepared.mass),
            "body_mass": body,
        }
        return replace(
            tables,
            **masses,
            com_place=mean("com_place"),
            com_velocity=mean("com_velocity"),
            com_acceleration=mean("com_acceleration"),
            exposed_velocity=(first + size * (second - first)) / segments,
        )

    return change


def along(run: ReducedRun, slopes: ReducedRun, index: int) -> ReducedRun:
    """The run with the complex step of one of the numbers that it was differentiated by."""
    parts = {entry.name: getattr(run, entry.name) for entry in fields(ReducedRun)}
    for name in parts.keys() - {"time"}:
        parts[name] = parts[name] + 1j * STEP * getattr(slopes, name)[..., index]
    return ReducedRun(**parts)


def _turns_capture(model: Model, name: str) -> bool:
    return name == "start.heading_offset" or isinstance(model.owner(name.partition(".")[0]), CaptureSensor)


def _of_number(model: Model, prepared: Prepared, name: str) -> Direction:
    owner, _, key = name.partition(".")
    part = model.owner(owner)
    if isinstance(part, Surface):
        return Direction(surface=part.mode_coefficients[mode_index(key)])
    if isinstance(part, Term):
        return Direction(parameter=parameter_index(model.terms, part, key))
    if name in _START:
        return Direction(start=_START[name])
    if _turns_capture(model, name):
        return Direction(tables=prepared.correct_capture(complex_model(model, name)))
    return Direction()


def _changed(model: Model, prepared: Prepared, change: TableChange) -> Prepared:
    return change(prepared, 1j * STEP).correct_capture(model)


def _slope(value: Any) -> Any:
    """The derivative that a complex step has left in a number or an array."""
    return np.imag(value) / STEP


def _pass(model: Model, at: Prepared, directions: Sequence[Direction]) -> tuple[ReducedRun, dict[str, Array]]:
    """The run, and of each of its fields the derivatives in those directions."""
    kernel, contact = reduced_module(), at.kernel_contact(model.surface)
    parameters = law_parameters(model.terms)
    start = start_of_run(model, at, kernel, parameters, contact)
    tables = [d.tables for d in directions]
    begins = [_begin(each) for each in tables]
    order = sorted(range(len(tables)), key=lambda i: (_rank(tables[i]), -begins[i]))
    ordered = [directions[i] for i in order]
    listed, by_parameter = _columns(model.terms, ordered)
    inputs = _inputs(kernel, parameters, contact, at, start, ordered, listed, by_parameter)
    inputs = inputs._replace(begins=np.minimum.accumulate(np.array([begins[i] for i in order], dtype=np.int64)))
    motion, many, n = at.kernel_motion(), len(ordered), len(at.time)
    series = empty_series(n)
    slopes = TangentSeries(*(np.zeros((*array.shape, many)) for array in series))
    done = kernel.run_tangents(parameters, contact, motion, start.state, inputs, series, slopes)
    run = reduced_run(at, series, done)
    back = np.argsort(np.array(order, dtype=np.intp))

    def of_tables(name: str) -> Array:
        shape = getattr(at, name).shape
        columns = [np.zeros(shape) if d.tables is None else _slope(getattr(d.tables, name)) for d in ordered]
        return np.stack(columns, axis=-1) if columns else np.zeros((*shape, 0))

    found = {
        "time": np.zeros((n, many)),
        "pelvis": slopes.place,
        "pelvis_velocity": slopes.velocity,
        "antenna": slopes.place + of_tables("antenna"),
        "com": slopes.place + of_tables("com_place"),
        "com_velocity": slopes.velocity + of_tables("com_velocity"),
        "foot_load": slopes.loads,
        "sole_force": slopes.sole,
        "foot_friction": slopes.friction,
        "foot_position": slopes.place[:, None] + of_tables("foot_place"),
        "foot_velocity": slopes.velocity[:, None] + of_tables("foot_velocity"),
        "foot_forward": of_tables("foot_rotation")[..., 0, :],
        "edge_angle": slopes.edges,
        "snow_force": slopes.force,
        "snow_moment": slopes.moment,
    }
    return run, {name: array[..., back] for name, array in found.items()}


def _rank(tables: Prepared | None) -> int:
    """0 for tables of body and feet, 1 for those of the feet alone, 2 for none: the order the kernel wants."""
    if tables is None:
        return 2
    body = (tables.com_place, tables.com_velocity, tables.exposed_velocity)
    return 0 if any(np.any(np.imag(array)) for array in body) else 1


def _begin(tables: Prepared | None) -> int:
    """The instant at which tables first change with their number, 0 where they do not or nothing else does."""
    if tables is None:
        return 0
    n, first = len(tables.time), len(tables.time)
    for entry in fields(Prepared):
        value = getattr(tables, entry.name)
        if np.iscomplexobj(value) and np.any(np.imag(value)):
            over_time = entry.name.startswith(_OVER_TIME)
            first = min(first, int(np.argmax(np.any(np.imag(value).reshape(n, -1), axis=1))) if over_time else 0)
    return first


def _inputs(
    kernel: Any, parameters: LawParameters, contact: ModalContact, at: Prepared, start: StartOfRun,
    ordered: Sequence[Direction], columns: ParameterColumns, by_parameter: Array,
) -> TangentInputs:  # fmt: skip
    """What the directions change, as the kernel takes it; columns and by_parameter are those of ``_columns``."""
    many, n, modes, exposed = len(ordered), len(at.time), len(contact.omega), len(at.area)
    ranks = [_rank(d.tables) for d in ordered]
    feet = np.zeros((n, 2, 18, ranks.count(0) + ranks.count(1)))
    inertia = np.zeros((n, 3, feet.shape[3]))
    body = np.zeros((n, 6 + 3 * exposed, ranks.count(0)))
    mass, gravity = np.zeros(many), np.zeros((3, many))
    for k, direction in enumerate(ordered):
        if direction.tables is None:
            continue
        motion = direction.tables.kernel_motion()
        mass[k], gravity[:, k] = _slope(motion.mass), _slope(motion.gravity)
        inertia[..., k] = _slope(motion.carried)
        parts = (
            motion.foot_place,
            motion.foot_velocity,
            _turns(motion),
            motion.foot_spin,
            motion.ski_acceleration,
            motion.ski_turning,
        )
        for i, part in enumerate(parts):
            feet[:, :, 3 * i : 3 * i + 3, k] = part if i == 2 else _slope(part)
        if k < body.shape[2]:
            body[:, :3, k], body[:, 3:6, k] = _slope(motion.com_place), _slope(motion.com_velocity)
            body[:, 6:, k] = _slope(motion.exposed_velocity).reshape(n, -1)
    moved = [(k, d.surface) for k, d in enumerate(ordered) if d.surface is not None]
    grids = np.stack([grid for _, grid in moved]) if moved else np.zeros((0, 2, 2))
    amounts = np.array([[float(k == column) for column in range(many)] for k, _ in moved]).reshape(len(moved), many)
    zeros = TangentInputs(
        np.zeros(many, dtype=np.int64), columns, by_parameter,
        grids, amounts, mass, gravity, np.zeros((3, many)), np.zeros((3, many)),
        np.zeros((2 * modes, many)), feet, inertia, body,
    )  # fmt: skip
    place, velocity, eta = _start_tangents(kernel, parameters, contact, at, start, ordered, zeros)
    return zeros._replace(place=place, velocity=velocity, eta=eta)


def _turns(motion: PrescribedMotion) -> Array:
    """(n, 2, 3) rad: rotation vectors by which the feet turn with the number, from the matrices' complex step."""
    spin = _slope(motion.foot_rotation) @ np.swapaxes(np.real(motion.foot_rotation), -1, -2)
    return np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)


def _columns(terms: Sequence[Term], ordered: Sequence[Direction]) -> tuple[ParameterColumns, Array]:
    """The laws' parameters that change, and the change (c, d) of each with each number."""
    rows: dict[bytes, int] = {}
    values: list[Array] = []
    places: dict[tuple[int, int], list[int]] = {}
    for k, direction in enumerate(ordered):
        row = -1
        if direction.values is not None:
            row = rows.setdefault(direction.values.tobytes(), len(rows))
            values += [direction.values] if row == len(values) else []
        if direction.parameter >= 0:
            places.setdefault((row, direction.parameter), []).append(k)
    listed = sorted(places)
    changes = np.zeros((len(listed), len(ordered)))
    for column, place in enumerate(listed):
        changes[column, places[place]] = 1.0

    def of(kind: str) -> Any:
        known = place_parameters(terms, kind)
        return np.array([i for i, (_, p) in enumerate(listed) if p in known], dtype=np.int64)

    on_ski = {p for kind in ("point", "foot", "terrain") for p in place_parameters(terms, kind)}
    columns = ParameterColumns(
        index=np.array([p for _, p in listed], dtype=np.int64),
        values=np.array(values).reshape(len(values), len(parameter_values(terms))),
        row=np.array([row for row, _ in listed], dtype=np.int64),
        ski=np.array([p in on_ski for _, p in listed], dtype=np.bool_),
        point=of("point"),
        segment=of("segment"),
        body=of("body"),
        terrain=of("terrain"),
    )
    return columns, changes


def _start_tangents(
    kernel: Any, parameters: LawParameters, contact: ModalContact, at: Prepared, start: StartOfRun,
    ordered: Sequence[Direction], inputs: TangentInputs,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Derivatives of the pelvis' place and velocity (3, d) and of the modes' amplitudes (2k, d) at the start.

    At rest the skis carry the load and each mode its share, g(height, η, p) = 0: the implicit function theorem gives
    how height and amplitudes move.
    """
    many, modes = len(ordered), len(contact.omega)
    moving = [at if d.tables is None else d.tables for d in ordered]
    place, velocity, eta = np.zeros((3, many)), np.zeros((3, many)), np.zeros((2 * modes, many))
    share = np.zeros((2, many))
    for k, (direction, tables) in enumerate(zip(ordered, moving, strict=True)):
        place[:2, k], velocity[:2, k] = -_slope(tables.antenna[0, :2]), -_slope(tables.antenna_velocity[0, :2])
        if 0 <= direction.start < 2:
            place[direction.start, k] += 1.0
        elif direction.start >= 2:
            velocity[direction.start - 2, k] += 1.0
    given = np.array([0.5, 0.5])
    for rest in start.rests:
        load = np.array(
            [_slope(load_at_start(tables, given + 1j * STEP * share[:, k])) for k, tables in enumerate(moving)]
        )
        eta, place[2], share = _rest_tangents(kernel, parameters, contact, at, start, rest, place, load, inputs)
        given = rest.share
    ground = np.zeros((3, 2)), np.zeros((3, len(parameters.values)))
    surface = contact.surface
    for foot in range(2):
        where = start.place + at.foot_place[0, foot]
        under = patch_under(surface, where[0], where[1])
        slopes = np.array(kernel.terrain_height(parameters, where[0], where[1])[1:]) + under[3:5]
        kernel.linearise_ground(parameters, under, where[0], where[1], *ground)
        tilting = np.zeros((2, len(inputs.columns.index)))
        for column, (row, p) in enumerate(zip(inputs.columns.row, inputs.columns.index, strict=True)):
            if row >= 0:
                others = parameters._replace(values=inputs.columns.values[row])
                kernel.linearise_ground(others, under, where[0], where[1], *ground)
            tilting[:, column] = ground[1][1:, p]
        tilts = [grid_patch(grid, surface.origin, surface.spacing, where[0], where[1])[1:3] for grid in inputs.surface]
        speed = start.velocity + at.foot_velocity[0, foot]
        pace = velocity + _of_foot(inputs, foot, 3)
        turning = ground[0][1:] @ (place + _of_foot(inputs, foot, 0))[:2]
        turning += tilting @ inputs.parameters
        turning += np.reshape(tilts, (-1, 2)).T @ inputs.amounts
        rising = slopes @ speed[:2] - at.foot_velocity[0, foot, 2]
        weight = start.rests[1].share[foot]
        own = slopes @ pace[:2] + speed[:2] @ turning - _of_foot(inputs, foot, 3)[2]
        velocity[2] += share[foot] * rising + weight * own
    return place, velocity, eta


def _of_foot(inputs: TangentInputs, foot: int, row: int) -> Array:
    """(3, d) three rows of the feet's table at the start, for all numbers."""
    found = np.zeros((3, len(inputs.mass)))
    found[:, : inputs.feet.shape[3]] = inputs.feet[0, foot, row : row + 3]
    return found


def _rest_tangents(
    kernel: Any, parameters: LawParameters, contact: ModalContact, at: Prepared, start: StartOfRun, rest: Rest,
    place: Array, load: Array, inputs: TangentInputs,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Derivatives of the modes' amplitudes (2k, d), of the pelvis' height (d,) and of the feet's shares (2, d) at rest.

    place : (3, d) of the pelvis, its height not yet counted;  load : (d,) N
    """
    many, modes, count = len(load), len(contact.omega), len(inputs.columns.index)
    fixed = MODES + 2 * modes
    still, none = (0.0, 0.0, 0.0), np.zeros((2, modes))
    work = kernel.ski_work(modes, len(parameters.values))
    size = fixed + count + PATCH
    skis = np.zeros((2, MODAL + modes + FURTHER, size))
    z = np.zeros((2, size, many))
    matrix = np.zeros((1 + 2 * modes, 1 + 2 * modes))
    right = np.zeros((1 + 2 * modes, many))
    right[0] = load
    for ski in range(2):
        foot = (tuple(at.foot_place[0, ski]), still, at.foot_rotation[0, ski], still)
        where = (start.place[0], start.place[1], rest.height)
        kernel.linearise_ski(
            parameters, contact, inputs.columns, float(at.time[0]), where, still, rest.eta, none, foot, ski, work,
            skis[ski],
        )  # fmt: skip
        z[ski, PLACE : PLACE + 3] = _of_foot(inputs, ski, 0)
        z[ski, PLACE : PLACE + 2] += place[:2]
        z[ski, TURN:SPIN] = _of_foot(inputs, ski, 6)
        z[ski, fixed : fixed + count] = inputs.parameters
        at_foot = start.place + at.foot_place[0, ski]
        kernel.collect_patch(z[ski], inputs, contact.surface, at_foot[0], at_foot[1])
        rows = slice(1 + ski * modes, 1 + (ski + 1) * modes)
        found, modal = skis[ski], slice(MODAL, MODAL + modes)
        matrix[0, 0] += found[2, PLACE + 2]
        matrix[0, rows] = found[2, MODES : MODES + modes]
        matrix[rows, 0] = -found[modal, PLACE + 2]
        matrix[rows, rows] = np.diag(contact.omega**2) - found[modal, MODES : MODES + modes]
        right[0] -= found[2] @ z[ski]
        right[rows] = found[modal] @ z[ski]
    solution: Array = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    loads = np.zeros((2, many))
    for ski in range(2):
        z[ski, PLACE + 2] += solution[0]
        z[ski, MODES : MODES + modes] = solution[1 + ski * modes : 1 + (ski + 1) * modes]
        loads[ski] = skis[ski, MODAL + modes + LOAD] @ z[ski]
    shares = loads - rest.share[:, None] * loads.sum(axis=0)
    return solution[1:], solution[0], np.asarray(shares / rest.loads.sum())
