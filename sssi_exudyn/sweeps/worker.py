"""What a worker process is handed: light, so that Exudyn's build is chosen before anything imports it."""

from __future__ import annotations

import pickle
import signal
from pathlib import Path

from sssi_exudyn.runtime.exudyn_build import take_fast_build
from sssi_exudyn.runtime.workers import end_with_parent


def perform(folder: Path, packed: bytes) -> str:
    """``sweeps.run.performed`` with the pickled job and run, and the build of Exudyn that the command line takes."""
    take_fast_build()
    from sssi_exudyn.sweeps.run import performed

    return performed(folder, *pickle.loads(packed))


def prepare_worker() -> None:
    """Begin a worker of this machine: an interrupt is its parent's affair, and it does not outlive its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
