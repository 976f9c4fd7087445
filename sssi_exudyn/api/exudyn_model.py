"""``build``: the model in Exudyn, for those who change it there and run it on."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from sssi_exudyn.api.arguments import AnyPath
from sssi_exudyn.api.result import Result, result_of
from sssi_exudyn.commands.outcome import Outcome, write_outcome
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.text import one_line
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.full.open_model import OpenModel


@dataclass(repr=False)
class ExudynModel(OpenModel):
    """The model in Exudyn, at the start of the run or where its last ``run`` ended.

    ``mbs`` and ``system_container`` are Exudyn's own; ``nodes``, ``objects``, ``markers``, ``loads`` and ``sensors``
    hold the numbers of items by name, and ``settings`` Exudyn's simulation settings.

    Examples
    --------
    >>> model = sssi_exudyn.build("examples/beginner", stop=3.0)
    >>> model.mbs.GetObject(model.objects["left_ski_beam_0"])["physicsLength"]
    >>> result = model.run("results/solution.txt")
    >>> model.mbs.SolutionViewer()
    """

    recording: Recording = field(kw_only=True)

    @checked
    def run(self, solution: AnyPath | None = None, *, until: float | None = None) -> Result:
        """Simulate in Exudyn from where the model stands, with all that was added or changed.

        Parameters
        ----------
        solution : file for the coordinates every 0.02 s, which Exudyn's ``SolutionViewer`` finds then
        until : time to stop at, s on the recording's clock; the built end if left out.  A further ``run`` goes on.

        Returns the run so far.  The energy balance counts the model's own parts alone.  Raises InputError for a time
        that is past, and SimulationDiverged when the solver gives up.
        """
        made = self.integrate(None if solution is None else Path(solution), until)
        settings = Outcome({"command": "build"})
        return result_of(write_outcome(None, self.recording, self.motion, self.model, made, settings), None)

    def __repr__(self) -> str:
        name = one_line(self.recording.name)
        return f"<ExudynModel {name}: {len(self.nodes)} nodes, {len(self.objects)} objects, at {self.time:.2f} s>"
