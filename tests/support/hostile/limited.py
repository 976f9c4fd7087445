"""A call in a process of its own, within bounds of memory and computing, and its outcome."""

from __future__ import annotations

import json
import os
import resource
import signal
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.text import one_line

MEMORY, SECONDS = 1_000_000_000, 10
"""Bounds that the program promises: bytes beyond the process's memory at its start, and s of computing."""
_ROOM = 2_500_000_000
"""Bound of addresses, bytes; more than the bound of memory, as allocators reserve."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of a call.

    ``verdict`` is taken, refused (by one clear line, ``text``) or fault; ``memory`` in bytes, ``seconds`` of computing.
    """

    verdict: str
    text: str
    memory: int
    seconds: float


def run_limited(call: Callable[[], object]) -> Outcome:
    """Do ``call`` in a fork of this process.  A crash, a hang (by computing) and too much memory are faults."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            outcome = _do(call)
        except BaseException:  # noqa: BLE001 - no error may leave the fork
            outcome = ("fault", traceback.format_exc()[-3000:], 0)
        os.write(writing, json.dumps(outcome).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        said = stream.read()
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    if not said:
        return Outcome("fault", f"ended by signal {status & 127}, status {status >> 8}", 0, seconds)
    verdict, text, memory = json.loads(said)
    if verdict != "fault" and memory > MEMORY:
        verdict, text = "fault", f"{memory / 1e6:.0f} MB; {text}"
    return Outcome(verdict, text, memory, seconds)


def _do(call: Callable[[], object]) -> tuple[str, str, int]:
    begin = _kilobytes("VmRSS")
    addresses = 1024 * _kilobytes("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (addresses + _ROOM, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    try:
        call()
        verdict, text = "taken", ""
    except SssiError as error:
        verdict, text = "refused", str(error)
        if one_line(text, 10**9) != text or len(text) > 5000:
            verdict = "fault"
    except BaseException:  # noqa: BLE001 - whatever it is, it is what is looked for
        verdict, text = "fault", traceback.format_exc()[-3000:]
    return verdict, text, 1024 * max(_kilobytes("VmHWM") - begin, 0)


def _kilobytes(name: str) -> int:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name + ":"))
