"""What the fuzzer mutates: recordings, files of every format that is imported, a result, a begun sweep, a cache."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from a_run import a_run
from c3d_file import marker_places, write_c3d
from fix_files import START, fit, nmea, phone
from mvnx_file import mvnx, orientations
from strapped import write_few
from swinging import HEIGHT, chain_coordinates, mot
from tiny import ANSWERS, Tiny

from sssi_exudyn.bodies.skier.chain import average_geometry, forward_kinematics, geometry_to_dict
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.results.folder import write_result
from sssi_exudyn.runtime.cache import Cache

EXAMPLES = Path(__file__).parents[2] / "examples"
KNOWN = replace(ANSWERS, gps_offset_s=0.0)
_STEP = 10
"""Real tables are long; every so many lines are enough."""


@dataclass(frozen=True)
class Seed:
    """Whole files, and what is done with them: a recording is read, others are imported first."""

    name: str
    files: dict[str, bytes]
    kind: str
    """``recording``, ``import``, ``result``, ``sweep`` or ``cache``."""
    made: bool = True
    """Made here, so that it is whole; files from elsewhere may be refused as they are."""


def bundled(folder: Path) -> list[Seed]:
    """Seeds from the examples and from made files of every format; ``folder`` is for files that have to be written."""
    seeds = [cut(EXAMPLES / name) for name in ("beginner", "intermediate")]
    tiny = Tiny()
    seeds.append(Seed("tiny", _folder(tiny.write(folder / "tiny")), "recording"))
    few = write_few(read_recording(EXAMPLES / "intermediate"), ("left_ski", "right_ski", "chest"), folder / "few")
    seeds.append(Seed("few", _folder(few), "recording"))
    motion = {"motion.bvh": tiny.bvh().encode()}
    poses = forward_kinematics(average_geometry(HEIGHT), chain_coordinates(), 0.0)
    write_c3d(folder / "run.c3d", marker_places(poses, HEIGHT), 60.0)
    for name, content in (
        ("run.mvnx", mvnx(orientations(90), began=START.timestamp()).encode()),
        ("run.mot", mot(chain_coordinates()).encode()),
        ("run.c3d", (folder / "run.c3d").read_bytes()),
    ):
        seeds.append(Seed(name, {name: content}, "import"))
    for name, content in (
        ("track.nmea", nmea(tiny.gps).encode()),
        ("watch.fit", fit({name: column[::10] for name, column in tiny.gps.items()})),
        ("Location.csv", phone(tiny.gps, bearing=-1.0).encode()),
    ):
        seeds.append(Seed(name, motion | {name: content}, "import"))
    return [*seeds, _result(folder / "result"), _sweep(), _cache(folder / "cache")]


def _result(folder: Path) -> Seed:
    run = a_run(4.0, 25.0)
    parts = {"measured": run.measured, "skeleton": geometry_to_dict(average_geometry(1.75))}
    write_result(folder, run.summary, run.series, model_to_dict(run.model), **parts)
    return Seed("result", _folder(folder), "result")


def _sweep() -> Seed:
    """A sweep that was begun, with its recordings; two of three runs have ended."""
    files = _folder(Path(__file__).parents[1] / "sweeps" / "begun" / "plain")
    here = files["sweep.toml"].replace(b"../../../../examples", EXAMPLES.as_posix().encode())
    return Seed("sweep", files | {"sweep.toml": here}, "sweep")


def _cache(folder: Path) -> Seed:
    Cache(folder).put("entry", {"time": np.arange(50.0), "track": np.zeros((50, 3)), "name": np.array("run")})
    return Seed("cache", _folder(folder), "cache")


def real(folder: Path) -> Iterator[Seed]:
    """Seeds from every file below ``folder`` that is no note: captures alone, others beside a capture."""
    motion = Tiny().bvh().encode()
    for path in sorted(folder.rglob("*.*")):
        if path.suffix in (".bvh", ".mvnx"):
            yield Seed(path.name, {path.name: path.read_bytes()}, "import", made=False)
        elif path.suffix == ".csv":
            lines = path.read_bytes().split(b"\n")
            content = b"\n".join([lines[0], *lines[1 :: _STEP if len(lines) > 1000 else 1]])
            yield Seed(path.name, {"motion.bvh": motion, path.name: content}, "import", made=False)


def _folder(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def cut(folder: Path) -> Seed:
    """A recording's first four seconds: enough to be read, short enough to be read ten thousand times."""
    files = _folder(folder)
    rows = {"gps.csv": 41, "insoles.csv": 401}
    for name, count in rows.items():
        files[name] = b"\n".join(files[name].split(b"\n")[:count]) + b"\n"
    head, _, frames = files["motion.bvh"].partition(b"Frame Time:")
    lines = frames.split(b"\n")
    announced = head[: head.rindex(b"Frames:")] + b"Frames: 240\n"
    files["motion.bvh"] = announced + b"Frame Time:" + b"\n".join(lines[:241]) + b"\n"
    return Seed(folder.name, files, "recording")
