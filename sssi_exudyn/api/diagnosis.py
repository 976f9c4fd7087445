"""``diagnose``: what physics the model lacks.  The command line makes its options from the function's signature."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sssi_exudyn.api.arguments import (
    AnyPath,
    DiagnosedRecording,
    OutFolder,
    Plugins,
    ProgressWanted,
    Seconds,
    path_of,
    recording_of,
    stretch_of,
    use_plugins,
)
from sssi_exudyn.core.checked import checked
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.results.day import Day


@checked
@with_one_thread_for_products
def diagnose(
    recording: DiagnosedRecording,
    out: OutFolder | None = None,
    *,
    reduced: bool = False,
    seconds: Seconds | None = None,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> Result:
    """Find physics that the model lacks, or a faulty instrument.

    Parameters
    ----------
    recording : the recording, or several of one day.  Python takes one, also as a ``Recording``; several go to
        ``diagnose_day``.
    out : folder of the result.  It holds the extended model's run.  Without one, Python writes nothing; with one, an
        interrupted diagnosis goes on when it is called again.
    reduced : search by the reduced model alone: quicker, and stated in the result
    seconds : the stretch of the recording to use, in s of its clock, such as 3:12.5 (default: all of it)
    plugins : files of Python or installed packages whose hypotheses are weighed too; their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    The result's ``diagnosis`` has the findings with their probabilities, its ``model`` is the extended one.

    Examples
    --------
    >>> result = sssi_exudyn.diagnose("examples/beginner", "results/diagnosis")
    >>> print(result.diagnosis.verdict, result.diagnosis.sentence)
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import result_of
    from sssi_exudyn.commands.diagnosis import make_diagnosis

    use_plugins(plugins)
    source, stretch = recording_of(recording), stretch_of(seconds)
    made = make_diagnosis(source, path_of(out), reduced=reduced, seconds=stretch, progress=progress_of(progress))
    return result_of(made, path_of(out))


@checked
@with_one_thread_for_products
def diagnose_day(
    recordings: Sequence[AnyPath],
    out: AnyPath,
    *,
    reduced: bool = False,
    seconds: Seconds | None = None,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> Day:
    """Diagnose several runs of one day, each into a folder of its recording's name in ``out``, and compare them.

    The options are those of ``diagnose``; ``seconds`` are of each run's own clock.

    Examples
    --------
    >>> day = sssi_exudyn.diagnose_day(["monday_1", "monday_2"], "results/monday")
    >>> print(day.sentence)
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.progress import progress_of

    use_plugins(plugins)
    folders = [Path(recording) for recording in recordings]
    stretch = stretch_of(seconds)
    return commands.diagnose_day(folders, Path(out), reduced=reduced, seconds=stretch, progress=progress_of(progress))
