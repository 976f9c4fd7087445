"""The numbers that were chosen for the diagnosis, each with its reason and the data that it was chosen on.

``Thresholds`` is one frozen set of them, an argument of the search, so that a study varies one and leaves the code
alone (``benchmarks/diagnosis/thresholds.py``).  Usual sizes of a hypothesis stand in its own class, as its priors do.
Numerical guards, and counts of points that are drawn, stand where they are used.

"Before 8aabea3" and the like: the number is as old as that commit, and the data that it was chosen on are not recorded.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from sssi_exudyn.core.noise import NORMAL_90

_EARLY: Final = "benchmark seeds 2026, 4001, 4002, 5000 and the ten recordings of an independent world"
_NO_DATA: Final = "no data"
_REASON, _CHOSEN_ON = "reason", "chosen_on"


def chosen(value: Any, *, reason: str, on: str) -> Any:  # Any: a dataclass field stands where a number is annotated
    """Declare a chosen number with its ``reason`` and the data that it was chosen ``on``."""
    return field(default=value, metadata={_REASON: reason, _CHOSEN_ON: on})


@dataclass(frozen=True)
class Thresholds:
    """All chosen numbers of the diagnosis; lengths in m, times in s, forces in N, log evidence in nats."""

    # From evidence to probabilities
    sizes: tuple[float, ...] = chosen(
        (0.5, 1.0, 2.0),
        reason="an effect may be weaker or stronger than usual; each size counts a third",
        on="unknown: before 8aabea3",
    )
    nothing: float = chosen(0.5, reason="prior probability that nothing is missing", on=_NO_DATA)
    natural: float = chosen(
        0.2,
        reason="share of natural slopes with a roll, or a change of slope, that their waves do not foresee: these "
        "stand in groups and are no Gaussian process; of 20 blind runs with no roll hidden four had one of log "
        "evidence 2.8 to 11.3",
        on="seed 10401, after it was judged",
    )
    stands_out: float = chosen(
        0.2, reason="probability of nothing missing above which there is no finding", on="unknown: before 8aabea3"
    )
    stands_out_again: float = chosen(
        0.05,
        reason="the same once something was found: the first finding is no exact model, so a second has to be more "
        "certain",
        on="unknown: before 8aabea3",
    )
    temper: float = chosen(
        0.6,
        reason="share for which log evidence counts: no model is exact, and errors that none of them has make "
        "differences look more certain than they are",
        on=_EARLY,
    )
    most_findings: int = chosen(3, reason="each further finding takes another search", on=_NO_DATA)

    # Cells of time and place
    cell: float = chosen(
        0.4, reason="s; the finest division of a run: places are searched by half cells", on="unknown: before da34838"
    )
    most_cells: int = chosen(
        48, reason="cells of a run at most: responses to stretches grow with their square", on=_NO_DATA
    )
    cell_length: float = chosen(
        0.2, reason="m down the fall line; a cell takes some time to pass", on="unknown: before da34838"
    )
    faulty: float = chosen(
        3.0,
        reason="standard deviations that an instrument states, beyond which it is at fault",
        on="no data; tried on seeds 9901 and 9905",
    )

    # Screening by linear responses, and which hypotheses are refitted
    finalists: int = chosen(
        6, reason="hypotheses that are refitted: each takes some runs", on="unknown: before 8aabea3"
    )
    worthwhile: float = chosen(
        12.0,
        reason="log evidence by which a hypothesis is worse than the best where it is not refitted, and gain from "
        "which responses are no longer linear",
        on="unknown: before 8aabea3; for the laws of a day seeds 1 and 2",
    )
    half_explained: float = chosen(
        0.5,
        reason="share of the best gain from which a hypothesis is refitted, or tried at another time: far from the "
        "truth responses are not linear, and what explains half may explain all",
        on="case 3 of seed 16002, after it was judged; three pairs and three unlisted effects of 16001",
    )
    further_times: int = chosen(
        2, reason="further times at which a hypothesis is refitted", on="case 3 of seed 16002, after it was judged"
    )
    far_behind: float = chosen(
        36.0,
        reason="nats by which a refit at a further time promises less than the best so far has reached where it is "
        "given up: of five refits three ended level after a promise 25 behind, or behind after one of 38 and 74",
        on="train_patch",
    )
    apart: float = chosen(
        0.2,
        reason="share of their common time that two candidates of different times both act at most",
        on="case 3 of seed 16002, after it was judged",
    )
    stiff: float = chosen(
        0.1,
        reason="share of its usual waves that the snow has while a hypothesis about its shape is placed; free, it "
        "would take the shape up before that is where it belongs",
        on="unknown: before 15da492",
    )
    hopeless: float = chosen(
        -1.0,
        reason="log Bayes factor under the noise of nothing below which no other noise is tried",
        on="unknown: before 4debfd7",
    )
    hopeful: float = chosen(
        0.5, reason="log evidence by which a refitted hypothesis is below nothing at most", on="unknown: before 8aabea3"
    )

    # Rivals about their own estimates
    rival: float = chosen(
        0.03,
        reason="probability from which an explanation is a rival of the best one",
        on="hill_none, hill_patch, train_gust; after seed 8201",
    )
    rival_gain: float = chosen(
        0.1,
        reason="share of the best explanation's gain in log evidence within which another is its rival, too: estimates "
        "with two laws gained 82 and 91 beyond a gain of 102, so that one 7 behind was 3 before",
        on="hill_patch",
    )
    most_rivals: int = chosen(
        4,
        reason="rivals that are estimated again: each takes as long as the estimate before the search",
        on="hill_none, hill_patch, train_gust; after seed 8201",
    )

    # The force of any form
    force_sizes: tuple[float, ...] = chosen(
        (20.0, 60.0, 180.0), reason="N; of a missing force before the data speak", on="unknown: before d28440d"
    )
    force_memories: tuple[float, ...] = chosen(
        (0.3, 0.8, 2.0, 6.0),
        reason="s over which it keeps its direction; the longest is of what grows along a run",
        on="unknown: before d28440d",
    )
    force_repeats: int = chosen(
        2,
        reason="how often the force is found about its own fit: a third time moves its evidence by 0.2",
        on="cases 8, 11, 17, 20, 22 of seed 15001 and five of 15002, after they were judged; 14 of 9915 and 9916",
    )
    force_close: float = chosen(
        6.0,
        reason="log evidence between force and law within which posture and snow are estimated with the force: that "
        "moves it by 1 to 3, seldom by 6",
        on="cases 8, 11, 17, 20, 22 of seed 15001 and five of 15002, after they were judged; 14 of 9915 and 9916",
    )
    false_discoveries: float = chosen(0.05, reason="share of false ones among stretches that stand out", on=_NO_DATA)
    windows: tuple[int, ...] = chosen(
        (1, 3, 6), reason="cells of the windows in which a force may stand out", on="unknown: before 4194aff"
    )

    # What the form of a finding may be wrong by
    form: float = chosen(
        0.3,
        reason="standard deviation of an effect's force about that of the law taken for it: measured ramps of gusts "
        "and edges of patches differ by some tenths",
        on="no data; tried on seeds 9901 and 9905",
    )
    form_negligible: float = chosen(
        0.05, reason="share of the largest force below which a cell has no form error", on="unknown: before d0ed7fc"
    )

    # Worlds of the recording
    worlds: int = chosen(
        10_000, reason="simulated runs that a recording is compared with: some hundreds of each cause", on=_NO_DATA
    )
    world_unlisted: float = chosen(
        4.0,
        reason="prior weight of causes that are in no list, one cause of the list counting 1: there are many of them",
        on="linear worlds of the design's prototype",
    )
    world_pair: float = chosen(
        0.3,
        reason="prior weight of two causes of the list at once, likewise",
        on="benchmarks/diagnosis/worlds.py, seed 48001",
    )
    world_same: float = chosen(
        0.2,
        reason="share of its standard errors by which a cause that no law describes differs from a law at least: half "
        "of what the form of a law may be wrong by",
        on="train_patch and train_gust, after they were seen",
    )
    world_outside: float = chosen(
        0.01,
        reason="share of worlds that are farther from the middle of their kind, below which a recording is unlike "
        "all of them: one run in a hundred is so by chance",
        on=_NO_DATA,
    )
    named_outside: float = chosen(
        0.7,
        reason="share of names by the fits that are right of recordings unlike all worlds: 4 of 5, so 5 of 7 by "
        "Laplace's rule of succession",
        on="runs of telephones with concealed faults, seeds 51201 and 60007, after they were judged",
    )

    # The verdict and its words
    sure: float = chosen(0.8, reason="probability from which a name stands alone", on="unknown: before 8aabea3")
    worth_naming: float = chosen(
        0.02, reason="probability from which an alternative is named", on="unknown: before 8aabea3"
    )
    likely: float = chosen(
        0.6,
        reason="probability of nothing missing from which it is reported; below, the recording has not moved it from "
        "one half",
        on="unknown: before 15da492",
    )
    unexplained: float = chosen(
        0.5, reason="probability that no known cause is behind a finding: more probably than not", on=_NO_DATA
    )
    negligible: float = chosen(
        1e-3, reason="probability below which an explanation does not move a 90 % interval", on=_NO_DATA
    )
    miss_by_chance: float = chosen(
        1e-3, reason="probability that instruments as stated miss a right model by more than is allowed", on=_NO_DATA
    )
    worse_than_stated: float = chosen(
        2.0, reason="factor by which an instrument may be worse than it states", on="unknown: before 15da492"
    )
    phase_covered: float = chosen(
        0.25,
        reason="share of a turn's phase that a finding covers where the phase is named",
        on="unknown: before dd9ec11",
    )
    turn_covered: float = chosen(
        0.5, reason="share of a turn that a stretch covers where it stands for that turn: most of it", on=_NO_DATA
    )

    # The next measurement
    good_receiver: float = chosen(0.02, reason="m; a receiver with a fixed solution, by its makers", on=_NO_DATA)
    worse_receiver: float = chosen(
        1.5, reason="times that noise from which a good receiver is a measurement of its own", on=_NO_DATA
    )
    listed_measurements: int = chosen(3, reason="measurements that are listed: a reader does one of them", on=_NO_DATA)

    # Several runs of one day
    day_finalists: int = chosen(4, reason="laws that are fitted to all runs: each takes some minutes", on=_NO_DATA)
    day_held: float = chosen(
        1e-3,
        reason="share of its usual size to which a shared number is held while the runs' own are fitted",
        on=_NO_DATA,
    )
    day_turns: int = chosen(4, reason="times at most that shared and own numbers are fitted by turns", on=_NO_DATA)
    day_settled: float = chosen(
        0.1, reason="standard deviations by which shared numbers move when they are found", on=_NO_DATA
    )
    product_size: float = chosen(
        0.02,
        reason="usual change of mu_t by a product that is one: what laws of the list make of a standard deviation of "
        "speed, edge angle or load",
        on="day seeds 1 and 2",
    )
    most_products: int = chosen(
        3, reason="products in a law that is in no list: sums of more are too many", on=_NO_DATA
    )
    regression_rounds: int = chosen(
        3, reason="times at most that sums are compared about the best of them", on=_NO_DATA
    )
    law_offered: float = chosen(
        0.95,
        reason="probability, with all laws of the list and nothing, from which a law that is in no list is offered: "
        "its log evidence is then 11, 15 or 19 above the best of the list with one, two or three products; chance "
        "brings a sum that far in less than one day of 3000",
        on="day seeds 1 and 2",
    )
    near_path: float = chosen(
        10.0, reason="m from a run's path within which snow and terrain are taken to be the same", on=_NO_DATA
    )
    least_passed: float = chosen(
        3.0, reason="m of a run's path at a place, below which it has not passed it", on=_NO_DATA
    )
    same_time: float = chosen(
        0.3, reason="share of the time of two things together that both act, from which they may be one", on=_NO_DATA
    )

    @property
    def usual_force(self) -> tuple[float, float]:
        """Return size (N) and memory (s) of a missing force as it usually is: those in the middle."""
        sizes, memories = self.force_sizes, self.force_memories
        return sizes[(len(sizes) - 1) // 2], memories[(len(memories) - 1) // 2]

    @property
    def following_force(self) -> tuple[float, float]:
        """Return size (N) and memory (s) of a force that follows any other: the strongest, and the shortest."""
        return self.force_sizes[-1], self.force_memories[0]

    @property
    def spread(self) -> float:
        """Return by how much intervals are widened for errors that no model has: as much as these reduce evidence."""
        return float(self.temper**-0.5)

    @property
    def interval_90(self) -> float:
        """Standard deviations to either side that hold the true number in nine of ten cases."""
        return NORMAL_90 * self.spread


THRESHOLDS: Final = Thresholds()
"""Those that the program uses."""
