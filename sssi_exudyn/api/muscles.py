"""``muscles``: the muscle forces of a result.  The command line makes its options from the function's signature."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sssi_exudyn.api import runs
from sssi_exudyn.api.arguments import AnyPath, ProgressWanted, ResultOrRecording, path_of, recording_of
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.choices import MuscleSet, Power
from sssi_exudyn.core.command_line import Option
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result


@checked
@with_one_thread_for_products
def muscles(
    run: ResultOrRecording,
    out: Annotated[AnyPath, Option(metavar="DIR")] | None = None,
    *,
    muscles: MuscleSet = "full",
    power: Power = 2,
    progress: ProgressWanted = False,
) -> Result:
    """Compute the muscle forces behind a run's joint moments.

    Parameters
    ----------
    run : a result, or a recording, which is run first.  It may be the folder of either.
    out : folder of the result (default: FOLDER itself on the command line).  Without one, Python writes nothing.
    muscles : all of the legs, 322 with the trunk's, or the paper's 284.  It is ``"full"`` or ``"paper"``.
    power : exponent of the activations.  Static optimisation makes their sum with that exponent least.
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for what is neither a result nor a recording, and for a result without a skeleton.

    Examples
    --------
    >>> result = sssi_exudyn.muscles("results/beginner")
    >>> result.series["muscle_soleus_r_force_N"].max()
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import Result, load_result, result_of
    from sssi_exudyn.commands.muscles_command import add_to_folder, add_to_run
    from sssi_exudyn.commands.outcome import Made
    from sssi_exudyn.commands.runs import lock_of
    from sssi_exudyn.muscle_forces.of_result import muscles_of
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.results.folder import SUMMARY

    shown, target = progress_of(progress), path_of(out)
    source = run if isinstance(run, Result) else recording_of(run)
    if isinstance(source, Result):
        whole, folder = source, None
    elif isinstance(source, Recording) or not (source / SUMMARY).is_file():
        whole, folder = runs.run(source, target, progress=shown), target
    else:
        whole, folder = load_result(source), source
    with lock_of(target), shown.stage("muscles") as stage:
        computed = muscles_of(whole.stored, folder or Path(whole.name), power, muscles)
        stage.advance(1.0, f"{len(computed.time)} samples")
        if folder is not None and target is not None:
            add_to_folder(folder, target, whole.stored, computed)
            return load_result(target)
        made = add_to_run(Made(whole.stored, whole.opensim), computed)
        if target is None:
            return result_of(made, None)
        return result_of(made, None).save(target)


def list_muscles(muscles: MuscleSet = "full") -> list[dict[str, str | float]]:
    """List every muscle of a set with its figures, not scaled to anyone."""
    from sssi_exudyn.bodies.muscles.muscles import muscles_table

    return muscles_table(muscles)
