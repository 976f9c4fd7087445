"""The noise of every instrument, declared once: how large it is, how long it remembers, how well both are known.

Every noise is exponentially correlated (``core.noise``).  Its ``size`` is a share of what the recording states of the
instrument, or of the load; ``memory`` is its correlation time.  What a run shows of both is sought by
``evidence.best_levels``: beforehand their logarithms are normal about the declared values with ``size_spread`` and
``memory_spread``, and they stay within the declared bounds, three spreads to either side;
a residual moment may have 6.5, as a posture or snow that is not the model's leaves far more than is usual.

How the values were chosen, and on which recordings: ``docs/notebook/uncertainty.md``, "The noise of instruments".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Final, Protocol, cast

import numpy as np

from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.core.quantity import quantities, quantity
from sssi_exudyn.recording.instruments.gps import VERTICAL

_OUTLASTED: Final = 5.0
"""Memories of the moment's noise for which the model itself is wrong alike, a second in all: masses are elsewhere and
skis press elsewhere for most of a turn.  So many moments count as one.  Believed one by one they would outweigh the
track, and move mu_t by 0.004."""


class InstrumentNoise(Protocol):
    """The four numbers that are declared of an instrument's noise."""

    @property
    def size(self) -> float: ...
    @property
    def memory(self) -> float: ...
    @property
    def size_spread(self) -> float: ...
    @property
    def memory_spread(self) -> float: ...


@dataclass(frozen=True)
class FixNoise:
    """A receiver's error of place, each horizontal component."""

    size: float = quantity(
        1.1, "1", low=0.38, high=3.2, source="measured: docs/notebook/uncertainty.md, with the memory",
        meaning="standard deviation over that which the receiver states",
    )  # fmt: skip
    memory: float = quantity(
        2.5, "s", low=0.87, high=7.2, source="measured: docs/notebook/uncertainty.md", meaning="correlation time"
    )  # fmt: skip
    size_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0, source="chosen: within a factor of 1.4 in two of three recordings",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0,
        source="chosen: known less well, slow errors of fixes are taken for errors of the posture",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class ConsumerFixNoise(FixNoise):
    """The same of a telephone or a watch: it states more than its error from one fix to the next, and that error stays
    for tens of seconds.
    """

    size: float = quantity(
        0.35, "1", low=0.078, high=1.57, source="measured: docs/notebook/uncertainty.md, with the memory",
        meaning="standard deviation over that which the receiver states",
    )  # fmt: skip
    memory: float = quantity(
        20.0, "s", low=1.8, high=220.0, source="measured: docs/notebook/uncertainty.md", meaning="correlation time"
    )  # fmt: skip
    size_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="chosen: telephones differ in what they call an error",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.8, "1", low=0.0, high=1.0, source="chosen: a run of a minute shows it little",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class NullForce:
    """A force of any course at the centre of mass that every explanation of a consumer receiver's run has, that nothing
    is missing included: postures are then assumed or roughly known, and no run is without such a force.
    """

    size: float = quantity(
        55.0, "N", low=0.0, high=200.0, source="measured: docs/notebook/uncertainty.md",
        meaning="standard deviation of each component; of a run as much larger as its noise levels say",
    )  # fmt: skip
    memory: float = quantity(2.0, "s", low=0.1, high=20.0, source="chosen: a turn", meaning="correlation time")


@dataclass(frozen=True)
class HeightNoise:
    """A receiver's error of height."""

    size: float = quantity(
        1.4 / VERTICAL, "1", low=0.24, high=3.6, source="measured: docs/notebook/uncertainty.md",
        meaning="standard deviation over that which the receiver states of heights",
    )  # fmt: skip
    memory: float = quantity(
        1.5, "s", low=0.33, high=6.8, source="measured: docs/notebook/uncertainty.md", meaning="correlation time"
    )  # fmt: skip
    size_spread: float = quantity(
        0.45, "1", low=0.0, high=1.0, source="chosen: receivers state heights less well than places",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="chosen: less is known of it than of a place's",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class SpeedNoise:
    """A receiver's error of speed over ground, each component; it is stated by no receiver."""

    size: float = quantity(
        0.10, "m/s", low=0.035, high=0.29, source="Doppler speeds: Zhang et al., J. Navig. 59 (2006) 293, 0.03 to 0.2",
        meaning="standard deviation",
    )  # fmt: skip
    memory: float = quantity(
        1.0, "s", low=0.35, high=2.9, source="chosen: receivers smooth over a second", meaning="correlation time"
    )
    size_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0, source="chosen: as of a place",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0, source="chosen: as of a place",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class LoadNoise:
    """Both insoles' total, averaged over a tenth of a second."""

    size: float = quantity(
        0.03, "1", low=0.0066, high=0.135, source="chosen: gain and zero apart, what soles and model leave over",
        meaning="standard deviation as a share of the run's mean total load",
    )  # fmt: skip
    memory: float = quantity(
        0.05, "s", low=0.011, high=0.225, source="chosen: half of an average's interval", meaning="correlation time"
    )
    size_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="chosen: soles differ by more than receivers",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="chosen: as of the size",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class LoadDifferenceNoise:
    """The left sole's load less the right one's, averaged over a tenth of a second."""

    size: float = quantity(
        0.05, "1", low=0.011, high=0.225, source="chosen: where a foot stands moves load from one sole to the other",
        meaning="standard deviation as a share of the run's mean total load",
    )  # fmt: skip
    memory: float = quantity(
        0.3, "s", low=0.066, high=1.35, source="chosen: a transition of edges", meaning="correlation time"
    )
    size_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="chosen: soles differ by more than receivers",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="chosen: as of the size",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class MomentNoise:
    """What is left over of the moment about the pelvis; how well a skier balances is never better than stated."""

    size: float = quantity(
        float(np.sqrt(_OUTLASTED)), "1", low=float(np.sqrt(_OUTLASTED)), high=22.0,
        source="chosen: so many moments count as one", meaning="standard deviation over residual_moment_Nm",
    )  # fmt: skip
    memory: float = quantity(
        0.2, "s", low=0.2, high=0.2, source="captures are filtered at 6 Hz", meaning="correlation time"
    )
    size_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0, source="chosen: as of a place",
        meaning="standard deviation of the size's logarithm beforehand",
    )  # fmt: skip
    memory_spread: float = quantity(
        0.0, "1", low=0.0, high=1.0, source="chosen: given",
        meaning="standard deviation of the memory's logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class ErrorScales:
    """By how many times errors of the posture, waves of the snow and the force that every explanation of a consumer
    receiver's run has are larger than is known of them beforehand.
    """

    posture: float = quantity(
        1.0, "1", low=0.35, high=2.9, source="[uncertainty]", meaning="errors of the posture over stated ones"
    )
    posture_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0, source="chosen: as of a place",
        meaning="standard deviation of its logarithm beforehand",
    )  # fmt: skip
    surface: float = quantity(
        1.0, "1", low=0.35, high=2.9, source="heights (docs/theory/snow-surface.md)",
        meaning="waves of the snow over what heights and the prior of slopes say",
    )  # fmt: skip
    surface_spread: float = quantity(
        0.35, "1", low=0.0, high=1.0, source="chosen: heights have shown most of how rough a slope is",
        meaning="standard deviation of its logarithm beforehand",
    )  # fmt: skip
    force: float = quantity(
        1.0, "1", low=0.22, high=4.5, source="NullForce", meaning="the force that every explanation has over its usual"
    )  # fmt: skip
    force_spread: float = quantity(
        0.5, "1", low=0.0, high=1.0, source="measured: docs/notebook/uncertainty.md",
        meaning="standard deviation of its logarithm beforehand",
    )  # fmt: skip


@dataclass(frozen=True)
class DeclaredNoise:
    """The noise of all instruments, by the names that ``NoiseLevels`` has for them."""

    gps: FixNoise = field(default_factory=FixNoise)
    height: HeightNoise = field(default_factory=HeightNoise)
    speed: SpeedNoise = field(default_factory=SpeedNoise)
    load: LoadNoise = field(default_factory=LoadNoise)
    difference: LoadDifferenceNoise = field(default_factory=LoadDifferenceNoise)
    moment: MomentNoise = field(default_factory=MomentNoise)


NOISE: Final = DeclaredNoise()
CONSUMER_FIXES: Final = ConsumerFixNoise()
NULL_FORCE: Final = NullForce()
CONSUMER: Final = 0.5
"""m; standard deviation that a receiver states of its fixes from which it is a telephone's or a watch's.  Receivers
with carrier phases state some centimetres, and 0.25 m while they have lost their fixed solution; telephones metres."""
SCALES: Final = ErrorScales()
BLOCKS_OF: Final[Mapping[str, tuple[str, ...]]] = {
    "gps": ("x", "y"),
    "height": ("height",),
    "speed": ("speed_x", "speed_y"),
    "load": ("load",),
    "difference": ("difference",),
    "moment": ("moment_f", "moment_l", "moment_n"),
}
"""The blocks of a run's measurements that have the noise of each instrument."""
_INSTRUMENT_OF: Final = {block: instrument for instrument, blocks in BLOCKS_OF.items() for block in blocks}
HEIGHT_ORIGIN: Final = 100.0
"""m; standard deviation of where heights count from, which is the first fix: wider than any receiver's error, so that
heights alone decide, and a proper density, so that evidences with heights may be compared."""


@dataclass(frozen=True)
class NoiseLevels:
    """Noise of every instrument, standard deviations in its unit and correlation times (s), and by how many times
    errors of the posture, waves of the snow surface and the force of every explanation are larger than usual ones.
    """

    gps: ExponentialNoise
    height: ExponentialNoise
    speed: ExponentialNoise
    load: ExponentialNoise
    difference: ExponentialNoise
    moment: ExponentialNoise
    posture: float = SCALES.posture
    surface: float = SCALES.surface
    force: float = SCALES.force

    def of(self, block: str) -> ExponentialNoise:
        """Return the noise of a block of the measurements."""
        return cast(ExponentialNoise, getattr(self, _INSTRUMENT_OF[block]))

    @property
    def numbers(self) -> dict[str, float]:
        """All numbers by name, such as ``gps.sigma``, ``load.correlation_time`` and ``posture``."""
        named: dict[str, float] = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, ExponentialNoise):
                named |= {f"{entry.name}.sigma": value.sigma, f"{entry.name}.correlation_time": value.correlation_time}
            elif isinstance(value, float):
                named[entry.name] = value
        return named

    def with_numbers(self, numbers: Mapping[str, float]) -> NoiseLevels:
        """Return the levels with other values of some numbers, by name."""
        return NoiseLevels.of_numbers({**self.numbers, **numbers})

    @staticmethod
    def of_numbers(numbers: Mapping[str, float]) -> NoiseLevels:
        """Return the levels of all ``numbers`` by name."""

        def noise(instrument: str) -> ExponentialNoise:
            return ExponentialNoise(numbers[f"{instrument}.sigma"], numbers[f"{instrument}.correlation_time"])

        return NoiseLevels(
            gps=noise("gps"),
            height=noise("height"),
            speed=noise("speed"),
            load=noise("load"),
            difference=noise("difference"),
            moment=noise("moment"),
            posture=numbers["posture"],
            surface=numbers["surface"],
            force=numbers["force"],
        )

    def remembering(self, instrument: str, memory: float) -> NoiseLevels:
        """Return the levels with another correlation time (s) of an instrument, σ²/T kept: what its noise changes by
        from one reading to the next, which a run shows best.
        """
        noise: ExponentialNoise = getattr(self, instrument)
        sigma = noise.sigma * float(np.sqrt(memory / noise.correlation_time))
        return self.with_numbers({f"{instrument}.sigma": sigma, f"{instrument}.correlation_time": memory})


@dataclass(frozen=True)
class UsualLevels(NoiseLevels):
    """The levels that a run's instruments usually show.

    receiver : what is declared of its fixes
    """

    receiver: FixNoise = NOISE.gps

    @property
    def null_force(self) -> NullForce | None:
        """The force that every explanation of the run has; None where a receiver is so good that it would hide what is
        looked for.
        """
        return NULL_FORCE if isinstance(self.receiver, ConsumerFixNoise) else None

    def declared(self, instrument: str) -> InstrumentNoise:
        """Return what is declared of an instrument's noise."""
        return self.receiver if instrument == "gps" else cast(InstrumentNoise, getattr(NOISE, instrument))


def usual_levels(fix: float, height: float, load: float, moment: float) -> UsualLevels:
    """Return the levels that instruments usually show.

    Parameters
    ----------
    fix, height : m, standard deviations that the receiver states of a place and of a height
    load : N, mean of both soles' total
    moment : N m, about the pelvis, that is left over of a balanced skier
    """

    def noise(declared: InstrumentNoise, unit: float) -> ExponentialNoise:
        return ExponentialNoise(declared.size * unit, declared.memory)

    receiver = CONSUMER_FIXES if fix >= CONSUMER else NOISE.gps
    return UsualLevels(
        gps=noise(receiver, fix),
        height=noise(NOISE.height, height),
        speed=noise(NOISE.speed, 1.0),
        load=noise(NOISE.load, load),
        difference=noise(NOISE.difference, load),
        moment=noise(NOISE.moment, moment),
        receiver=receiver,
    )


@dataclass(frozen=True)
class LevelPrior:
    """What is known of one number of the levels beforehand: its logarithm is normal about that of ``usual``, with
    standard deviation ``spread``; it is between ``low`` and ``high``.  A spread of 0 holds it.
    """

    usual: float
    spread: float
    low: float
    high: float

    def log_density(self, value: float) -> float:
        """Return the log density but for a constant, 0 at the usual value."""
        return 0.0 if self.spread == 0.0 else -0.5 * (np.log(value / self.usual) / self.spread) ** 2


def level_priors(usual: UsualLevels) -> dict[str, LevelPrior]:
    """Return the prior of every number of the levels by its name, about the ``usual`` ones of a run."""
    priors: dict[str, LevelPrior] = {}
    for instrument in BLOCKS_OF:
        noise, declared = getattr(usual, instrument), usual.declared(instrument)
        about = quantities(declared)
        for key, name in (("size", "sigma"), ("memory", "correlation_time")):
            value = getattr(noise, name)
            low, high = (value * (bound / about[key].default) for bound in (about[key].low, about[key].high))
            priors[f"{instrument}.{name}"] = LevelPrior(value, getattr(declared, f"{key}_spread"), low, high)
    about = quantities(SCALES)
    for key in ("posture", "surface", "force"):
        spread = getattr(SCALES, f"{key}_spread")
        priors[key] = LevelPrior(about[key].default, spread, about[key].low, about[key].high)
    return priors


def log_prior(usual: UsualLevels, levels: NoiseLevels) -> float:
    """Return the log prior density of levels, but for a constant, about the ``usual`` ones of a run."""
    numbers = levels.numbers
    return float(sum(prior.log_density(numbers[name]) for name, prior in level_priors(usual).items()))
