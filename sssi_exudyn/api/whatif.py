"""``whatif``: a recorded run with something changed.  The command line makes its options from the signature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

from sssi_exudyn.api.arguments import (
    OutFolder,
    Plugins,
    ProgressWanted,
    RecordingFolder,
    path_of,
    use_plugins,
)
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.command_line import Option
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.what_if.answer import WhatIf


@checked
@with_one_thread_for_products
def whatif(
    run: RecordingFolder,
    out: OutFolder | None = None,
    *,
    changes: Annotated[Sequence[str], Option("--set", metavar="NAME=VALUE")] = (),
    ski: str | None = None,
    keep: Keep = "path",
    reduced: bool = False,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> WhatIf:
    """Ask what a run would have been on other snow, another slope or another ski.

    Parameters
    ----------
    run : folder of a result of sssi fit or run, or of a recording, which is fitted first
    out : folder of the answer.  Without one, Python writes nothing.
    changes : numbers to change, such as friction.mu_t=0.12, skier.mass=90, slope.inclination_deg=19, gates.distance=0.9
    ski : another ski, of the catalogue or a .toml file
    keep : what the skier keeps.  It is ``"movement"``, ``"path"``, ``"rhythm"``, ``"speed"``, or ``"line"``: a path as
        fast as his limits allow.
    reduced : leave out the full model that confirms the answer
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for bad input, and SimulationDiverged when the asked model cannot be simulated.

    Examples
    --------
    >>> answer = sssi_exudyn.whatif("results/beginner", changes=["friction.mu_t=0.12"])
    >>> answer.seconds_lost
    """
    from pathlib import Path

    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.commands.what_if import ask, read_changes

    use_plugins(plugins)
    asked = read_changes(changes)
    return ask(Path(run), path_of(out), asked, ski, keep, reduced=reduced, progress=progress_of(progress))
