"""The fuzzer: files are mutated at random, and the program's response is judged.

    export PYTHONPATH=tests/support:tests/support/diagnosis:tests/support/file_formats
    python tests/support/hostile/fuzzing.py --count 10000 [--real FOLDER] [--state FILE] [--kind KIND]

Recordings, files of every importable format, models, skis, results, begun sweeps and entries of a cache are mutated;
some become pipes, devices or folders.  The program may take them, or raise one InputError with file, problem and fix on
a line of bounded length.  Everything else is a finding: another error, more than ten seconds of computing, more than a
gigabyte, a file written or opened that is not one of the case's, a process or a connection.  The work is done in a
process of its own, so that a crash is a finding too.  With --state every case's outcome is kept in a file, and the same
command continues after the last of them.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fuzz_seeds import Seed

LIMIT_S, LIMIT_BYTES = 10, 10**9
READERS = ("sssi_exudyn.importing.motion_capture.c3d_points", "sssi_exudyn.terrain.elevation_reader")
"""Modules that the program runs as processes of their own."""
_ADDRESSES = 2_500_000_000
"""Addresses that a case may reserve, bytes: more than it may use, and far less than would stop the machine."""
PATIENCE_S = 300
"""Limit by the clock, s, for a case that waits for a pipe; beyond the time of any case on a busy machine."""
SPECIAL = 0.03
"""Share of cases in which one file becomes a pipe, a device, a folder or a link."""
TOKENS = (
    b"nan", b"inf", b"-inf", b"1e999", b"-1e308", b"1e-320", b"-0.0", b"0", b"99999999999999999999", b"-1", b"1e18",
    b"", b" ", b",", b";", b"\t", b"\n", b"\r", b"\0", b'"', b"'", b"[", b"]", b"{", b"}", b"<", b">", b"&lol;", b"=",
    b"#", b"../secret", b"/etc/passwd", b"..\\secret", b"$(touch x)", b"__import__('os')", b"\xff\xfe", b"\xef\xbb\xbf",
    b"\xf0\x9f\x8e\xbf", b"1_000", b"0x10", b"1,5", b"true", b"Hips", b"End Site", b"MOTION", b"Frames: 1e9",
    b"$ \\frac{$", b"\x1b[2J\x1b[31m", "\u202egnp.exe".encode(), b"5e-324", b"1e-8", b"1e300", b"\\u001b",
    b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"[skier]", b"[[sensors]]", b"format = 1", b"inDegrees=yes",
)  # fmt: skip


def mutate(data: bytes, rng: random.Random) -> bytes:
    """Mutate bytes, numbers, lines or columns once."""
    at = rng.randrange(len(data) + 1)
    match rng.randrange(15):
        case 0:  # a bit
            at = min(at, len(data) - 1)
            return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :] if data else data
        case 1:
            return data[:at]
        case 2:  # a piece lost
            return data[:at] + data[at + rng.choice((1, 7, 100, 5000)) :]
        case 3:  # a piece twice
            return data[: at + rng.choice((1, 7, 100, 5000))] + data[at:]
        case 4:
            return data[:at] + rng.choice(TOKENS) * rng.choice((1, 1, 1, 2, 1000)) + data[at:]
        case 5:
            return data[:at] + rng.randbytes(rng.choice((1, 4, 64))) + data[at:]
        case 6 | 7:
            return _number(data, rng)
        case 8:
            return _lines(data, rng)
        case 9:
            return _column(data, rng)
        case 10:
            return _word(data, rng)
        case 12:
            return data[:at] + _bomb(rng) + data[at:]
        case 13:
            return _time(data, rng)
        case 14:
            return _number(data, rng, rng.choice((b"9", b"0.", b"-1e")) + b"7" * rng.choice((20, 400, 5000, 90_000)))
        case _:
            return rng.choice((b"", b"\n", b"\xef\xbb\xbf" + data, data.replace(b"\n", b"\r\n"), data * 2))


def _bomb(rng: random.Random) -> bytes:
    """Return a few bytes that are costly to read, or many: keys, brackets, markup, names, lines and columns."""
    count = rng.choice((40, 2000, 45_000, 2_000_000))
    return rng.choice(
        (
            b"\n" + b".".join([b"a"] * count) + b" = 1\n",
            b"\n[" + b".".join([b"a"] * count) + b"]\n",
            b"\nx = " + b"[" * count + b"]" * count + b"\n",
            b"\nx = " + b"{a=" * count + b"1" + b"}" * count + b"\n",
            b"<!--" + b">a" * count + b"-->",
            b'<a b="' + b">" * count + b'"/>',
            b"<a>" * count,
            b"n" * count,
            b"1\n" * count,
            b"1,2 " * count,
            b"{" * count,
        )
    )


def _time(data: bytes, rng: random.Random) -> bytes:
    """Make the first column times with tiny steps and gaps between them, or huge ones."""
    separator = rng.choice((b",", b"\t"))
    step, gap = rng.choice((5e-324, 1e-9, 1e-8, 1e-4, 0.01, 1e9)), rng.choice((0.0, 0.2, 0.9, 1e6))
    lines, time = data.split(b"\n"), 0.0
    for row in range(1, len(lines)):
        first, separated, rest = lines[row].partition(separator)
        if separated and first[:1].isdigit():
            time += gap if rng.random() < 0.05 else step
            lines[row] = repr(time).encode() + separator + rest
    return b"\n".join(lines)


def _number(data: bytes, rng: random.Random, other: bytes | None = None) -> bytes:
    """Put another number, or none, in a number's place."""
    at = rng.randrange(len(data) + 1)
    digits = b"0123456789.-+eE"
    start = next((i for i in range(at, len(data)) if data[i] in digits), None)
    if start is None:
        return data
    stop = next((i for i in range(start, len(data)) if data[i] not in digits), len(data))
    old = data[start:stop]
    new = rng.choice((*TOKENS[:12], b"-" + old, old + b"0", old[:-1], old.replace(b".", b""), old[1:], b"1" + old))
    new = new if other is None else other
    return data[:start] + new + data[stop:]


def _lines(data: bytes, rng: random.Random) -> bytes:
    """Swap, remove, repeat or reorder lines."""
    lines = data.split(b"\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(5):
        case 0:
            lines[one], lines[other] = lines[other], lines[one]
        case 1:
            del lines[one]
        case 2:
            lines.insert(other, lines[one])
        case 3:
            lines[1:] = reversed(lines[1:])
        case _:
            del lines[min(one, other) : max(one, other)]
    return b"\n".join(lines)


def _column(data: bytes, rng: random.Random) -> bytes:
    """Swap a table's column with another, make it constant, scale it, or remove it."""
    lines = data.split(b"\n")
    width = lines[0].count(b",") + 1
    one, other, what = rng.randrange(width), rng.randrange(width), rng.randrange(4)
    factor = rng.choice((0.0, -1.0, 1e-9, 0.001, 3.28, 57.3, 1e9))
    for row in range(len(lines)):
        cells = lines[row].split(b",")
        if len(cells) != width:
            continue
        if what == 0:
            cells[one], cells[other] = cells[other], cells[one]
        elif what == 1 and row:
            cells[one] = b"1.5"
        elif what == 2 and row:
            try:
                cells[one] = repr(float(cells[one]) * factor).encode()
            except ValueError:
                continue
        elif what == 3:
            del cells[one]
        lines[row] = b",".join(cells)
    return b"\n".join(lines)


def _word(data: bytes, rng: random.Random) -> bytes:
    """Exchange a word for another of the file everywhere, such as a joint's name, a key or a unit."""
    words = list(dict.fromkeys(word for word in data[:20000].split() if not word[:1].isdigit() and len(word) > 1))
    if len(words) < 2:
        return data
    return data.replace(rng.choice(words), rng.choice((*words, b"x")))


class TooSlow(BaseException):
    """Raised when the time of a case is over."""


def _alarm(_number: int, _frame: FrameType | None) -> None:
    raise TooSlow


class Guard:
    """A guard that watches opened and written files while a case runs.

    Allowed are files below ``folder``, and those that Python itself needs.
    """

    def __init__(self, secret: Path) -> None:
        self.folder: Path | None = None
        self.secret = str(secret)
        self.seen: list[str] = []
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: tuple[object, ...]) -> None:
        if self.folder is None:
            return
        if event == "open":
            path, mode, flags = arguments[:3]
            if not isinstance(path, str | bytes):
                return
            name = os.path.realpath(os.fsdecode(path))
            writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            if name == self.secret or name == "/etc/passwd" or (writes and not self._own(name)):
                self.seen.append(f"open {name} {mode}")
        elif event in ("os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.symlink", "os.link", "os.truncate"):
            # below a folder that was opened, as rmtree does
            within = event in ("os.remove", "os.rmdir") and arguments[1] != -1
            if not within and not all(self._own(os.path.realpath(x)) for x in arguments if isinstance(x, str)):
                self.seen.append(f"{event} {arguments}")
        elif event == "subprocess.Popen" and not any(reader in str(arguments[1]) for reader in READERS):
            self.seen.append(f"{event} {arguments[1]}")
        elif event in ("os.system", "socket.connect", "pickle.find_class", "os.exec", "os.posix_spawn"):
            self.seen.append(f"{event} {arguments}")

    def _own(self, name: str) -> bool:
        places = (f"{self.folder}{os.sep}", "/dev/", str(Path(tempfile.gettempdir()).resolve() / "sssi_exudyn_"))
        return name.startswith(places) or name == str(self.folder)


def judge(case: Path, names: list[str], kind: str, guard: Guard | None, limit: float = LIMIT_S) -> tuple[str, str]:
    """Return "taken", "refused" or "finding", and the message; ``limit`` in s of computing."""
    from fuzz_uses import USES

    from sssi_exudyn.core.errors import InputError
    from sssi_exudyn.core.text import one_line

    signal.signal(signal.SIGPROF, _alarm)
    signal.setitimer(signal.ITIMER_PROF, limit)  # of computing: the machine may have other work too
    signal.signal(signal.SIGALRM, _alarm)
    signal.setitimer(signal.ITIMER_REAL, PATIENCE_S)
    if guard is not None:
        guard.folder, guard.seen = case, []
    try:
        USES[kind](case / "in", names, case / "out")
        verdict = ("taken", "")
    except InputError as error:
        good = error.file and error.problem and error.fix and one_line(error, 4000) == str(error)
        verdict = ("refused" if good else "finding", str(error)[:500])
    except TooSlow:
        verdict = ("finding", "more than ten seconds of computing, or waiting\n" + traceback.format_exc()[-1500:])
    except Exception:  # noqa: BLE001 - whatever it is, it is a finding
        verdict = ("finding", traceback.format_exc()[-3000:])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        if guard is not None:
            guard.folder = None
    if guard is not None and guard.seen:
        return "finding", "; ".join(guard.seen[:5])
    return verdict


class Memory:
    """The most memory that a case takes beyond the process's own, as Linux counts it."""

    def __init__(self) -> None:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the peak counts from now
        self.begin = kilobytes("VmRSS")

    def peak(self) -> int:
        """Return the peak since the beginning, bytes."""
        return 1024 * max(kilobytes("VmHWM") - self.begin, 0)


def kilobytes(name: str) -> int:
    """Return a figure of this process's memory, as Linux gives it."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name + ":"))


def worker(count: int, first: int, seed: int, real: str | None, keep: Path, kinds: Sequence[str] = ()) -> None:
    """Run cases ``first`` to ``count``, with one line of JSON before and after each."""
    from fuzz_seeds import bundled
    from fuzz_seeds import real as real_seeds

    addresses = 1024 * kilobytes("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (addresses + _ADDRESSES, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory() as name:
        root = Path(name).resolve()
        (root / "secret").write_text("secret", encoding="utf-8")
        made = [candidate for candidate in bundled(root) if not kinds or candidate.kind in kinds]
        seeds = made + (list(real_seeds(Path(real))) if real else [])
        own = {path.name for path in root.iterdir()} | {"case"}
        guard = Guard(root / "secret")
        case = root / "case"
        tried: set[int] = set()
        for number in range(first, count):
            rng = random.Random(f"{seed} {number}")
            among = rng.choice((made, seeds))
            (chosen,) = rng.choices(among, [candidate.weight for candidate in among])
            if id(chosen) not in tried:  # whole files are taken, and all modules are there before the guard watches
                verdict, message = _try(case, chosen, chosen.files, {}, None)
                if verdict != "taken" and chosen.made:
                    raise AssertionError(f"{chosen.name} is {verdict} as it is: {message}")
                tried.add(id(chosen))
            files, special = _mutated(chosen, rng)
            _report({"begun": number})
            begin, memory = time.process_time(), Memory()
            verdict, message = _try(case, chosen, files, special, guard)
            took, bytes_used = time.process_time() - begin, memory.peak()
            if bytes_used > LIMIT_BYTES:
                verdict, message = "finding", f"{bytes_used / 1e6:.0f} MB\n{message}"
            stray = {path.name for path in root.iterdir()} - own
            if stray:
                verdict, message = "finding", f"written outside: {stray}"
            if verdict == "finding":
                _keep(case, keep / f"{seed}-{number}", message)
            result = {
                "number": number,
                "seed": f"{chosen.name} ({chosen.kind})",
                "verdict": verdict,
                "message": message,
            }
            _report({**result, "seconds": took, "bytes": bytes_used})


def _mutated(chosen: Seed, rng: random.Random) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return the files of a case, and the target of those that become a pipe, a device, a folder or a link."""
    files = dict(chosen.files)
    victims = [file for file in files if chosen.name == file] or sorted(files)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        victim = rng.choice(victims)
        files[victim] = mutate(files[victim], rng)
    if rng.random() < SPECIAL:
        return files, {rng.choice(victims): rng.choice(("pipe", "folder", "/dev/zero", "/dev/stdin", "nowhere"))}
    return files, {}


def _try(
    case: Path, seed: Seed, files: dict[str, bytes], special: dict[str, str], guard: Guard | None
) -> tuple[str, str]:
    """Put a case into its folder and judge it."""
    shutil.rmtree(case, ignore_errors=True)
    for file, data in files.items():
        path = case / "in" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        match special.get(file):
            case None:
                path.write_bytes(data)
            case "pipe":
                os.mkfifo(path)
            case "folder":
                path.mkdir()
            case target:
                path.symlink_to(target)
    # the first time without a guard, kernels are compiled as well
    return judge(case, list(files), seed.kind, guard, LIMIT_S if guard else PATIENCE_S)


def _keep(case: Path, folder: Path, message: str) -> None:
    """Keep the regular files of a finding, and its message."""
    for path in case.rglob("*"):
        if path.is_file() and not path.is_symlink():
            (folder / path.relative_to(case)).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, folder / path.relative_to(case))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "message.txt").write_text(message, encoding="utf-8")


def _report(what: dict[str, object]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


@dataclass
class Tally:
    """The outcomes of a fuzzing run.

    They are the numbers of cases taken, refused and findings, the findings in words, and the worst time (s) and memory
    (bytes) with the case.
    """

    counts: Counter[str] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    findings: list[str] = field(default_factory=list)
    seconds: tuple[float, str] = (0.0, "")
    memory: tuple[int, str] = (0, "")
    computing: float = 0.0
    """Computing time of all cases together, s."""
    cases: int = 0

    def add(self, about: Mapping[str, Any]) -> None:
        """Count a case's outcome."""
        name = f"case {about['number']} of {about['seed']}"
        self.cases = about["number"] + 1
        self.counts[about["verdict"]] += 1
        self.kinds[about["seed"]] += 1
        self.computing += about["seconds"]
        self.seconds = max(self.seconds, (about["seconds"], name))
        self.memory = max(self.memory, (about["bytes"], name))
        if about["verdict"] == "finding":
            self.findings.append(f"{name}: {about['message']}")

    def __str__(self) -> str:
        (seconds, slowest), (used, largest) = self.seconds, self.memory
        return (
            f"{self.cases} cases: {dict(sorted(self.counts.items()))}; the worst took {seconds:.1f} s of computing "
            f"({slowest}) and {used / 1e6:.0f} MB ({largest}); {self.computing:.0f} s together\n"
        )


def fuzz(
    count: int,
    seed: int,
    keep: Path,
    real: Path | None = None,
    state: Path | None = None,
    kinds: Sequence[str] = (),
) -> Tally:
    """Run ``count`` cases, of seeds of all kinds or of those in ``kinds``.

    A worker that dies or hangs is a finding, and another worker continues after it; an interrupt ends the run early.

    Outcomes are appended to the file ``state``, one line of JSON each; those that it has are counted, not done again.
    """
    tally = Tally()
    for about in _outcomes(state):
        tally.add(about)
    keep.mkdir(parents=True, exist_ok=True)
    while tally.cases < count:
        command = [sys.executable, __file__, "--worker", str(tally.cases), "--count", str(count), "--seed", str(seed)]
        command += ["--keep", str(keep), *(["--real", str(real)] if real else [])]
        command += [word for kind in kinds for word in ("--kind", kind)]
        running = None
        modules = {"PYTHONPATH": os.pathsep.join(sys.path)}  # the worker imports from the same folders
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, **modules}) as process:
            assert process.stdout is not None
            try:
                for line in process.stdout:
                    about = json.loads(line)
                    running = about.get("begun")
                    if running is None:
                        _note(tally, about, state)
            except KeyboardInterrupt:  # enough: the findings so far are reported
                process.kill()
                break
        if running is not None:
            message = f"the process ended with {process.returncode}"
            outcome = {"number": running, "seed": "unknown", "verdict": "finding", "message": message}
            _note(tally, {**outcome, "seconds": 0.0, "bytes": 0}, state)
        elif process.returncode != 0:
            raise RuntimeError(f"the worker failed before case {tally.cases}")
    return tally


def _outcomes(state: Path | None) -> list[dict[str, Any]]:
    """Return the outcomes in the file; a last line that a kill cut off is removed."""
    if state is None or not state.exists():
        return []
    lines = state.read_text(encoding="utf-8").splitlines(keepends=True)
    whole = [line for line in lines if line.endswith("\n")]
    state.write_text("".join(whole), encoding="utf-8")
    return [json.loads(line) for line in whole]


def _note(tally: Tally, about: Mapping[str, Any], state: Path | None) -> None:
    tally.add(about)
    if state is not None:
        with state.open("a", encoding="utf-8") as file:
            file.write(json.dumps(about) + "\n")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Mutate files at random and judge what the program does.")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--real", type=Path, help="a folder with files to mutate as well")
    parser.add_argument("--keep", type=Path, default=Path("fuzz_findings"), help="where findings are kept")
    parser.add_argument("--state", type=Path, help="where outcomes are kept, so that the same command goes on")
    parser.add_argument("--kind", action="append", default=[], help="only seeds of this kind, such as reader or day")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker is not None:
        worker(options.count, options.worker, options.seed, options.real, options.keep, options.kind)
        return
    tally = fuzz(options.count, options.seed, options.keep, options.real, options.state, options.kind)
    sys.stdout.write("".join(f"{finding}\n" for finding in tally.findings))
    sys.stdout.write(f"{dict(tally.kinds)}\n{tally}")


if __name__ == "__main__":
    main()
