"""Who does the runs: processes of this machine, or the workers of a Dask cluster, here or anywhere."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Any, Final, Literal

from sssi_exudyn.errors import SssiError
from sssi_exudyn.optional import needed_for
from sssi_exudyn.sweep_worker import prepare_worker

Cluster = Literal["local", "slurm"]
CLUSTERS: Final[tuple[Cluster, ...]] = ("local", "slurm")
_THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""One thread a worker: runs go side by side, and sums in another order would change the last digit."""
_PATIENCE: Final = "30s"
"""For a scheduler to answer."""

Pool = Callable[[int], AbstractContextManager[Executor]]
"""Opens an executor of that many workers."""


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
def local_pool(workers: int) -> Iterator[Executor]:
    """Spawned processes.  They end with this one however it ends, and at once when what is inside fails."""
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), prepare_worker)
    with _one_thread_each():
        try:
            yield pool
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
def _dask(address: Any, _workers: int) -> Iterator[Executor]:
    """Whatever workers the scheduler has; its client loses its futures when the scheduler goes away."""
    dask = needed_for("a scheduler or a cluster", "distributed", "sweep")
    try:
        client = dask.Client(address, timeout=_PATIENCE)
    except (OSError, ValueError) as error:
        raise SssiError(f"no Dask scheduler answers at {address}: {str(error).splitlines()[0]}") from None
    with client:
        yield client.get_executor(pure=False)


@contextmanager
def _dask_local(workers: int) -> Iterator[Executor]:
    dask = needed_for("a scheduler or a cluster", "distributed", "sweep")
    with (
        _one_thread_each(),
        dask.LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        _dask(cluster, workers) as executor,
    ):
        yield executor


@contextmanager
def _dask_slurm(workers: int) -> Iterator[Executor]:
    """Jobs as the user's ``jobqueue.yaml`` says: queue, account, memory, time; a core and a thread each."""
    jobqueue = needed_for("a cluster of jobs", "dask_jobqueue", "sweep")
    with jobqueue.SLURMCluster(cores=1, processes=1) as cluster:
        cluster.scale(workers)
        with _dask(cluster, workers) as executor:
            yield executor
