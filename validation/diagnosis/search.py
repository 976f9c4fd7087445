"""The search for what is missing: one hypothesis after the other tried on a fitted run, and how probable each is.

A round: fit what the model has; ask every hypothesis for its candidates, as linear responses about that fit; weigh them
under the noise as it is; refit the best with the real term or fault in the model; weigh those again about their own
fit.  The winner becomes part of the model, and the next round begins, until nothing stands out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.fit import problem_of
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache, fingerprint
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.reduced import Prepared, prepare, simulate_reduced
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.simulation.sensitivities import sensitivities, simulate_each
from sssi_exudyn.validation.capture_error import antenna_responses, capture_errors, response
from sssi_exudyn.validation.diagnosis.evidence import (
    Account,
    Freedom,
    NoiseLevels,
    Whitener,
    best_levels,
    log_evidence,
    log_factors,
    usual_levels,
    whitened,
    whitener,
)
from sssi_exudyn.validation.diagnosis.hypotheses import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypothesis import Candidate, Probe, Scene
from sssi_exudyn.validation.diagnosis.refit import Parameter, Refit, arrays_of, refit, refit_of
from sssi_exudyn.validation.measurements import Measurements, averages, measurements_of

Made = Mapping[str, NDArray[np.generic]]
"""What a cache keeps."""
Progress = Callable[[float | None, str], None]

FREE: Final = {
    "friction.mu_t": Prior(0.1, 0.1),
    "friction.mu_n": Prior(0.6, 0.4),
}
"""Friction beforehand: published values of gliding and of skidding, widely."""
_PLACE: Final = 3.0
_SPEED: Final = 2.0
"""m and m/s: the start is told by the track alone, which is counted where it is fitted, not beforehand too."""
CUFF: Final = Prior(0.06, 0.03)
"""Share of the load that a boot's cuff takes in an ordinary recording."""
_HEIGHT: Final = 0.3
"""m; the first fix, from which heights count, is no better known than that."""
_CLOCKS: Final = 0.005
"""s to which clocks of different instruments agree at best, and half a step of the reduced model."""
SIZES: Final = (0.5, 1.0, 2.0)
"""An effect may be weaker or stronger than usual; each counts a third."""
NOTHING: Final = 0.5
"""Probability beforehand that nothing is missing."""
SHAPELESS: Final = 150.0
"""Log evidence that an effect brings from which its exact form, which nobody knows, matters more than the noise: there
what sets two names apart counts for half.
"""
TEMPER: Final = 0.6
"""Log evidence is worth this share of what it says: the world is none of our models, and errors that none of them
knows make differences look more certain than they are.  Calibrated by the blind benchmark.
"""
INTERVAL_90: Final = 1.6449 / TEMPER**0.5
"""Standard deviations to either side that hold the true number in nine of ten cases: what errors that no model knows
take from the evidence they add to the intervals.
"""
_SETTLED: Final = 0.2
"""Standard deviations of the noise by which the full model's surplus may still change."""
STEP: Final = 0.01
"""s; steps of the reduced model.  They move a run's path by a centimetre against short ones, evenly for all
explanations; what the full model predicts beyond is added to every prediction.
"""
_FINALISTS: Final = 6
_WORTHWHILE: Final = 12.0
"""A hypothesis whose linear evidence is worse than the best by more than this is not refitted."""
_HOPELESS: Final = -1.0
"""Log Bayes factor under the noise of nothing below which other noise is not tried either."""
_HOPEFUL: Final = 0.5
"""Nor one that is less probable than nothing by as much."""


@dataclass(frozen=True)
class Setting:
    """A recording prepared for diagnosis."""

    motion: Motion
    model: Model
    parameters: tuple[Parameter, ...]
    prepared: Prepared
    measurements: Measurements


@dataclass(frozen=True)
class Verdict:
    """One explanation in a round.

    name, kind : of the hypothesis; "" and "none" where nothing is added
    log_evidence : with the noise's own prior, place and size integrated
    probability : among all explanations of the round
    candidate : where and what, its usual amplitudes times the size that suits best; None for nothing
    size : one of ``SIZES``
    fit : None where it was not worth a refit
    levels : of the noise under it
    """

    name: str
    kind: str
    log_evidence: float
    probability: float
    candidate: Candidate | None
    fit: Refit | None
    levels: NoiseLevels
    size: float = 1.0


@dataclass(frozen=True)
class Round:
    """All explanations, the most probable first, and the account that they were weighed on."""

    verdicts: tuple[Verdict, ...]
    account: Account
    base: Refit
    scene: Scene
    responses: dict[str, Array]

    @property
    def nothing(self) -> Verdict:
        """That nothing more is missing."""
        return next(v for v in self.verdicts if not v.name)

    @property
    def best(self) -> Verdict:
        """The most probable one that adds something."""
        return next(v for v in self.verdicts if v.name)


def setting_of(recording: Recording, motion: Motion, model: Model) -> Setting:
    """Prepare a recording.  Raises ValueError when it has no GPS."""
    problem = problem_of(recording, motion, model, "joint")
    model = problem.model
    priors = dict(FREE)
    for name in problem.names:
        if name.startswith(("start.velocity", "start.f", "start.l")):
            priors[name] = Prior(model.value(name), _SPEED if "velocity" in name else _PLACE)
        elif name.startswith("start."):
            priors[name] = problem.priors[name]
    parameters = tuple(Parameter((name,), priors[name]) for name in problem.names)
    return Setting(
        motion,
        model,
        parameters,
        prepare(model, motion, step=STEP),
        measurements_of(recording, model, motion.start, motion.stop),
    )


def known_beforehand(measurements: Measurements, sole: Array, later: Array) -> tuple[Freedom, Array]:
    """What varies with the instruments' mounting: the height's origin, the cuff's share and how well the clocks agree;
    and the mean effect (N,) of the cuff.

    sole : (m, 2) N, the soles' forces;  later : (N,) what changes when the GPS' clock is a second late
    """
    size = len(measurements.measured)
    height, cuff = np.zeros(size), np.zeros(size)
    height[measurements.blocks["height"]] = 1.0
    cuff[measurements.blocks["load"]] = -sole.sum(axis=1)
    cuff[measurements.blocks["difference"]] = -(sole[:, 0] - sole[:, 1])
    columns = np.column_stack([height, cuff, later])
    return Freedom(columns, np.array([_HEIGHT, CUFF.sigma, _CLOCKS])), CUFF.mean * cuff


@dataclass
class Searcher:
    """The search on one recording; holds what does not change from round to round."""

    setting: Setting
    say: Progress
    cache: Cache | None = None

    def __post_init__(self) -> None:
        setting = self.setting
        self.whole = fingerprint(model_to_dict(setting.model), setting.motion, setting.measurements.measured)
        self.levels = usual_levels(setting.measurements)
        self._mounted(setting.model)
        self.beyond = np.zeros_like(self.cuff)
        self.capture = np.zeros((len(self.cuff), 0))
        self.unexplained: float | None = None  # log evidence of the model without anything added

    def _mounted(self, model: Model) -> None:
        """What the instruments' mounting does, from the soles' forces in a run of that model."""
        run = simulate_reduced(model, self.setting.prepared)
        sole = averages(run.time, run.sole_force, self.setting.measurements.windows)
        later = sensitivities(
            model, self.setting.prepared, ["start.clock_offset"], self.setting.measurements.predicted
        )[1]
        self.mounting, self.cuff = known_beforehand(self.setting.measurements, sole, later[:, 0])

    @property
    def offset(self) -> Array:
        """(N,) what is added to the reduced model's prediction: the boots' cuffs, and what the full model has more."""
        return np.asarray(self.cuff + self.beyond)

    def first(self) -> Refit:
        """The fit of the model without anything added; what the capture's errors do is found about it."""
        setting = self.setting
        base = self.fitted(setting.model, setting.parameters, self.levels)
        self._mounted(base.model)
        base = self.fitted(base.model, base.parameters, self.levels)
        self.capture = self._captured(base)
        return self.settled(base)

    def settled(self, fit: Refit) -> Refit:
        """The same model refitted under the noise that suits it best."""
        self.levels, _ = best_levels(self.account(fit), self.levels)
        return self.fitted(fit.model, fit.parameters, self.levels)

    def of_the_track(self, fit: Refit) -> tuple[Refit, Whitener]:
        """The fit that meets the measurements best, as an ordinary fit does: the capture is taken as it is, and what it
        gets wrong counts as noise.  The noise's covariance is that of what such a fit leaves.
        """
        kept, self.capture = self.capture, np.zeros((len(self.cuff), 0))
        found = self.fitted(fit.model, fit.parameters, usual_levels(self.setting.measurements))
        levels = best_levels(self.account(found), self.levels)[0]
        covariance = self.covariance(levels)
        self.capture = kept
        return found, covariance

    def confirmed(self, fit: Refit) -> tuple[Refit, SimulationResult]:
        """The fit on the full model, and its run there.

        What the full model predicts beyond the reduced one changes little with the parameters: it is added to the
        reduced prediction, which is then fitted again.
        """
        for _ in range(2):
            beyond = self._predicted_in_full(fit.model) - (fit.predicted - self.offset)
            moved = float(np.max(np.abs(whitened(self.account(fit), self.levels, (beyond - self.beyond)[:, None]))))
            self.beyond = beyond
            fit = self.fitted(fit.model, fit.parameters, self.levels)
            if moved < _SETTLED:
                break
        return fit, simulate(fit.model, self.setting.motion)

    def _made(self, key: str, make: Callable[[], Made]) -> Made:
        """What the cache has under ``key``, or else what ``make`` gives."""
        return self.cache.get_or_make(key, make) if self.cache else make()

    def _predicted_in_full(self, model: Model) -> Array:
        """(N,) by the full model."""

        def run() -> dict[str, Array]:
            return {"predicted": self.setting.measurements.predicted(model, simulate(model, self.setting.motion))}

        key = fingerprint("full model", self.whole, model_to_dict(model))
        return np.asarray(self._made(key, run)["predicted"], dtype=np.float64)

    def without(self, fit: Refit, candidate: Candidate) -> Refit:
        """The fit refitted without what the candidate brought."""
        names = {name for group in candidate.amplitudes for name in group} | set(candidate.places)
        owners = {name.partition(".")[0] for name in names}
        model = fit.model
        if owners == {"start"}:
            model = model.with_values({name: self.setting.model.value(name) for name in names})
        else:
            model = model.without(owners)
        kept = tuple(p for p in fit.parameters if not names & set(p.names))
        known = tuple(p for p in self.setting.parameters if names & set(p.names))
        return self.settled(self.fitted(model, (*kept, *known), self.levels))

    def covariance(self, levels: NoiseLevels) -> Whitener:
        """Of all that is noise to the fit's parameters."""
        empty = self._account(np.zeros_like(self.cuff), Freedom(np.zeros((len(self.cuff), 0)), np.zeros(0)))
        return whitener(empty, levels, self.mounting.columns * self.mounting.scales)

    def fitted(self, model: Model, parameters: tuple[Parameter, ...], levels: NoiseLevels) -> Refit:
        """Refit under that noise."""
        setting = self.setting

        def run() -> Refit:
            return refit(
                model, parameters, setting.prepared, setting.measurements, self.covariance(levels), self.offset
            )

        if self.cache is None:
            return run()
        # NumPy's arrays and numbers alone are kept; the model follows from them
        key = fingerprint(
            "refit", self.whole, model_to_dict(model), parameters, levels, self.offset, self.capture, self.mounting
        )
        kept = self.cache.get_or_make(key, lambda: arrays_of(run()))
        return refit_of(kept, model, parameters)

    def account(self, fit: Refit) -> Account:
        """Measurements less prediction about a fit, as if every parameter still stood at what was known beforehand."""
        residual = self.setting.measurements.measured - fit.predicted + fit.sensitivity @ fit.pulls
        return self._account(residual, self.mounting.with_more(fit.sensitivity, fit.scales))

    def scene(self, base: Refit) -> Scene:
        """The fitted model and its run, as hypotheses see it."""
        setting = self.setting
        run = simulate_reduced(base.model, setting.prepared)
        return Scene(base.model, setting.prepared, run, setting.measurements, base.predicted - self.offset)

    def round(self, base: Refit) -> Round:
        """Weigh every hypothesis on the fitted model ``base``."""
        scene = self.scene(base)
        account = self.account(base)
        none, evidence = best_levels(account, self.levels)
        if self.unexplained is None:
            self.unexplained = evidence
        verdicts = [Verdict("", "none", evidence, 0.0, None, base, none)]
        responses = self._responses(scene)
        for hypothesis in HYPOTHESES:
            candidates = hypothesis.candidates(scene, responses[hypothesis.name])
            if candidates:
                verdicts.append(self._weighed(account, hypothesis.name, hypothesis.kind, candidates, evidence))
        explained = max(0.0, evidence - self.unexplained)
        ranked = _ranked(self._refitted(base, verdicts), explained)
        return Round(ranked, account, base, scene, responses)

    def _account(self, residual: Array, free: Freedom) -> Account:
        return Account(self.setting.measurements, residual, free, self.capture)

    def _captured(self, base: Refit) -> Array:
        setting = self.setting
        key = fingerprint("capture", self.whole, base.values)

        def run() -> dict[str, Array]:
            errors = capture_errors(setting.motion, setting.prepared)
            before = base.predicted - self.offset
            with ThreadPoolExecutor() as pool:
                columns = list(
                    pool.map(lambda e: response(base.model, setting.prepared, setting.measurements, e, before), errors)
                )
            torso = antenna_responses(setting.motion, base.model, setting.measurements)
            return {"columns": np.column_stack([*columns, torso])}

        kept = self._made(key, run)
        self.say(None, f"{kept['columns'].shape[1]} ways in which the capture may be wrong")
        return np.asarray(kept["columns"])

    def _responses(self, scene: Scene) -> dict[str, Array]:
        """(N, probes) of every hypothesis, a unit of amplitude."""
        found: dict[str, Array] = {}
        for i, hypothesis in enumerate(HYPOTHESES):
            self.say(i / len(HYPOTHESES), f"trying {hypothesis.name}")
            probes = hypothesis.probes(scene)
            if not probes:
                found[hypothesis.name] = np.zeros((len(scene.base), 0))
                continue
            key = fingerprint("probes", self.whole, hypothesis.name, [model_to_dict(p.model) for p in probes])
            found[hypothesis.name] = np.asarray(self._made(key, partial(_columns, scene, probes))["columns"])
        return found

    def _weighed(self, account: Account, name: str, kind: str, candidates: list[Candidate], nothing: float) -> Verdict:
        """A hypothesis by its candidates' linear responses: the best of them, all others counted as places sought."""
        frees = [c.free for c in candidates]
        by_size = np.stack(
            [log_factors(account, self.levels, [Freedom(f.columns, s * f.scales) for f in frees]) for s in SIZES]
        )
        factors = np.logaddexp.reduce(by_size, axis=0) - np.log(len(SIZES))
        best = int(np.argmax(factors))
        sought = float(np.logaddexp.reduce(factors) - np.log(len(factors)) - factors[best])
        size = int(np.argmax(by_size[:, best]))
        spread = float(factors[best] - by_size[size, best])
        chosen = scaled(candidates[best], SIZES[size])
        levels, evidence = self.levels, nothing + float(by_size[size, best])
        if by_size[size, best] > _HOPELESS:
            levels, evidence = best_levels(account, self.levels, chosen.free)
        return Verdict(name, kind, evidence + sought + spread, sought, chosen, None, levels, SIZES[size])

    def _refitted(self, base: Refit, verdicts: list[Verdict]) -> list[Verdict]:
        """The most probable refitted with the real term; what was sought is kept in ``probability`` until then."""
        ranked = sorted(verdicts[1:], key=lambda v: -v.log_evidence)
        nothing = verdicts[0].log_evidence
        gain = max(ranked[0].log_evidence - nothing, 0.0)
        # far from the truth responses are not linear: whoever explains half of it may explain it best
        least = max(nothing - _HOPEFUL, nothing + gain - max(_WORTHWHILE, 0.5 * gain))
        finalists = [v for v in ranked[:_FINALISTS] if v.log_evidence > least]
        if gain > _WORTHWHILE:
            finalists += [v for v in ranked if BY_NAME[v.name].moves_all and v not in finalists]
        found = [verdicts[0]]
        for i, verdict in enumerate(ranked):
            if verdict not in finalists:
                found.append(verdict)
                continue
            self.say(i / len(finalists), f"refitting with {verdict.name}")
            found.append(self._refit_of(base, verdict))
        return found

    def _refit_of(self, base: Refit, verdict: Verdict) -> Verdict:
        candidate = verdict.candidate
        assert candidate is not None
        starts = [candidate.model]
        if BY_NAME[verdict.name].moves_all:
            starts += [candidate.model.with_values(values) for values in beside(candidate)]
        try:
            fits = [self._with(base, candidate, start, verdict.levels) for start in starts]
            fit = min(fits, key=lambda each: each.objective)
            # how strong it is shows only now that it stands where it acts
            by_size = self._by_size(base, verdict, fit)
            size = SIZES[int(np.argmax(by_size))]
            if size != verdict.size:
                candidate = scaled(candidate, size / verdict.size)
                fit = self._with(base, candidate, fit.model, verdict.levels)
                verdict = replace(verdict, candidate=candidate, size=size)
                by_size = self._by_size(base, verdict, fit)
        except SimulationDiverged:
            return verdict
        spread = float(np.logaddexp.reduce(by_size) - np.log(len(SIZES)) - by_size[SIZES.index(size)])
        levels, evidence = best_levels(self.account(self._standing(base, candidate, fit)), verdict.levels)
        if not BY_NAME[verdict.name].possible(fit.model):
            evidence = -np.inf
        return replace(verdict, log_evidence=evidence + spread + verdict.probability, fit=fit, levels=levels)

    def _with(self, base: Refit, candidate: Candidate, start: Model, levels: NoiseLevels) -> Refit:
        """``base`` refitted with the candidate, from the values of ``start`` on."""
        parameters, places = extended(base, candidate)
        return self.fitted(start, (*parameters, *places), levels)

    def _standing(self, base: Refit, candidate: Candidate, fit: Refit) -> Refit:
        """The fit with the candidate where it has been found: places count as sought by the candidates, their freedom
        is not counted again.
        """
        parameters, _ = extended(base, candidate)
        count = len(parameters)
        return replace(fit, parameters=parameters, values=fit.values[:count], sensitivity=fit.sensitivity[:, :count])

    def _by_size(self, base: Refit, verdict: Verdict, fit: Refit) -> Array:
        """(sizes,) log evidence of the fit, were it usually of each size."""
        candidate = verdict.candidate
        assert candidate is not None
        every = [self._standing(base, scaled(candidate, size / verdict.size), fit) for size in SIZES]
        return np.array([log_evidence(self.account(each), verdict.levels) for each in every])


def scaled(candidate: Candidate, factor: float) -> Candidate:
    """The candidate, its usual amplitudes that much larger."""
    return replace(candidate, free=Freedom(candidate.free.columns, factor * candidate.free.scales))


def responses_of(scene: Scene, probes: list[Probe]) -> Array:
    """(N, probes) what each of them changes, a unit of amplitude; nothing where it cannot be simulated."""

    def seen(several: list[Probe]) -> list[Array]:
        try:
            return simulate_each([p.model for p in several], scene.prepared, scene.measurements.predicted)
        except SimulationDiverged:
            if len(several) == 1:
                return [scene.base]
            return [each for probe in several for each in seen([probe])]

    return np.stack([(each - scene.base) / p.size for each, p in zip(seen(probes), probes, strict=True)], axis=1)


def _columns(scene: Scene, probes: list[Probe]) -> Made:
    return {"columns": responses_of(scene, probes)}


def beside(candidate: Candidate) -> list[dict[str, float]]:
    """The candidate's amplitudes by their names, half their usual size to either side of where it stands."""
    return [
        {
            name: candidate.model.value(name) + side * float(scale)
            for group, scale in zip(candidate.amplitudes, candidate.free.scales, strict=True)
            for name in group
        }
        for side in (-0.5, 0.5)
    ]


def extended(base: Refit, candidate: Candidate) -> tuple[tuple[Parameter, ...], tuple[Parameter, ...]]:
    """Parameters of a fit with the candidate: those of ``base`` with the amplitudes, and the places."""
    names = {name for group in candidate.amplitudes for name in group}
    kept = tuple(p for p in base.parameters if not names & set(p.names))
    known = {p.names[0]: p.prior.mean for p in base.parameters}
    amplitudes = tuple(
        Parameter(group, Prior(known.get(group[0], candidate.model.value(group[0])), float(scale)))
        for group, scale in zip(candidate.amplitudes, candidate.free.scales, strict=True)
    )
    places = tuple(
        Parameter((name,), Prior(candidate.model.value(name), spread)) for name, spread in candidate.places.items()
    )
    return (*kept, *amplitudes), places


def probabilities(names: Sequence[str], log_evidence: Array, explained: float = 0.0) -> Array:
    """(…,) of explanations by their names, "" for nothing, from their log evidence and how probable each is beforehand.

    What parts two of them counts less than it says (``TEMPER``), and less still the more there is to explain
    (``SHAPELESS``).  What was ``explained`` (log evidence) by what was found before makes nothing more probable: what a
    strong effect leaves is partly its own form, which nobody knows.
    """
    whole = sum(BY_NAME[name].weight for name in names if name)
    shares = [(1.0 - NOTHING) * BY_NAME[name].weight / whole if name else NOTHING for name in names]
    nothing = list(names).index("")
    behind = TEMPER * (np.max(log_evidence) - log_evidence)
    gain = float(np.max(log_evidence) - log_evidence[nothing])
    shapeless = np.full(len(behind), 1.0 + gain / SHAPELESS)
    shapeless[nothing] += explained / SHAPELESS
    logs = np.log(shares) - behind / shapeless
    odds = np.exp(logs - logs.max())
    return np.asarray(odds / odds.sum())


def _ranked(verdicts: list[Verdict], explained: float) -> tuple[Verdict, ...]:
    odds = probabilities([v.name for v in verdicts], np.array([v.log_evidence for v in verdicts]), explained)
    found = [replace(v, probability=float(p)) for v, p in zip(verdicts, odds, strict=True)]
    return tuple(sorted(found, key=lambda v: -v.probability))
