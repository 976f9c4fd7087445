"""Derivatives of what instruments see of a run of the reduced model, and runs of many models side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from sssi_exudyn.contact.codegen.compiled import in_order, law_parameters
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import number_ref
from sssi_exudyn.model.faults import antenna_shift
from sssi_exudyn.model.model import Model
from sssi_exudyn.runtime.threads import cores_used, side_by_side
from sssi_exudyn.simulation.reduced.carved_run import CarvedMoment
from sssi_exudyn.simulation.reduced.derivative_inputs import STEP
from sssi_exudyn.simulation.reduced.derivatives import (
    Addition,
    TableChange,
    along,
    complex_model,
    host_of,
    run_additions,
    run_tangents,
    with_classes_of,
)
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, reduced_run
from sssi_exudyn.simulation.reduced.run import reduced_module, run_batch, start_of_run
from sssi_exudyn.simulation.ski_on_snow.structs import ReducedSeries

_ADDITIONS: Final = 96
"""Derivatives of one pass; more would fill the memory rather than save time."""


def sensitivities(
    model: Model,
    prepared: Prepared,
    names: Sequence[str],
    observed: Callable[[Model, ReducedRun], Array],
    changes: Sequence[TableChange] = (),
    begin: CarvedMoment | None = None,
) -> tuple[Array, Array]:
    """Return what is ``observed`` of a run, any shape (…), and its derivative (…, k) at size 0.  Derivatives are by the
    numbers of those names, then by the size of those changes of the posture's tables.

    Exact: the run's tangents are carried along with it, and ``observed`` is differentiated by a complex step.  It must
    therefore be a formula over the run's arrays and the model's numbers that NumPy continues to complex ones.

    begin : as in ``run_tangents``

    Raises SimulationDiverged as ``simulate_reduced`` does, InputError for an unknown name.
    """
    run, slopes = run_tangents(model, prepared, names, changes, begin)
    first = observed(model, run)
    models = [*(complex_model(model, name) for name in names), *(model for _ in changes)]
    columns = [np.imag(observed(stepped, along(run, slopes, i))) / STEP for i, stepped in enumerate(models)]
    return first, np.stack(columns, axis=-1) if columns else np.zeros((*first.shape, 0))


def responses_to_additions(
    additions: Sequence[Addition],
    prepared: Prepared,
    observed: Callable[[Model, ReducedRun], Array],
    *,
    cores: int | None = None,
) -> Array:
    """Return derivatives (…, k) of what is ``observed`` of a run by the strengths of additions to its model, at
    strength 0.

    All of their models run alike, as what was added does nothing yet.  So the run is linearised once for all that have
    as many terms of each class, and with ``sensitivities``' demands on ``observed`` the derivatives are exact.

    cores : that are used at most; all if None

    Raises SimulationDiverged when the run does, InputError for an unknown name.
    """
    hosts = [host_of(addition) for addition in additions]
    every = [term for host in hosts for term in host.terms]
    hosts = [with_classes_of(host, every) for host in hosts]
    is_law = [isinstance(model.owner(number_ref(name).owner), Term) for model, name in additions]
    first = is_law.index(True) if any(is_law) else 0
    groups: dict[tuple[type[Term], ...], list[int]] = {}
    for i, host in enumerate(hosts):  # what adds no law goes along with any
        groups.setdefault(_laws(host if is_law[i] else hosts[first]), []).append(i)
    reduced_module()  # once, before threads ask for it
    parts: list[tuple[Model, list[int]]] = []
    for laws, group in groups.items():
        host = next(host for host in hosts if _laws(host) == laws)
        parts += [(host, group[k : k + _ADDITIONS]) for k in range(0, len(group), _ADDITIONS)]

    def columns(part: tuple[Model, list[int]]) -> list[Array]:
        host, group = part
        run, slopes = run_additions(host, prepared, [additions[i] for i in group])
        return [
            np.imag(observed(complex_model(*additions[i]), along(run, slopes, k))) / STEP for k, i in enumerate(group)
        ]

    columns_of_parts = side_by_side(columns, parts, cores=cores)
    seen = {
        i: column
        for (_, group), some in zip(parts, columns_of_parts, strict=True)
        for i, column in zip(group, some, strict=True)
    }
    return np.stack([seen[i] for i in range(len(additions))], axis=-1)


def simulate_each(
    models: Sequence[Model],
    prepared: Prepared,
    observed: Callable[[Model, ReducedRun], Array],
    *,
    cores: int | None = None,
) -> list[Array]:
    """Return what is ``observed`` of a run of each model.  One compiled call a core runs all that have the same laws,
    snow surface, legs and capture, whose tables they share.

    cores : that are used at most; all if None

    Raises SimulationDiverged when one of the runs does.
    """
    groups: dict[object, list[int]] = {}
    for i, model in enumerate(models):
        groups.setdefault((_laws(model), _capture(model, prepared), id(model.surface), model.legs), []).append(i)
    cores = cores_used(cores)
    parts = [(group[0], group[k::cores]) for group in groups.values() for k in range(min(cores, len(group)))]
    tables = {group[0]: prepared.correct_capture(models[group[0]]) for group in groups.values()}
    reduced_module()  # once, before threads ask for it
    runs_of_parts = side_by_side(lambda part: _runs([models[i] for i in part[1]], tables[part[0]]), parts, cores=cores)
    seen: dict[int, Array] = {}
    for (_, indices), runs in zip(parts, runs_of_parts, strict=True):
        seen |= {i: observed(models[i], run) for i, run in zip(indices, runs, strict=True)}
    return [seen[i] for i in range(len(models))]


def _laws(model: Model) -> tuple[type[Term], ...]:
    """Return the classes of a model's laws: two models with the same have parameters of the same form."""
    return tuple(type(term) for term in in_order(model.terms))


def _capture(model: Model, prepared: Prepared) -> object:
    """Return what of a model changes the tables: two with the same have the same tables."""
    ends = model.capture_yaw(prepared.time[[0, -1]])
    return tuple(ends.tolist()), tuple(antenna_shift(model.sensors).tolist())


def _runs(models: Sequence[Model], at: Prepared) -> list[ReducedRun]:
    """Run models with the same laws and surface on the same tables, in one compiled call."""
    kernel, contact = reduced_module(), at.kernel_contact(models[0])
    every = [law_parameters(model.terms) for model in models]
    starts = [start_of_run(model, at, kernel, own, contact) for model, own in zip(models, every, strict=True)]
    parameters = every[0]._replace(values=np.stack([own.values for own in every]))
    series, done = run_batch(kernel, contact, at.kernel_motion(), parameters, starts)
    return [reduced_run(at, ReducedSeries(*(array[i] for array in series)), int(count)) for i, count in enumerate(done)]
