"""Give the runs of a sweep or a season to workers and wait for each to end, whatever happens to the workers."""

from __future__ import annotations

import time as clock
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.io.typed import encode
from sssi_exudyn.runtime.progress import Stage, duration
from sssi_exudyn.sweeps.plan import SweepRun
from sssi_exudyn.sweeps.records import DONE, gather, write_record
from sssi_exudyn.sweeps.run import BUSY, crash_record
from sssi_exudyn.sweeps.workers.pools import Crew, Pool, local_pool

_AHEAD: Final = 4
"""Runs submitted for each worker: enough that none waits, few enough that a sweep of any size fits in memory."""
_GATHER_AT: Final = 1000
"""Number of small files at which they are gathered."""
_TRIES: Final = 2
"""Deaths of a process that had only this run, after which it is recorded as crashed: one may be an accident."""
_PAUSE: Final = 0.5
"""s between tries of a run that another process is doing."""

Report = Callable[[SweepRun, str], None]
"""Function that is called with every finished run and its status."""


@dataclass(frozen=True)
class Work:
    """What workers do with each run.

    folder : where each run ends with a record
    job : common data of all runs, which goes to the workers as JSON
    perform : function of the folder and of ``encode((job, run))`` that does a run and returns its status; a worker
        process imports its module
    again : how the command that continues is called
    """

    folder: Path
    job: Any
    perform: Callable[[Path, bytes], str]
    again: str


@dataclass
class Countdown:
    """Reporter of the runs' progress: done, failed, rate, time left."""

    stage: Stage
    count: int
    ended: Counter[str] = field(default_factory=Counter)
    begin: float = field(default_factory=clock.monotonic)

    def __call__(self, _run: SweepRun, status: str) -> None:
        self.ended[status] += 1
        ended = self.ended.total()
        rate = ended / max(clock.monotonic() - self.begin, 1e-9)
        left = (self.count - ended) / rate
        failed = ended - self.ended[DONE]
        self.stage.advance(
            ended / self.count,
            f"{ended} of {self.count} runs, {failed} failed, {60.0 * rate:.0f} a minute, {duration(left)} left",
        )


def do_all(work: Work, runs: Iterable[SweepRun], pool: Pool, workers: int, report: Report) -> None:
    """Do the runs; each ends with a record in the work's folder, and ``report`` is called with its status.

    Where a worker's death breaks a process pool, the runs that the pool had are done one by one in a process of their
    own, which shows the run that causes the death.  A Dask cluster replaces its workers itself, and gives up a run
    with which several of them have died.

    Raises SssiError when the connection to a scheduler is lost, InputError when the folder cannot be written any more.
    """
    waiting = deque(runs)
    while waiting:
        with pool(workers) as crew:
            suspects = _distribute(work, waiting, crew, report)
        _one_by_one(work, suspects, report)


def _distribute(work: Work, waiting: deque[SweepRun], crew: Crew, report: Report) -> list[SweepRun]:
    """Do the waiting runs, and return those that a pool had when it broke."""
    pending: dict[Future[str], SweepRun] = {}
    small: set[str] = set()
    while waiting or pending:
        broken: list[SweepRun] = []
        while waiting and len(pending) < _AHEAD * crew.size():
            run = waiting.popleft()
            try:
                pending[_submit(crew.executor, work, run)] = run
            except BrokenExecutor:
                waiting.appendleft(run)
                if not pending:
                    return []
                break
        ended, _ = wait(pending, timeout=1.0, return_when=FIRST_COMPLETED)
        for future in ended:
            run = pending.pop(future)
            status = _status(work, future, run)
            if status is None:
                broken.append(run)
            elif status == BUSY:
                clock.sleep(_PAUSE)
                waiting.append(run)
            else:
                report(run, status)
                small.add(run.key)
        if broken:
            return [*broken, *pending.values()]
        if len(small) >= _GATHER_AT:
            gather(work.folder, small)
            small.clear()
    return []


def _status(work: Work, future: Future[str], run: SweepRun) -> str | None:
    """Return the status of the run; None where its pool broke."""
    try:
        return future.result()
    except BrokenExecutor:
        return None
    except CancelledError:
        problem = "the connection to the scheduler is lost; finished runs are kept"
        raise SssiError(f"{problem}, {work.again} does the others") from None
    except Exception as error:
        if type(error).__name__ != "KilledWorker":  # Dask's, which need not be installed
            raise
        return _blame(work.folder, run)


def _one_by_one(work: Work, runs: Iterable[SweepRun], report: Report) -> None:
    """Do the runs one at a time in a process; a run with which it dies more than once is recorded as crashed."""
    waiting = deque(runs)
    deaths = 0
    while waiting:
        with local_pool(1) as crew:
            try:
                while waiting:
                    run = waiting[0]
                    while (status := _submit(crew.executor, work, run).result()) == BUSY:
                        clock.sleep(_PAUSE)
                    report(run, status)
                    waiting.popleft()
                    deaths = 0
                continue
            except BrokenExecutor:
                deaths += 1
        if deaths == _TRIES:
            report(run, _blame(work.folder, run))
            waiting.popleft()
            deaths = 0


def _blame(folder: Path, run: SweepRun) -> str:
    record = crash_record(run)
    write_record(folder, record)
    return record.status


def _submit(executor: Executor, work: Work, run: SweepRun) -> Future[str]:
    return executor.submit(work.perform, work.folder, encode((work.job, run)))
