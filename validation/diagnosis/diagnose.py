"""Where a recording and its simulation part, what physics was left out, the extended model, and the proof.

``diagnose`` is the whole of it; the ``diagnosis`` in what it gives is what ``diagnosis.json`` holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Final

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.validation.diagnosis.description import Accepted, describe, figures_of
from sssi_exudyn.validation.diagnosis.held_out import folds_of
from sssi_exudyn.validation.diagnosis.hypotheses import OF_A_DAY
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.search import Progress, Searcher, setting_of
from sssi_exudyn.validation.diagnosis.search_result import STANDS_OUT, Figures, SearchResult, SeparateFit

MOST_FINDINGS: Final = 3
ONCE_MORE: Final = 0.05
"""The same once something has been found: a second finding has to be more certain, as the first is no exact model."""


def diagnose(
    recording: Recording,
    motion: Motion,
    model: Model,
    *,
    full: bool = True,
    cache: Cache | None = None,
    say: Progress = lambda _fraction, _detail: None,
) -> SearchResult:
    """Find what is missing from ``model`` to explain the recording.

    With ``full`` every fit is confirmed by the full model; without, all is judged by the reduced one.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    searcher = Searcher(setting_of(recording, motion, model), say, cache)
    first = base = searcher.first()
    result = None
    if full:
        say(None, "the full model")
        base, result = searcher.confirmed(base)
        first = base
    rounds = [searcher.round(base)]
    accepted: list[Accepted] = []
    while len(accepted) < MOST_FINDINGS:
        latest = rounds[-1]
        allowed = ONCE_MORE if accepted else STANDS_OUT
        best = latest.best
        if latest.nothing.probability > allowed or best.fit is None:
            break
        as_it_was, run = (searcher.levels, searcher.beyond), result
        searcher.levels = best.levels
        try:
            found = searcher.settled(best.fit)
            if full:
                say(None, f"the full model with {best.name}")
                found, run = searcher.confirmed(found)
            rounds.append(searcher.round(found))
        except SimulationDiverged as error:
            say(None, f"nothing more is looked for: with {best.name} {error}")
            searcher.levels, searcher.beyond = as_it_was
            break
        base, result = found, run
        accepted.append((latest, best, base))
    if len(accepted) > 1:
        names = [verdict.name for _, verdict, _ in accepted]
        levels = searcher.levels
        try:
            accepted = _weighed_again(searcher, accepted)
        except SimulationDiverged as error:
            say(None, f"what was found is not weighed again: {error}")
            searcher.levels = levels
        base = accepted[-1][2] if accepted else first
        if full:
            say(None, "the full model with all that was found")
            base, result = searcher.confirmed(base)
            accepted[-1:] = [(*each[:2], base) for each in accepted[-1:]]
        if sorted(names) != sorted(verdict.name for _, verdict, _ in accepted):
            rounds.append(searcher.round(base))
    diagnosis, figures = describe(recording.name, searcher, first, base, rounds, accepted)
    return SearchResult(
        diagnosis=diagnosis,
        first=first,
        fit=base,
        result=result,
        noise=searcher.levels,
        rounds=tuple(rounds),
        figures=figures,
        separate_fit=partial(separate_fit, searcher, base, accepted),
    )


def _weighed_again(searcher: Searcher, accepted: list[Accepted]) -> list[Accepted]:
    """Every finding weighed again beside the others; the last only when one of them has become another.

    What was said first was said while the others were still hidden: it may have stood for one of them, and its
    probability and its alternatives were those of a mixture.  What is superfluous beside the others goes.
    """
    said = [verdict for _, verdict, _ in accepted]
    names = sorted(verdict.name for verdict in said)
    for verdict in said:
        if verdict is said[-1] and sorted(each.name for _, each, _ in accepted) == names:
            break
        candidate = verdict.candidate
        at = next(i for i, (_, each, _) in enumerate(accepted) if each is verdict)
        if candidate is None or [each.name for _, each, _ in accepted].count(verdict.name) > 1:
            continue  # two of a name cannot be taken apart by it
        rest = [
            *accepted[:at],
            *((seen, each, searcher.without(fit, candidate)) for seen, each, fit in accepted[at + 1 :]),
        ]
        again = searcher.round(rest[-1][2] if rest else searcher.without(accepted[at][2], candidate))
        accepted = rest
        if again.nothing.probability <= STANDS_OUT and again.best.fit is not None:
            searcher.levels = again.best.levels
            accepted.append((again, again.best, searcher.settled(again.best.fit)))
    return accepted


def separate_fit(searcher: Searcher, fit: Refit, accepted: Sequence[Accepted] = ()) -> SeparateFit:
    """What the runs of a day are compared by, from a fit with what was ``accepted``."""
    levels = searcher.levels
    shared = {hypothesis.name for hypothesis in OF_A_DAY}
    for _, verdict, _ in reversed(accepted):  # a second of a name goes before the first
        if verdict.name in shared and verdict.candidate is not None:
            fit = searcher.without(fit, verdict.candidate)
    own = SeparateFit(fit, searcher.scene(fit), searcher.account(fit), searcher.levels)
    searcher.levels = levels
    return own


def figures_as_it_is(recording: Recording, motion: Motion, model: Model) -> Figures:
    """The figures of ``model``, fitted, with nothing sought; by the reduced model.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    searcher = Searcher(setting_of(recording, motion, model), lambda _fraction, _detail: None)
    fit = searcher.first()
    folds = folds_of(searcher.setting.measurements, searcher.scene(fit).transitions)
    return figures_of(searcher, [searcher.of_the_track(fit)], folds)[0]
