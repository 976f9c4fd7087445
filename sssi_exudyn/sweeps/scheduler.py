"""Hand the runs out and see each to its end, whatever becomes of the workers."""

from __future__ import annotations

import pickle
import time as clock
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.sweeps.plan import Job, Run
from sssi_exudyn.sweeps.pools import Crew, Pool, local_pool
from sssi_exudyn.sweeps.records import gather, write_record
from sssi_exudyn.sweeps.run import BUSY, crashed
from sssi_exudyn.sweeps.worker import perform

_AHEAD: Final = 4
"""Runs handed out for each worker: enough that none waits, few enough that a sweep of any size fits in memory."""
_GATHER_AT: Final = 1000
"""Small files before they are put together."""
_TRIES: Final = 2
"""Deaths of a process that had one run alone, until the run is blamed: one may be an accident."""
_PAUSE: Final = 0.5
"""s between looks at runs that another process is at."""

Told = Callable[[Run, str], None]


def do_all(folder: Path, job: Job, runs: Iterable[Run], pool: Pool, workers: int, told: Told) -> None:
    """Do the runs; each ends with a record in ``folder``, and ``told`` hears its status.

    Where a process pool breaks with the death of a worker, the runs that it had are done one by one in a process of
    their own, so that the one to blame is found; a Dask cluster replaces its workers itself, and gives up on a run
    that several have died with.

    Raises SssiError when a scheduler goes away, InputError when the folder can no longer be written.
    """
    waiting = deque(runs)
    while waiting:
        with pool(workers) as crew:
            suspects = _hand_out(folder, job, waiting, crew, told)
        _one_by_one(folder, job, suspects, told)


def _hand_out(folder: Path, job: Job, waiting: deque[Run], crew: Crew, told: Told) -> list[Run]:
    """Do what is waiting; the runs that a pool had when it broke."""
    flying: dict[Future[str], Run] = {}
    small: set[str] = set()
    while waiting or flying:
        broken: list[Run] = []
        while waiting and len(flying) < _AHEAD * crew.size():
            run = waiting.popleft()
            try:
                flying[_submitted(crew.executor, folder, job, run)] = run
            except BrokenExecutor:
                waiting.appendleft(run)
                if not flying:
                    return []
                break
        ended, _ = wait(flying, timeout=1.0, return_when=FIRST_COMPLETED)
        for future in ended:
            run = flying.pop(future)
            status = _status(folder, future, run)
            if status is None:
                broken.append(run)
            elif status == BUSY:
                clock.sleep(_PAUSE)
                waiting.append(run)
            else:
                told(run, status)
                small.add(run.key)
        if broken:
            return [*broken, *flying.values()]
        if len(small) >= _GATHER_AT:
            gather(folder, small)
            small.clear()
    return []


def _status(folder: Path, future: Future[str], run: Run) -> str | None:
    """How the run ended; None where its pool broke."""
    try:
        return future.result()
    except BrokenExecutor:
        return None
    except CancelledError:
        raise SssiError("the scheduler went away; what is done is kept, 'sssi sweep resume' goes on") from None
    except Exception as error:
        if type(error).__name__ != "KilledWorker":  # Dask's, which need not be installed
            raise
        return _blamed(folder, run)


def _one_by_one(folder: Path, job: Job, runs: Iterable[Run], told: Told) -> None:
    """Do runs in a process that has one at a time, and blame one with which it dies more than once."""
    waiting = deque(runs)
    deaths = 0
    while waiting:
        with local_pool(1) as crew:
            try:
                while waiting:
                    run = waiting[0]
                    while (status := _submitted(crew.executor, folder, job, run).result()) == BUSY:
                        clock.sleep(_PAUSE)
                    told(run, status)
                    waiting.popleft()
                    deaths = 0
                continue
            except BrokenExecutor:
                deaths += 1
        if deaths == _TRIES:
            told(run, _blamed(folder, run))
            waiting.popleft()
            deaths = 0


def _blamed(folder: Path, run: Run) -> str:
    record = crashed(run)
    write_record(folder, record)
    return str(record["status"])


def _submitted(executor: Executor, folder: Path, job: Job, run: Run) -> Future[str]:
    return executor.submit(perform, folder, pickle.dumps((job, run)))
