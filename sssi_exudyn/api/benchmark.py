"""``benchmark``: the diagnosis on cases with known answers.

Each function is the one signature of its command: the command line makes its options from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sssi_exudyn.api.arguments import (
    OutFolder,
    PositiveNumber,
    ProgressWanted,
    RecordingFolders,
    Workers,
    read_positive,
)
from sssi_exudyn.core.choices import Concealed
from sssi_exudyn.core.command_line import Option
from sssi_exudyn.runtime.threads import cores_used

if TYPE_CHECKING:
    from sssi_exudyn.validation.benchmark.known_answers import Comparison
    from sssi_exudyn.validation.benchmark.scores import Scores
    from sssi_exudyn.validation.benchmark.semi_real import Answer


def benchmark(
    recordings: RecordingFolders,
    out: OutFolder,
    *,
    cases: int = 200,
    seed: int = 1,
    workers: Workers | None = None,
    full: int = 30,
    conceal: Concealed = "all",
    progress: ProgressWanted = False,
) -> Scores:
    """Test the diagnosis on sealed cases.

    Parameters
    ----------
    recordings : recordings to take the movements from
    out : folder of the result
    cases : how many there are
    seed : of the cases
    workers : processes (default: one a core)
    full : cases for the full model
    conceal : what the cases conceal
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for a recording without a GPS, and for one of less than 5 s.
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.commands.diagnosis import bases_of
    from sssi_exudyn.io.writing import folder_lock
    from sssi_exudyn.validation.benchmark.run import run_benchmark

    shown, folder = progress_of(progress), Path(out)
    with folder_lock(folder):
        bases = bases_of([Path(recording) for recording in recordings], shown)
        with shown.stage("benchmark") as stage:
            return run_benchmark(
                folder,
                bases,
                count=cases,
                seed=seed,
                full=full,
                workers=cores_used(workers),
                progress=stage.advance,
                conceal=conceal,
            )


def diagnose_known(
    folders: RecordingFolders, out: OutFolder, *, reduced: bool = False, progress: ProgressWanted = False
) -> list[Comparison]:
    """Test the diagnosis on recordings with a truth.json.

    Parameters
    ----------
    folders : folders of recordings with a truth.json
    out : folder of the result.  What it has already is not diagnosed again.
    reduced : by the reduced model alone, as sssi diagnose --reduced
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Returns what was found against what is hidden, a row a recording.  Raises InputError where two have the same name.
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.progress import progress_of

    known = [Path(folder) for folder in folders]
    return commands.diagnose_known(known, Path(out), reduced=reduced, progress=progress_of(progress))


def semi_real(
    recordings: RecordingFolders,
    out: OutFolder,
    *,
    sizes: Annotated[Sequence[float], Option(metavar="N", read=read_positive, count="*")] = (3.0, 10.0),
    seconds: PositiveNumber = 20.0,
    seed: int = 1,
    progress: ProgressWanted = False,
) -> list[Answer]:
    """Test the diagnosis on recordings in whose data faults are concealed.

    Parameters
    ----------
    recordings : recordings from the field
    out : folder of the result.  Cases that it has already are not done again.
    sizes : how many times the noise each fault moves the fixes; none for the runs untouched
    seconds : length of each run's middle, which is diagnosed by the reduced model
    seed : of the faults
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Returns what was found, a row a case.  Raises InputError for a recording that cannot be used, before anything is
    computed.
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.commands.diagnosis import stretches_of
    from sssi_exudyn.io.writing import folder_lock
    from sssi_exudyn.validation.benchmark.semi_real import run_semi_real

    shown, folder = progress_of(progress), Path(out)
    with folder_lock(folder):
        runs = stretches_of([Path(recording) for recording in recordings], folder, seconds, shown)
        with shown.stage("benchmark") as stage:
            return run_semi_real(folder, runs, sizes=sizes, seed=seed, progress=stage.advance)
