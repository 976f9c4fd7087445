"""Start of a worker process; it imports little, since Exudyn's build is chosen before anything imports it."""

from __future__ import annotations

import signal
from pathlib import Path

from sssi_exudyn.io.typed import decode
from sssi_exudyn.runtime.exudyn_build import take_fast_build
from sssi_exudyn.runtime.process_memory import prepare_memory
from sssi_exudyn.runtime.workers import end_with_parent


def perform(folder: Path, task: bytes) -> str:
    """Call ``sweeps.run.perform_run`` with a job and a run in JSON, with the command line's build of Exudyn.

    Only texts and numbers can come from JSON.  Raises ValueError where they are not those of a job and a run.
    """
    take_fast_build()
    from sssi_exudyn.sweeps.plan import Job, SweepRun
    from sssi_exudyn.sweeps.run import perform_run

    return perform_run(folder, *decode(task, tuple[Job, SweepRun]))


def prepare_worker() -> None:
    """Set up a worker of this machine: interrupts are left to its parent, and it ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    prepare_memory()
    end_with_parent()
