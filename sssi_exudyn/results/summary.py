"""The figures of a result, as ``summary.json`` holds them: each with its unit in its name, null where there is none.

The groups ``posture``, ``diagnosis`` and ``muscles`` are in the file once the command that makes them was run.  The
group ``surface`` is there where the snow is not plane, ``uncertainty`` where all uncertain quantities were estimated,
``technique`` where few sensors were fitted.  ``losses`` is in the results of this version and later ones.
Where edges cut the snow, ``carving`` is there and ``friction`` is null.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from sssi_exudyn.analysis.biomechanics import ResidualMoment, TurnFigures
from sssi_exudyn.analysis.boots import BootFigures
from sssi_exudyn.analysis.losses import LossFigures
from sssi_exudyn.analysis.turn_style import StyleFigures
from sssi_exudyn.core.choices import HeadingMode
from sssi_exudyn.io.typed import convert
from sssi_exudyn.io.writing import to_plain
from sssi_exudyn.terrain.profile import SurfaceFigures

FORMAT: Final = 1
_ON_REQUEST: Final = (
    "posture",
    "diagnosis",
    "muscles",
    "surface",
    "uncertainty",
    "carving",
    "boots",
    "losses",
    "technique",
)
"""Groups that only some results have."""


@dataclass(frozen=True)
class Estimate:
    """A number and its standard error, null where it was not fitted or where the fit's residuals contradict it."""

    value: float | None = None
    se: float | None = None


@dataclass(frozen=True)
class Friction:
    """Friction coefficients along (``mu_t``) and across (``mu_n``) the ski.

    ``mu_n`` is the skier's largest lateral load ratio, not the snow's: what turns need is in ``LossFigures``.
    """

    mu_t: Estimate = Estimate()
    mu_n: Estimate = Estimate()


@dataclass(frozen=True)
class Trajectory:
    """Horizontal distance of the simulated antenna to the GPS fixes, and the length of its path."""

    mean_error_m: float | None = None
    percent_of_length: float | None = None
    length_m: float | None = None
    rms_error_m: float | None = None
    max_error_m: float | None = None
    end_error_m: float | None = None


@dataclass(frozen=True)
class PressureRatio:
    """The left foot's share of the load compared with the insoles: of the force square to the sole, and of the snow's
    normal force as in the paper.
    """

    correlation: float | None = None
    rmsd: float | None = None
    snow_correlation: float | None = None
    snow_rmsd: float | None = None


@dataclass(frozen=True)
class ResidualNoise:
    """Noise of the track's residual and the time over which it is correlated."""

    sigma_m: float | None = None
    correlation_s: float | None = None


MISSED: Final = 3.0
"""Times an instrument's usual noise beyond which the model is wrong, not the instrument: three standard deviations of
the known range of noise are a factor of 1.5 to 2.
"""


@dataclass(frozen=True)
class Noise:
    """Noise of a kind of measurement, in its SI unit, and the time over which it is correlated.

    ``times_usual`` is its ratio to the usual noise of such instruments, where that is known.
    """

    sigma: float
    correlation_s: float
    times_usual: float | None = None


@dataclass(frozen=True)
class Fit:
    """End of the fit, and every fitted parameter; ``correlation`` (k, k) in the order of ``parameters``."""

    converged: bool | None = None
    evaluations: int | None = None
    wall_s: float | None = None
    method: str | None = None
    reason: str | None = None
    evaluations_reduced: int | None = None
    parameters: Mapping[str, Estimate] | None = None
    correlation: tuple[tuple[float | None, ...], ...] | None = None
    residual_noise: ResidualNoise | None = None


@dataclass(frozen=True)
class Interval:
    """An interval that holds the true number with 90 % probability."""

    low: float
    high: float


@dataclass(frozen=True)
class Correction:
    """A correction, in standard deviations of its prior."""

    what: str
    sigmas: float


@dataclass(frozen=True)
class UncertaintyFigures:
    """Uncertainty of a fit's results.

    interval_90 : of friction, and where edges cut of the snow's hardness (N/m³) and strength (Pa); empty where withheld
    shares : of the variance of each of them, by its source; they add up to one
    posture_rms_deg : corrections of the captured posture by joint coordinate, root mean square over time
    largest : the corrections that are largest in standard deviations of their priors
    noise : of the measurements, by kind
    fits_priors : whether no correction is beyond three standard deviations
    log_evidence : log probability of all measurements, by which two results of one recording may be compared
    widened : factor on the intervals from noise alone, as loads or speed are missed by more than noise
    withheld : why there are no intervals; null where there are
    """

    interval_90: Mapping[str, Interval]
    shares: Mapping[str, Mapping[str, float]]
    posture_rms_deg: Mapping[str, float]
    largest: tuple[Correction, ...]
    noise: Mapping[str, Noise]
    fits_priors: bool
    log_evidence: float | None = None
    widened: float | None = None
    withheld: str | None = None

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return what the fit's own figures say against its results, in sentences."""
        doubts = [] if self.withheld is None else [self.withheld]
        if self.missed is not None and self.withheld is None:
            kind, times = self.missed
            wide = self.widened or 1.0
            widened = f"; intervals are {wide:.1f} times as wide for it" if wide > 1.0 else ""
            doubts.append(
                f"residual of the {kind}: {times:.1f} times the usual noise{widened}; check time_offset_s and unit"
            )
        if not self.fits_priors:
            worst = self.largest[0]
            doubts.append(
                f"{worst.what} had to be corrected by {abs(worst.sigmas):.1f} standard deviations:"
                " its stated value, a clock or the model is wrong"
            )
        return tuple(doubts)

    @property
    def missed(self) -> tuple[str, float] | None:
        """Kind of measurement with the largest noise relative to its instruments' usual one, and that ratio.

        None where no ratio exceeds ``MISSED``; above it, the model leaves out more than noise.
        """
        ratios = [(name, noise.times_usual) for name, noise in self.noise.items() if noise.times_usual is not None]
        worst = max(ratios, key=lambda pair: pair[1], default=None)
        return worst if worst is not None and worst[1] > MISSED else None


@dataclass(frozen=True)
class Solver:
    """Work of the solver."""

    simulated_s: float | None = None
    wall_s: float | None = None
    steps: int | None = None
    backend: str | None = None
    newton_iterations: int | None = None
    jacobians: int | None = None


@dataclass(frozen=True)
class Energy:
    """Largest gap of the energy balance in percent of the turnover, and what each term did from start to end.

    work_J : J, the work of each term; of ``kinetic`` and ``elastic`` the energy gained.  The works' sum is what these
        two gained, but for the gap
    """

    closure_percent: float | None = None
    work_J: Mapping[str, float | None] | None = None


@dataclass(frozen=True)
class Platform:
    """Computer of the run."""

    system: str | None = None
    machine: str | None = None


@dataclass(frozen=True)
class Provenance:
    """Hashes of the input files, versions of the programs, and the settings.

    sources : SHA-256 of all that the program is made of, the same for two copies of one commit; "" in older files
    """

    inputs: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    sources: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    seed: int | None = None
    platform: Platform | None = None


@dataclass(frozen=True)
class SegmentRoundTrip:
    """One segment of the skeleton compared with the captured one.

    The orientation is compared after and before the filter, and so is the place of its joint.
    """

    segment: str
    joint: str
    filtered_rms_deg: float | None = None
    filtered_max_deg: float | None = None
    raw_rms_deg: float | None = None
    raw_max_deg: float | None = None
    place_rms_mm: float | None = None
    place_max_mm: float | None = None


@dataclass(frozen=True)
class Capture:
    """Difference between the posture of the skeleton's joint angles and the captured one."""

    round_trip: tuple[SegmentRoundTrip, ...] = ()


@dataclass(frozen=True)
class PostureSigma:
    """One standard deviation of the feet's angles, and of the height of one foot relative to the other."""

    edge_deg: float
    pitch_deg: float
    heading_deg: float
    height_m: float


@dataclass(frozen=True)
class FrictionShares:
    """Sources of the standard error of μ_t."""

    track: float | None
    posture: float | None
    slope: float | None
    steering: float | None


@dataclass(frozen=True)
class Prediction:
    """The run's second half, predicted from the first half.

    ``constant_speed_rms_mps`` is the error of a prediction by the first half's mean speed.
    """

    mu_t: float | None
    speed_rms_mps: float | None
    constant_speed_rms_mps: float | None
    split_s: float | None = None


@dataclass(frozen=True)
class Posture:
    """A recording of few sensors: what was measured and what was assumed, and the uncertainty from it.

    effective_friction : of the run as the balance of energy along its path has it
    effective_friction_90 : its 90 % interval
    effective_friction_of_run : that of the simulated run, which confirms it where its path is the skied one
    speed_return_1_s : rate at which the speed returns to the skier's own, as the skier brakes
    """

    measured: tuple[str, ...]
    assumed: tuple[str, ...]
    sigma: PostureSigma
    gps_lag_s: Estimate | None
    unbalanced_rms_m: float | None
    mu_t_se: FrictionShares
    effective_friction: Estimate
    second_half: Prediction
    effective_friction_90: Interval | None = None
    effective_friction_of_run: float | None = None
    speed_return_1_s: Estimate | None = None

    def without_errors(self) -> Posture:
        """Return the figures without standard errors of friction, as a misfit denies them."""
        unknown = FrictionShares(None, None, None, None)
        effective = replace(self.effective_friction, se=None)
        return replace(self, mu_t_se=unknown, effective_friction=effective, effective_friction_90=None)


@dataclass(frozen=True)
class DiagnosisResult:
    """Result of a diagnosis, in one word and one sentence; all of it is in ``diagnosis.json``."""

    verdict: str
    sentence: str


@dataclass(frozen=True)
class Reserve:
    """Moment of a joint that the muscles could not make."""

    peak_Nm: float
    percent_of_peak_moment: float
    verdict: str


@dataclass(frozen=True)
class LackingJoint:
    """A joint whose muscles were too weak: the share of the run, and the instant when most was missing."""

    coordinate: str
    share_of_samples: float
    worst_Nm: float
    wanted_then_Nm: float
    at_s: float


@dataclass(frozen=True)
class MuscleFigures:
    """The muscles' static optimisation: its size, the moments the muscles could not make, and the joints' largest
    loads.

    muscle_set : "paper" or "full"
    draws : number of draws from the uncertainty of the estimate, from which the bands are computed
    contact_peak_band_bodyweights : half width of the band of each joint's load at its peak; empty without draws
    """

    count: int
    power: int
    samples: int
    wall_s: float
    strong_enough_share: float
    reserve: Mapping[str, Reserve]
    lacking: tuple[LackingJoint, ...]
    contact_peak_bodyweights: Mapping[str, float]
    muscle_set: str = "paper"
    draws: int = 0
    contact_peak_band_bodyweights: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CarvingFigures:
    """A run on snow that edges cut.

    tier : the model that ran, ``full`` or ``reduced``
    mu, hardness_N_m3, strength_Pa : the snow's numbers
    equivalent_mu_t : friction along the edges against the load, both summed over the run, as μ_t of the paper's law
    equivalent_mu_n : the walls' force across the edges against the load, as μ_n
    side_reserve_mean, side_reserve_least : share of the wall's strength that the more loaded ski does not use: over the
        run, and its 5 % quantile
    ski_yaw_rms_deg, ski_roll_rms_deg, ski_heave_rms_m, ski_pitch_rms_deg : of the skis against the captured feet
    heading : control of the skier's heading: ``replay``, ``track`` or ``free``
    heading_rms_deg : of the skier against the captured heading
    yaw_residual_rms_Nm, roll_residual_rms_Nm : residual moments of posture and snow about gravity and about the
        direction of travel, at any point: large where the posture does not fit the path
    """

    tier: str
    mu: Estimate
    hardness_N_m3: Estimate
    strength_Pa: Estimate
    equivalent_mu_t: float | None = None
    equivalent_mu_n: float | None = None
    side_reserve_mean: float | None = None
    side_reserve_least: float | None = None
    ski_yaw_rms_deg: float | None = None
    ski_roll_rms_deg: float | None = None
    ski_heave_rms_m: float | None = None
    ski_pitch_rms_deg: float | None = None
    heading: HeadingMode = "replay"
    heading_rms_deg: float | None = None
    yaw_residual_rms_Nm: float | None = None
    roll_residual_rms_Nm: float | None = None


@dataclass(frozen=True, repr=False)
class Summary:
    """The summary holds all figures of a result.

    recording : the recording's name
    diverged : why the simulation stopped before the end; null where it did not
    notices : remarks on the recording for the reader, such as quantities that had to be estimated

    Examples
    --------
    >>> summary = sssi_exudyn.load("results/beginner").summary
    >>> summary.friction.mu_t.value, summary.trajectory.mean_error_m
    """

    format: int = FORMAT
    recording: str | None = None
    friction: Friction = Friction()
    trajectory: Trajectory = Trajectory()
    pressure_ratio: PressureRatio = PressureRatio()
    fit: Fit = Fit()
    solver: Solver = Solver()
    energy: Energy = Energy()
    turns: TurnFigures = field(default_factory=TurnFigures)
    residual_moment: ResidualMoment = field(default_factory=ResidualMoment)
    provenance: Provenance = Provenance()
    capture: Capture = Capture()
    diverged: str | None = None
    posture: Posture | None = None
    diagnosis: DiagnosisResult | None = None
    notices: tuple[str, ...] = ()
    muscles: MuscleFigures | None = None
    surface: SurfaceFigures | None = None
    uncertainty: UncertaintyFigures | None = None
    carving: CarvingFigures | None = None
    boots: BootFigures | None = None
    losses: LossFigures | None = None
    technique: StyleFigures | None = None

    def __repr__(self) -> str:
        mu_t, mu_n = self.friction.mu_t.value, self.friction.mu_n.value
        return f"<Summary {self.recording}: mu_t {mu_t}, mu_n {mu_n}, track error {self.trajectory.mean_error_m} m>"


def summary_from_dict(table: Mapping[str, Any]) -> Summary:
    """Read the summary in a mapping of groups, some of which may be absent: those have no figures.

    Raises ValueError where a figure is of another type.
    """
    return convert({name: group for name, group in table.items() if group is not None}, Summary)


def summary_to_dict(summary: Summary) -> dict[str, Any]:
    """Return the summary as ``summary.json`` holds it; values that are not finite are null."""
    groups = {entry.name: getattr(summary, entry.name) for entry in dataclasses.fields(summary)}
    table: dict[str, Any] = to_plain(
        {name: group for name, group in groups.items() if group is not None or name not in _ON_REQUEST}
    )
    return table
