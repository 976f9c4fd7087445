"""Access to the clusters that a sweep starts: none without the sweep's certificates."""

import os
import socket
import ssl
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
import pytest

from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.workers.pools import CREDENTIALS, pool_of, slurm_cluster

EXAMPLES = Path(__file__).parents[2] / "examples"
_SBATCH = """#!/bin/sh
cp "$1" "$1.job"
setsid sh "$1.job" >/dev/null 2>&1 &
echo "Submitted batch job $!"
"""
_SCANCEL = """#!/bin/sh
kill -- "-$1"
"""


def listening(pid: int) -> set[tuple[str, int]]:
    """Return the addresses that a process and its children listen on."""
    processes = [psutil.Process(pid), *psutil.Process(pid).children(recursive=True)]
    sockets = [socket_ for process in processes for socket_ in process.net_connections("inet")]
    return {(socket_.laddr.ip, socket_.laddr.port) for socket_ in sockets if socket_.status == psutil.CONN_LISTEN}


def reply(address: tuple[str, int], request: bytes = b"GET /status HTTP/1.0\r\n\r\n") -> bytes:
    """Return the answer to an unencrypted request; nothing where the connection is refused or closed."""
    with socket.create_connection(address, timeout=5.0) as plain:
        plain.sendall(request)
        with suppress(TimeoutError, ConnectionError):
            return plain.recv(4096)
    return b""


def asks_for_certificate(address: tuple[str, int]) -> bool:
    """Return True where the server talks TLS and refuses a client that shows no certificate."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with socket.create_connection(address, timeout=5.0) as plain:
        try:
            context.wrap_socket(plain).recv(64)  # TLS 1.3 refuses with the first data
        except ssl.SSLError as error:
            return "CERTIFICATE_REQUIRED" in str(error) or "HANDSHAKE_FAILURE" in str(error)
        except (TimeoutError, ConnectionError):
            return False
    return False


def check_sockets(addresses: set[tuple[str, int]], open_to_others: set[int]) -> None:
    """Check that only the ports in ``open_to_others`` are open to others, and that Dask's ask for a certificate."""
    served = 0
    for ip, port in addresses:
        assert ip in ("127.0.0.1", "::1") or port in open_to_others
        answer = reply((ip, port))
        if answer.startswith(b"HTTP/"):
            assert ip == "127.0.0.1"
            assert answer.split()[1] == b"404"  # no dashboard
        else:
            assert answer == b""
            assert asks_for_certificate((ip, port))
            served += 1
    assert served > 0


@pytest.mark.long
def test_local_cluster_listens_on_the_loopback_with_tls(tmp_path: Path) -> None:
    before = listening(os.getpid())
    with pool_of(None, "local", tmp_path)(1):
        check_sockets(listening(os.getpid()) - before, set())


def test_slurm_scheduler_asks_for_certificates_that_only_the_user_can_read(tmp_path: Path) -> None:
    before = listening(os.getpid())
    with slurm_cluster(tmp_path) as cluster:
        assert cluster.scheduler_address.startswith("tls://")
        port = int(cluster.scheduler_address.rpartition(":")[2])
        addresses = listening(os.getpid()) - before
        assert port in {open_port for _, open_port in addresses}
        check_sockets(addresses, {port})
        script = cluster.job_script()
        (folder,) = tmp_path.glob(f"{CREDENTIALS}*")
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        assert f"--tls-key {folder}/key.pem" in script
        assert "--no-dashboard --dashboard-address 127.0.0.1:0" in script
        assert "#SBATCH --cpus-per-task=1" in script
        assert "--nthreads 1" in script
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_slurm_jobs_find_their_scheduler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put commands in place of Slurm's that run the job's script on this machine."""
    for name, text in (("sbatch", _SBATCH), ("scancel", _SCANCEL)):
        command = tmp_path / "bin" / name
        command.parent.mkdir(exist_ok=True)
        command.write_text(text, encoding="ascii")
        command.chmod(0o700)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(EXAMPLES.parent))
    settings: dict[str, Any] = {"format": 1, "recordings": [str(EXAMPLES / "beginner")], "duration_s": 0.2}
    counts = sweeps.sweep(settings, tmp_path / "out", workers=1, cluster="slurm")
    assert (counts["done"], counts["left"]) == (1, 0)
    assert not list((tmp_path / "out").glob(f"{CREDENTIALS}*"))
