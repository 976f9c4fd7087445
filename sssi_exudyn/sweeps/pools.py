"""Who does the runs: processes of this machine, or the workers of a Dask cluster, here or anywhere."""

from __future__ import annotations

import logging
import multiprocessing
import os
import time as clock
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.runtime.optional import import_for
from sssi_exudyn.sweeps.worker import prepare_worker

Cluster = Literal["local", "slurm"]
_THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""One thread a worker: runs go side by side, and sums in another order would change the last digit."""
_MEMORY: Final = 2
"""GB a core of a Slurm job: a worker takes half a gigabyte, and runs of minutes some more."""
_LOUD: Final = ("asyncio", "distributed", "tornado")
_SILENT: Final = logging.CRITICAL + 1
_PATIENCE: Final = "30s"
"""For a scheduler to answer."""

_LOOK_EVERY: Final = 2.0
"""s between looks at how many workers a cluster has."""


@dataclass(frozen=True)
class Crew:
    """An executor and, as long as it is open, how many workers it has just then."""

    executor: Executor
    size: Callable[[], int]


Pool = Callable[[int], AbstractContextManager[Crew]]
"""Opens a crew of that many workers, or of however many there are."""


def pool_of(scheduler: str | None, cluster: Cluster | None) -> Pool:
    """The pool that was asked for: Dask's scheduler at an address, a Dask cluster, or else processes of this machine.

    Raises SssiError for both together, or where Dask is not installed.
    """
    if scheduler is not None and cluster is not None:
        raise SssiError("a scheduler that runs and a cluster to start exclude each other; give one of them")
    if scheduler is not None:
        return partial(_dask, scheduler)
    if cluster == "local":
        return _dask_local
    if cluster == "slurm":
        return _dask_slurm
    return local_pool


@contextmanager
def local_pool(workers: int) -> Iterator[Crew]:
    """Spawned processes.  They end with this one however it ends, and at once when what is inside fails."""
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), prepare_worker)
    with _one_thread_each():
        try:
            yield Crew(pool, lambda: workers)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in set(multiprocessing.active_children()) - before:
                child.terminate()
            raise
        pool.shutdown()


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Environment of processes that are started inside."""
    old = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in old.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _dask(address: Any, _workers: int) -> Iterator[Crew]:
    """Whatever workers the scheduler has; its client loses its futures when the scheduler goes away."""
    dask = import_for("a scheduler or a cluster", "distributed", "sweep")
    with _quiet():
        try:
            client = dask.Client(address, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise SssiError(f"no Dask scheduler answers at {address}: {str(error).splitlines()[0]}") from None
        with client:
            yield Crew(client.get_executor(pure=False), _Seen(lambda: len(client.nthreads())))


@contextmanager
def _quiet() -> Iterator[None]:
    """Without Dask's own word on workers and schedulers that come and go: what matters of it is an error of ours."""
    loud = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _LOUD]
    levels = {name: logging.getLogger(name).level for name in (*_LOUD, *loud)}
    for name in levels:
        logging.getLogger(name).setLevel(_SILENT)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


@dataclass
class _Seen:
    """A number that is asked for often and looked up from time to time."""

    look: Callable[[], int]
    _value: int = 1
    _at: float = -_LOOK_EVERY

    def __call__(self) -> int:
        if clock.monotonic() - self._at >= _LOOK_EVERY:
            self._value, self._at = max(1, self.look()), clock.monotonic()
        return self._value


@contextmanager
def _dask_local(workers: int) -> Iterator[Crew]:
    dask = import_for("a cluster", "distributed", "sweep")
    with (
        _quiet(),
        _one_thread_each(),
        dask.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",  # any free port: the usual one may be another sweep's
            silence_logs=_SILENT,
        ) as cluster,
        _dask(cluster, workers) as crew,
    ):
        yield crew


@contextmanager
def _dask_slurm(workers: int) -> Iterator[Crew]:
    """Jobs as the user's ``jobqueue.yaml`` says (queue, account, time, cores, memory), a process for each core."""
    with slurm_cluster() as cluster:
        cluster.scale(workers)
        with _dask(cluster, workers) as crew:
            yield crew


def slurm_cluster() -> Any:
    """A ``SLURMCluster`` without jobs yet; what the user's configuration leaves open is one core of ``_MEMORY``."""
    jobqueue = import_for("a cluster of jobs", "dask_jobqueue", "sweep")
    told = import_for("a cluster of jobs", "dask.config", "sweep").get("jobqueue.slurm", {})
    cores = told.get("cores") or 1
    return jobqueue.SLURMCluster(cores=cores, processes=cores, memory=told.get("memory") or f"{cores * _MEMORY} GB")
