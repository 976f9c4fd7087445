"""The fuzzer: files are spoilt at random, and what the program then does is judged.

    python tests/support/fuzzing.py --count 10000 --seed 1 [--real FOLDER]

Allowed is to take the recording, or one InputError with file, problem and fix on one line.  Everything else is a
finding: another error, more than ten seconds of computing, more than a gigabyte, a file written or opened that is none
of the recording's, a process or a connection.  The work is done in a process of its own, so that a crash is a finding
too.
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
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fuzz_seeds import Seed

LIMIT_S, LIMIT_BYTES = 10, 10**9
TOKENS = (
    b"nan", b"inf", b"-inf", b"1e999", b"-1e308", b"1e-320", b"-0.0", b"0", b"99999999999999999999", b"-1", b"1e18",
    b"", b" ", b",", b";", b"\t", b"\n", b"\r", b"\0", b'"', b"'", b"[", b"]", b"{", b"}", b"<", b">", b"&lol;", b"=",
    b"#", b"../secret", b"/etc/passwd", b"..\\secret", b"$(touch x)", b"__import__('os')", b"\xff\xfe", b"\xef\xbb\xbf",
    b"\xf0\x9f\x8e\xbf", b"1_000", b"0x10", b"1,5", b"true", b"Hips", b"End Site", b"MOTION", b"Frames: 1e9",
    b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"[skier]", b"[[sensors]]", b"format = 1", b"inDegrees=yes",
)  # fmt: skip


def spoil(data: bytes, rng: random.Random) -> bytes:
    """One mutation: of bytes, of numbers, of lines or of columns."""
    at = rng.randrange(len(data) + 1)
    match rng.randrange(12):
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
        case _:
            return rng.choice((b"", b"\n", b"\xef\xbb\xbf" + data, data.replace(b"\n", b"\r\n"), data * 2))


def _number(data: bytes, rng: random.Random) -> bytes:
    """Another number, or none, in a number's place."""
    at = rng.randrange(len(data) + 1)
    digits = b"0123456789.-+eE"
    start = next((i for i in range(at, len(data)) if data[i] in digits), None)
    if start is None:
        return data
    stop = next((i for i in range(start, len(data)) if data[i] not in digits), len(data))
    old = data[start:stop]
    new = rng.choice((*TOKENS[:12], b"-" + old, old + b"0", old[:-1], old.replace(b".", b""), old[1:], b"1" + old))
    return data[:start] + new + data[stop:]


def _lines(data: bytes, rng: random.Random) -> bytes:
    """Lines swapped, lost, repeated or put in another order."""
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
    """A column of a table swapped with another, made constant, scaled, or lost."""
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
    """A word exchanged for another of the file everywhere, such as a joint's name, a key or a unit."""
    words = list(dict.fromkeys(word for word in data[:20000].split() if not word[:1].isdigit() and len(word) > 1))
    if len(words) < 2:
        return data
    return data.replace(rng.choice(words), rng.choice((*words, b"x")))


class TooSlow(BaseException):
    """Ten seconds are over."""


def _alarm(_number: int, _frame: FrameType | None) -> None:
    raise TooSlow


class Guard:
    """Watches what is opened and written while a case runs: only below ``folder``, and in what Python itself needs."""

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
            within = event == "os.remove" and arguments[1] != -1  # below a folder that was opened, as rmtree does
            if not within and not all(self._own(os.path.realpath(x)) for x in arguments if isinstance(x, str)):
                self.seen.append(f"{event} {arguments}")
        elif event == "subprocess.Popen" and "sssi_exudyn.importing.c3d_points" not in str(arguments[1]):
            self.seen.append(f"{event} {arguments[1]}")
        elif event in ("os.system", "socket.connect", "pickle.find_class", "os.exec", "os.posix_spawn"):
            self.seen.append(f"{event} {arguments}")

    def _own(self, name: str) -> bool:
        return name.startswith((f"{self.folder}{os.sep}", "/dev/")) or name == str(self.folder)


def use(folder: Path, names: list[str], out: Path, imported: bool) -> None:
    """What the program does with a recording before it simulates."""
    from fuzz_seeds import KNOWN

    from sssi_exudyn.fitting.fit import problem_of
    from sssi_exudyn.importing.assemble import import_recording
    from sssi_exudyn.model.from_recording import model_of
    from sssi_exudyn.motion.from_recording import motion_from_recording
    from sssi_exudyn.recording.inspection import format_inspection, inspect_recording
    from sssi_exudyn.recording.read import read_recording

    sources = [folder / name for name in names]
    recording = import_recording(sources, out, KNOWN) if imported else read_recording(folder)
    format_inspection(inspect_recording(recording))
    motion = motion_from_recording(recording)
    model = model_of(recording, motion)
    if recording.gps is not None:
        problem_of(recording, motion, model, "joint")


def judged(case: Path, names: list[str], imported: bool, guard: Guard | None) -> tuple[str, str]:
    """ "taken", "refused" or "finding", and what was said."""
    from sssi_exudyn.core.errors import InputError

    signal.signal(signal.SIGPROF, _alarm)
    signal.setitimer(signal.ITIMER_PROF, LIMIT_S)  # of computing: the machine may have other work too
    if guard is not None:
        guard.folder, guard.seen = case, []
    try:
        use(case / "in", names, case / "out", imported)
        verdict = ("taken", "")
    except InputError as error:
        good = error.file and error.problem and error.fix and "\n" not in str(error) and str(error).isprintable()
        verdict = ("refused" if good else "finding", str(error)[:500])
    except TooSlow:
        verdict = ("finding", "more than ten seconds\n" + traceback.format_exc()[-1500:])
    except Exception:  # noqa: BLE001 - whatever it is, it is what is looked for
        verdict = ("finding", traceback.format_exc()[-3000:])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        if guard is not None:
            guard.folder = None
    if guard is not None and guard.seen:
        return "finding", "; ".join(guard.seen[:5])
    if resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 > LIMIT_BYTES:
        return "finding", "more than a gigabyte"
    return verdict


def worker(count: int, first: int, seed: int, real: str | None, keep: Path) -> None:
    """Cases ``first`` to ``count``, one line of JSON each before and after."""
    from fuzz_seeds import bundled
    from fuzz_seeds import real as real_seeds

    with tempfile.TemporaryDirectory() as name:
        root = Path(name).resolve()
        (root / "secret").write_text("secret", encoding="utf-8")
        made = bundled(root)
        seeds = made + (list(real_seeds(Path(real))) if real else [])
        guard = Guard(root / "secret")
        case = root / "case"
        for whole in seeds:  # whole files are taken, and all modules are there before the guard watches
            verdict, said = _tried(case, whole, whole.files, None)
            if verdict != "taken" and whole.made:
                raise AssertionError(f"{whole.name} is {verdict} as it is: {said}")
        for number in range(first, count):
            rng = random.Random(f"{seed} {number}")
            chosen = rng.choice(rng.choice((made, seeds)))
            files = dict(chosen.files)
            victims = [file for file in files if chosen.name == file] or sorted(files)
            for _ in range(rng.choice((1, 1, 1, 2, 3))):
                victim = rng.choice(victims)
                files[victim] = spoil(files[victim], rng)
            _tell({"begun": number})
            begin = time.process_time()
            verdict, said = _tried(case, chosen, files, guard)
            took = time.process_time() - begin
            stray = {path.name for path in root.iterdir()} - {"secret", "case", "tiny", "few", "run.c3d"}
            if stray:
                verdict, said = "finding", f"written outside: {stray}"
            if verdict == "finding":
                shutil.copytree(case, keep / f"{seed}-{number}", dirs_exist_ok=True)
                (keep / f"{seed}-{number}" / "said.txt").write_text(said, encoding="utf-8")
            _tell({"number": number, "seed": chosen.name, "verdict": verdict, "said": said, "took": took})


def _tried(case: Path, seed: Seed, files: dict[str, bytes], guard: Guard | None) -> tuple[str, str]:
    """A case put into its folder and judged."""
    shutil.rmtree(case, ignore_errors=True)
    for file, data in files.items():
        (case / "in" / file).parent.mkdir(parents=True, exist_ok=True)
        (case / "in" / file).write_bytes(data)
    return judged(case, list(files), seed.imported, guard)


def _tell(what: dict[str, object]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def fuzz(count: int, seed: int, keep: Path, real: Path | None = None) -> tuple[Counter[str], list[str], float]:
    """Run ``count`` cases; how many were taken, refused and findings, the findings, and the longest time (s).

    A worker that dies or hangs is a finding, and another one goes on behind it.  An interrupt ends it early.
    """
    counts: Counter[str] = Counter()
    findings: list[str] = []
    longest, first = 0.0, 0
    keep.mkdir(parents=True, exist_ok=True)
    while first < count:
        command = [sys.executable, __file__, "--worker", str(first), "--count", str(count), "--seed", str(seed)]
        command += ["--keep", str(keep), *(["--real", str(real)] if real else [])]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            running = None
            try:
                for line in process.stdout:
                    told = json.loads(line)
                    running = told.get("begun")
                    if running is not None:
                        continue
                    first, longest = told["number"] + 1, max(longest, told["took"])
                    counts[told["verdict"]] += 1
                    if told["verdict"] == "finding":
                        findings.append(f"case {told['number']} of {told['seed']}: {told['said']}")
            except KeyboardInterrupt:  # enough: what was found so far is told
                process.kill()
                break
        if running is not None:
            counts["finding"] += 1
            findings.append(f"case {running}: the process ended with {process.returncode}")
            first = running + 1
        elif process.returncode != 0:
            raise RuntimeError(f"the worker failed before case {first}")
    return counts, findings, longest


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="Spoil recordings at random and judge what the program does.")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--real", type=Path, help="a folder with files to spoil as well")
    parser.add_argument("--keep", type=Path, default=Path("fuzz_findings"), help="where findings are kept")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker is not None:
        worker(options.count, options.worker, options.seed, options.real, options.keep)
        return
    counts, findings, longest = fuzz(options.count, options.seed, options.keep, options.real)
    sys.stdout.write("".join(f"{finding}\n" for finding in findings))
    sys.stdout.write(f"{dict(counts)}, longest {longest:.1f} s\n")


if __name__ == "__main__":
    main()
