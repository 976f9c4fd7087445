"""What the search gives: the diagnosis as data, and the fits, rounds and runs that it was made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sssi_exudyn.fitting.evidence import LinearModel
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
from sssi_exudyn.validation.diagnosis.search.explanation import Refitted, Round
from sssi_exudyn.validation.diagnosis.state import State


@dataclass(frozen=True)
class Accepted:
    """A finding: the round it was found in, what was taken of it, the fit with it, and the run linearised there."""

    searched: Round
    explanation: Refitted
    fit: Refit
    linear: LinearModel

    @property
    def gain(self) -> float:
        """Log evidence that it gains next to nothing in its round."""
        return self.explanation.log_evidence - self.searched.nothing.log_evidence


@dataclass(frozen=True)
class Figures:
    """One model against the recording: mean horizontal errors (m), χ² per degree of freedom.

    residual_memory : correlation of neighbours in the whitened residual; 0 is noise
    """

    trajectory_error: float
    held_out_error: float
    chi2_per_dof: float
    residual_memory: float


@dataclass(frozen=True)
class SeparateFit:
    """A run with what it alone was found to have, and nothing that acts on all runs of a day alike: its fit, and what
    another fit of it takes.
    """

    problem: DiagnosisProblem
    state: State
    fit: Refit


@dataclass(frozen=True)
class SearchEnd:
    """Where a search ended: its fit with everything that was ``accepted``, and what another fit of the run takes.

    full : whether the full model judged its estimates
    """

    problem: DiagnosisProblem
    state: State
    fit: Refit
    accepted: tuple[Accepted, ...]
    full: bool


@dataclass(frozen=True)
class SearchResult:
    """The diagnosis, and what it was made from.

    fit : the model with everything that was found, as the search fitted it;  first : without anything added
    posterior : the same model with all that is uncertain estimated, posture and snow surface too, and judged by the
        full model; None where the reduced one was to do, or where most of the posture is assumed
    result : a run of the model by the full model, None where the reduced one was to do
    noise : of the instruments, under the final model
    rounds : all hypotheses with their probabilities, round by round
    figures : of the fit without anything added, and with each finding after the other
    separate_fit : gives what the runs of a day are compared by, which takes another fit
    end : what other runs of the day are asked about what was found
    """

    diagnosis: Diagnosis
    first: Refit
    fit: Refit
    posterior: Posterior | None
    result: SimulationResult | None
    noise: NoiseLevels
    rounds: tuple[Round, ...]
    figures: tuple[Figures, ...]
    separate_fit: Callable[[], SeparateFit]
    end: SearchEnd

    @property
    def model(self) -> Model:
        """The extended model."""
        return self.fit.model if self.posterior is None else self.posterior.model
