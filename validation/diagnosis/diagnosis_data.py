"""A diagnosis as data: what ``diagnosis.json`` holds, and all that its section of a report is made from.

Field names are the file's keys; each quantity has its unit in its name.  Fields with a default were added to the format
later, so that files without them are still read.  ``diagnosis.schema.json`` next to this file is the JSON Schema of it.
"""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass, field
from typing import Final, Literal

Kind = Literal["physics", "sensor", "unexplained"]
Outcome = Literal["none", "explained", "ambiguous", "unexplained", "not_adequate"]
Vector = tuple[float, float, float]
NOTHING_MISSING: Final = "nothing"
"""The name of the explanation that nothing is missing."""


@dataclass(frozen=True)
class Number:
    """A parameter with its 90 % interval; ``meaning`` says what it is, "" where its name does."""

    value: float
    low: float
    high: float
    unit: str
    meaning: str = ""


@dataclass(frozen=True)
class Alternative:
    """Another explanation of the same finding; "nothing" for none."""

    name: str
    probability: float


@dataclass(frozen=True)
class Where:
    """When a finding acts (s, the recording's clock), on which metres of the path, on which side, in which phases, and
    in which turns (1, 2, … as in the tables of turns).
    """

    t0_s: float
    t1_s: float
    distance_m: tuple[float, float]
    side: Literal["left", "right", "both"]
    phase: tuple[str, ...]
    turns: tuple[int, ...] = ()


@dataclass(frozen=True)
class Change:
    """A figure before and after the finding is in the model."""

    before: float | None
    after: float | None


@dataclass(frozen=True)
class Placebos:
    """Errors on turns not fitted (m) with forces drawn at random in the finding's place: all, the least, the median."""

    least: float
    median: float
    each: tuple[float, ...] = ()


@dataclass(frozen=True)
class Evidence:
    """How much better the model meets the recording with the finding.

    trajectory_error_m, held_out_error_m : mean horizontal errors at all fixes, and at those of turns not fitted
    chi2_per_dof : of the horizontal track under the noise as it is; 1 is noise
    residual_memory : correlation of neighbours in the whitened residual; 0 is noise
    force_explained : share that the finding explains of the energy of the force that was missing (the integral of its
        square); of physics alone
    """

    trajectory_error_m: Change
    held_out_error_m: Change
    chi2_per_dof: Change
    placebo_held_out_error_m: Placebos | None = None
    residual_memory: Change | None = None
    force_explained: float | None = None

    @property
    def is_rejected_by_turns(self) -> bool:
        """Return whether turns that were not fitted are predicted worse with the finding than without it."""
        before, after = self.held_out_error_m.before, self.held_out_error_m.after
        return before is not None and after is not None and after > before


@dataclass(frozen=True)
class Finding:
    """One thing that was missing: the most probable name, what else it might be, and what it does.

    impulse_Ns : along and across the skis and normal to the snow; zero for a fault of an instrument
    caption : what was added, as a figure names it
    """

    kind: Kind
    name: str
    probability: float
    alternatives: tuple[Alternative, ...]
    where: Where | None
    parameters: dict[str, Number]
    impulse_Ns: Vector
    evidence: Evidence
    caption: str = ""


@dataclass(frozen=True)
class Friction:
    """Friction along and across the skis."""

    mu_t: float
    mu_n: float


@dataclass(frozen=True)
class FrictionChange:
    """Friction before anything was added, and after all findings."""

    before: Friction
    after: Friction


@dataclass(frozen=True)
class Noise:
    """Noise of the instruments under the final model: standard deviations and correlation times.

    difference_sigma_N : of the insoles' left total less the right one;  capture_sigma_deg : of a segment's orientation
    """

    gps_sigma_m: float
    gps_correlation_s: float
    height_sigma_m: float | None = None
    load_sigma_N: float | None = None
    capture_sigma_deg: float | None = None
    height_correlation_s: float | None = None
    difference_sigma_N: float | None = None


@dataclass(frozen=True)
class Weighed:
    """A hypothesis in one round of the search.

    log_evidence : None for one that cannot be
    refitted : whether it was fitted with its own term, and not by its linear response alone
    by_fits : its probability by the fits alone, where simulated runs have a say too
    """

    name: str
    probability: float
    log_evidence: float | None
    refitted: bool = False
    by_fits: float | None = None


@dataclass(frozen=True)
class Stretch:
    """A time in which the missing force stands out from what noise alone would show."""

    t0_s: float
    t1_s: float
    impulse_Ns: Vector


@dataclass(frozen=True)
class ForceByFoot:
    """The same force on each foot, were it the snow's: c vectors each, with their standard deviations.

    log_bayes_factor : of some force on the feet against none
    """

    left_N: tuple[Vector, ...]
    left_band_N: tuple[Vector, ...]
    right_N: tuple[Vector, ...]
    right_band_N: tuple[Vector, ...]
    log_bayes_factor: float


@dataclass(frozen=True)
class ForceOverTime:
    """The force that a model lacks, in c cells of time: along and across the skis and normal to the snow.

    edges_s : c + 1 instants;  force_N, band_N : c vectors, the force and its standard deviation
    stands_out : c times three, true where a direction stands out from what noise alone would show
    log_bayes_factor : of some force against none, its course integrated out
    by_foot : None without insoles
    """

    edges_s: tuple[float, ...]
    force_N: tuple[Vector, ...]
    band_N: tuple[Vector, ...]
    stands_out: tuple[tuple[bool, bool, bool], ...]
    log_bayes_factor: float | None = None
    by_foot: ForceByFoot | None = None

    def __post_init__(self) -> None:
        """Raise ValueError where the lengths differ."""
        cells = len(self.edges_s) - 1
        feet = self.by_foot
        lists: list[Sized] = [self.force_N, self.band_N, self.stands_out]
        if feet is not None:
            lists += [feet.left_N, feet.left_band_N, feet.right_N, feet.right_band_N]
        if any(len(values) != cells for values in lists):
            raise ValueError("the lists have other lengths than the cells of time")


@dataclass(frozen=True)
class LatentForce:
    """The force that was missing before, and what is still missing with all findings in the model."""

    before: ForceOverTime
    after: ForceOverTime


@dataclass(frozen=True)
class TrackDistance:
    """Horizontal distance between simulated antenna and GPS at each fix, before and after."""

    time_s: tuple[float, ...]
    before_m: tuple[float, ...]
    after_m: tuple[float, ...]

    def __post_init__(self) -> None:
        """Raise ValueError where the lengths differ."""
        if not len(self.time_s) == len(self.before_m) == len(self.after_m):
            raise ValueError("the lists have different lengths")


@dataclass(frozen=True)
class HeldOut:
    """A stretch of time (s) that was left out of a fit, and the mean distance (m) between its fixes and what the fit to
    all others predicts, before and after; ``turn`` is the number of the turn that it is, None where it is none.
    """

    t0_s: float
    t1_s: float
    turn: int | None
    before_m: float
    after_m: float


@dataclass(frozen=True)
class Way:
    """The skier's path over the slope, seen from above: down the fall line and to its left (m), at the edges of the
    missing force's cells and between.
    """

    time_s: tuple[float, ...]
    f_m: tuple[float, ...]
    l_m: tuple[float, ...]

    def __post_init__(self) -> None:
        """Raise ValueError where the lengths differ."""
        if not len(self.time_s) == len(self.f_m) == len(self.l_m):
            raise ValueError("the lists have different lengths")


@dataclass(frozen=True)
class Smallest:
    """The size of an effect that would have been noticed in half of such runs: the number of its that is meant, value,
    unit and meaning.
    """

    number: str
    value: float
    unit: str
    meaning: str = ""


@dataclass(frozen=True)
class Next:
    """A measurement that would distinguish two explanations, and how probably one of them would stand alone then."""

    measurement: str
    distinguishes: tuple[str, str]
    probability: float


@dataclass(frozen=True)
class Adequacy:
    """By how much (m, root mean square) the track is missed, and by how much the instruments allow it to be."""

    missed_m: float
    allowed_m: float

    @property
    def adequate(self) -> bool:
        """Return whether the model may be right."""
        return self.missed_m <= self.allowed_m


@dataclass(frozen=True)
class Chance:
    """How often a search finds as much in runs drawn with nothing hidden, all hypotheses compared by their linear
    responses.

    runs : drawn
    as_strong : share of runs, the recording among them, in which nothing missing is as improbable as in the recording
    nothing_probability : of nothing missing in the recording, by linear responses
    nothing_probability_5_percent : below which it is in one drawn run of twenty
    """

    runs: int
    as_strong: float
    nothing_probability: float
    nothing_probability_5_percent: float


@dataclass(frozen=True)
class SimilarRun:
    """The simulated run that looks most like the recording.

    name : what it had hidden, as in ``Likeness.probabilities``;  edges_s : c + 1 instants
    recorded_N, simulated_N : c forces along and across the skis and normal to the snow, which would do what the model
        lacks, of both runs
    """

    name: str
    edges_s: tuple[float, ...]
    recorded_N: tuple[Vector, ...]
    simulated_N: tuple[Vector, ...]


@dataclass(frozen=True)
class Likeness:
    """What runs of this recording had hidden that were simulated with known causes and look like it.

    runs : simulated;  sentence : the answer in words
    probabilities : by hypothesis, with "nothing", "not_in_the_list" for causes that no hypothesis describes, and
        "two_at_once"; the most probable first
    outside : share of the simulated runs that are farther from the middle of their kind than the recording
    alike : false where that share is so small that the recording looks like none of them; the probabilities then say
        nothing
    about : the finding that the runs vary, the least certain one, or "nothing"; what else was found is in all of them
    best_possible : the probability that the best possible method would give ``about`` on average, were it true
    similar : the simulated run that looks most like the recording
    """

    runs: int
    sentence: str
    probabilities: dict[str, float]
    outside: float
    alike: bool
    about: str = ""
    best_possible: float | None = None
    similar: SimilarRun | None = None


@dataclass(frozen=True)
class Version:
    """What diagnosed: the program's version, and what it held for how probable beforehand.

    sources : SHA-256 of all that the program is made of, the same for two copies of one commit; "" in older files
    seeds : of the random numbers that were drawn, by what was drawn
    """

    program: str
    priors: dict[str, float]
    sources: str = ""
    seeds: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """A diagnosis says what physics the model of a recorded run lacks, or which instrument is at fault.

    verdict : "none" where nothing is missing, "explained", or "ambiguous" where several names remain.  "unexplained"
        says that probably no known cause is behind what was found; "not_adequate" that the recording cannot tell.
    smallest_noticed : by hypothesis, from which size on it would have been noticed with all findings in the model
    next : what to measure, where names remain or the recording cannot tell, the most promising first
    friction_averaged : mu_t and mu_n over all explanations, each as probable as it was found to be
    weighed : every hypothesis by its probability, the most probable first, in each round of the search
    stands_out : when a force was missing before anything was added
    held_out : the stretches that were left out of a fit, each in turn
    paragraph : the diagnosis in a coach's words
    tier : "reduced" where no fit was confirmed by the full model
    chance : how often a search finds as much where nothing is hidden
    likeness : what simulated runs had hidden that look like the recording

    Examples
    --------
    >>> diagnosis = sssi_exudyn.diagnose("examples/beginner").diagnosis
    >>> diagnosis.verdict, diagnosis.sentence
    """

    format: Literal[1]
    recording: str
    verdict: Outcome
    sentence: str
    findings: tuple[Finding, ...]
    friction: FrictionChange
    noise: Noise
    weighed: tuple[tuple[Weighed, ...], ...] = ()
    stands_out: tuple[Stretch, ...] = ()
    latent_force: LatentForce | None = None
    track_distance: TrackDistance | None = None
    smallest_noticed: dict[str, Smallest] | None = None
    adequacy: Adequacy | None = None
    next: tuple[Next, ...] = ()
    way: Way | None = None
    friction_averaged: dict[str, Number] | None = None
    version: Version | None = None
    tier: Literal["full", "reduced"] = "full"
    held_out: tuple[HeldOut, ...] = ()
    paragraph: str = ""
    chance: Chance | None = None
    likeness: Likeness | None = None

    def __repr__(self) -> str:
        return f"<Diagnosis {self.recording}: {self.verdict}, {len(self.findings)} findings>"
