"""The workers of a sweep: processes of this machine, or those of a Dask cluster.

A Dask scheduler runs what it is sent, so anyone who can talk to it runs programs as its user.  The clusters started
here talk over TLS only, with certificates made for the sweep that both sides must show.  Their HTTP servers listen on
the loopback address and show no dashboard.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import tempfile
import time as clock
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.core.choices import Cluster
from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.runtime.optional import import_for
from sssi_exudyn.runtime.threads import LINEAR_ALGEBRA
from sssi_exudyn.sweeps.workers.worker import prepare_worker

_THREADS: Final = (*LINEAR_ALGEBRA, "NUMBA_NUM_THREADS")
"""One thread for each worker: runs go side by side, and sums in another order would change the last digit."""
_MEMORY: Final = 2
"""GB for each core of a Slurm job: a worker takes half a gigabyte, and runs of minutes some more."""
_LOGGERS: Final = ("asyncio", "distributed", "tornado")
_SILENT: Final = logging.CRITICAL + 1
SCHEDULER_TIMEOUT: Final = "30s"
"""Time for a scheduler to answer."""
_LOOPBACK: Final = "127.0.0.1:0"
"""Any free port that other machines cannot reach."""
CREDENTIALS: Final = ".tls-"
"""Begin of the name of the folder with the certificates of Slurm jobs while a sweep runs."""
_ROLES: Final = ("client", "scheduler", "worker")
_LOOK_EVERY: Final = 2.0
"""s between counts of a cluster's workers."""


@dataclass(frozen=True)
class Crew:
    """An executor and, as long as it is open, its number of workers."""

    executor: Executor
    size: Callable[[], int]


Pool = Callable[[int], AbstractContextManager[Crew]]
"""Function that opens a crew of that many workers, or of those that the scheduler has."""


def pool_of(scheduler: str | None, cluster: Cluster | None, folder: Path) -> Pool:
    """Select the pool: a Dask scheduler at an address, a Dask cluster to start, or else processes of this machine.

    Parameters
    ----------
    folder : the sweep's, which the nodes of a cluster see too

    Raises SssiError where both are given, or where Dask is not installed.
    """
    if scheduler is not None and cluster is not None:
        raise SssiError("--scheduler and --cluster exclude each other; give one of them")
    if scheduler is not None:
        return partial(_dask, scheduler)
    if cluster == "local":
        return _dask_local
    if cluster == "slurm":
        return partial(_dask_slurm, folder)
    return local_pool


@contextmanager
def local_pool(workers: int) -> Iterator[Crew]:
    """Spawn processes.  They end with this one, however it ends, and at once when an error leaves the block."""
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
def this_process(_workers: int) -> Iterator[Crew]:
    """Do each run in this process as soon as it is given."""
    yield Crew(_AtOnce(), lambda: 1)


class _AtOnce(Executor):
    """Executor that does each task before it returns."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        done: Future[Any] = Future()
        try:
            done.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - raised where the result is requested
            done.set_exception(error)
        return done


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Set the environment of processes that are started inside."""
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
    """Use the workers of a scheduler or a cluster, with TLS as in the cluster or in Dask's own configuration.

    The client loses its futures when the scheduler goes away.
    """
    dask = import_for("a scheduler or a cluster", "distributed", "sweep")
    with _quiet():
        try:
            client = dask.Client(address, timeout=SCHEDULER_TIMEOUT)
        except (OSError, ValueError, TypeError) as error:  # a TypeError where tls:// lacks certificates
            raise SssiError(f"no Dask scheduler answers at {address}: {str(error).splitlines()[0]}") from None
        with client:
            yield Crew(client.get_executor(pure=False), _Sampled(lambda: len(client.nthreads())))


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress Dask's messages on workers and schedulers that come and go; an important one is an error of ours."""
    named = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _LOGGERS]
    levels = {name: logging.getLogger(name).level for name in (*_LOGGERS, *named)}
    for name in levels:
        logging.getLogger(name).setLevel(_SILENT)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


@dataclass
class _Sampled:
    """A number that is requested often and looked up from time to time."""

    look: Callable[[], int]
    _value: int = 1
    _at: float = -_LOOK_EVERY

    def __call__(self) -> int:
        if clock.monotonic() - self._at >= _LOOK_EVERY:
            self._value, self._at = max(1, self.look()), clock.monotonic()
        return self._value


@contextmanager
def _dask_local(workers: int) -> Iterator[Crew]:
    """Start a scheduler and workers on the loopback address of this machine; TLS keeps its other users out."""
    with (
        _quiet(),
        _one_thread_each(),
        import_for("a cluster", "distributed", "sweep").LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            protocol="tls://",
            security=_temporary_certificates(),
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": _LOOPBACK, "dashboard": False},
            silence_logs=_SILENT,
        ) as cluster,
        _dask(cluster, workers) as crew,
    ):
        yield crew


@contextmanager
def _dask_slurm(folder: Path, workers: int) -> Iterator[Crew]:
    """Start jobs as in the user's ``jobqueue.yaml`` (queue, account, time, cores, memory), a process for each core."""
    with _quiet(), slurm_cluster(folder) as cluster:
        cluster.scale(workers)
        with _dask(cluster, workers) as crew:
            yield crew


@contextmanager
def slurm_cluster(folder: Path) -> Iterator[Any]:
    """Open a ``SLURMCluster`` without jobs yet; defaults for the user's configuration are one core and ``_MEMORY``.

    The certificates are in a folder inside ``folder`` that only the user can read, until the cluster ends.
    """
    jobqueue = import_for("a cluster of jobs", "dask_jobqueue", "sweep")
    settings = import_for("a cluster of jobs", "dask.config", "sweep").get("jobqueue.slurm", {})
    cores = settings.get("cores") or 1
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory(prefix=CREDENTIALS, dir=folder, ignore_cleanup_errors=True) as credentials,
        jobqueue.SLURMCluster(
            cores=cores,
            processes=cores,
            memory=settings.get("memory") or f"{cores * _MEMORY} GB",
            protocol="tls://",
            security=_in_files(_temporary_certificates(), Path(credentials)),
            scheduler_options={"dashboard_address": _LOOPBACK, "dashboard": False},
            worker_extra_args=[
                *(settings.get("worker-extra-args") or []),
                *("--no-dashboard", "--dashboard-address", _LOOPBACK),
            ],
        ) as cluster,
    ):
        yield cluster


def _temporary_certificates() -> Any:
    """Return a Dask ``Security`` that requires encryption, with its own key and certificate in memory."""
    import_for("a cluster", "cryptography", "sweep")
    security = import_for("a cluster", "distributed", "sweep").Security
    return security.temporary()


def _in_files(certificates: Any, folder: Path) -> Any:
    """Return the same ``Security`` with key and certificate in files, for workers on other machines."""
    files = {"cert": folder / "certificate.pem", "key": folder / "key.pem"}
    files["cert"].write_text(certificates.tls_ca_file, encoding="ascii")
    files["key"].write_text(certificates.tls_worker_key, encoding="ascii")
    names = {f"tls_{role}_{part}": str(path) for role in _ROLES for part, path in files.items()}
    return type(certificates)(require_encryption=True, tls_ca_file=str(files["cert"]), **names)
