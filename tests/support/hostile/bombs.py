"""Files that look small or plain but cost a careless reader all memory, all time, or a fault.

Each is named after its content.  Those of a recording replace files of the small made-up one (``tiny``); others are
imported together with its capture.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pymap3d
from mvnx_file import mvnx, orientations
from swinging import chain_coordinates, mot
from tiny import TOML, Tiny, csv

from sssi_exudyn.core.frames import GRAVITY, Array

DEEP = 50_000
"""Number of parts, brackets or digits: beyond every recursion and every square."""
ANSI = "\x1b[31mred\x1b[0m \u202egnp.exe"


@dataclass(frozen=True)
class Bomb:
    """A hostile case.

    ``files`` are by name; ``taken`` is true where the program may take them; ``imports`` are the arguments of ``sssi
    import``.
    """

    name: str
    files: Mapping[str, bytes]
    imports: tuple[str, ...] = ()
    taken: bool = False
    special: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)

    @property
    def large(self) -> bool:
        """Whether reading it takes long."""
        return sum(map(len, self.files.values())) > 1_000_000

    def write(self, folder: Path) -> Path:
        """Write the files over those of the small recording; return the folder."""
        folder.mkdir(parents=True)
        for name, data in _small().items():
            (folder / name).write_bytes(data)
        for name, data in self.files.items():
            (folder / name).write_bytes(data)
        for name, make in self.special.items():
            (folder / name).unlink(missing_ok=True)
            make(folder / name)
        return folder


@cache
def _small() -> dict[str, bytes]:
    """Return the small recording, made once."""
    tiny = Tiny()
    texts = {
        "recording.toml": TOML,
        "motion.bvh": tiny.bvh(),
        "gps.csv": csv(tiny.gps),
        "insoles.csv": csv(tiny.insoles),
    }
    return {name: text.encode() for name, text in texts.items()}


def _toml(old: str, new: str) -> dict[str, bytes]:
    assert old in TOML
    return {"recording.toml": TOML.replace(old, new).encode()}


def _own_ski(table: str) -> dict[str, bytes]:
    return _toml('"slalom_165"', '"own.toml"') | {"own.toml": table.encode()}


def _track(time: Array) -> bytes:
    """Return a plausible track of 60 m at any times."""
    path = np.linspace(0.0, 60.0, len(time))
    lat, lon, alt = pymap3d.enu2geodetic(0.9 * path, 0.4 * path, -0.27 * path, 46.8, 9.8, 2000.0)
    rows = zip(time.tolist(), lat.tolist(), lon.tolist(), alt.tolist(), strict=True)
    body = "".join(f"{t!r},{la:.9f},{lo:.9f},{al:.4f}\n" for t, la, lo, al in rows)
    return f"time_s,latitude_deg,longitude_deg,altitude_m\n{body}".encode()


def _loads(time: Array) -> bytes:
    rows = "".join(f"{t!r},{300 + i % 7},{400 - i % 5}\n" for i, t in enumerate(time.tolist()))
    return f"time_s,left_N,right_N\n{rows}".encode()


def _counts(step: float) -> bytes:
    rows = "".join(f"{step * i!r},{side},{500 + i % 9}\n" for i in range(200) for side in "LR")
    return f"t_s,side,heel_adc\n{rows}1.5,L,1\n1.5,R,1\n".encode()


def _log() -> bytes:
    """Return the log of a sensor that trembles."""
    time = np.arange(0.0, 2.0, 0.02)
    channels = {f"{kind}{axis}": np.sin(time * (3.0 + k)) for kind in "ag" for k, axis in enumerate("xyz")}
    channels["az"] += GRAVITY
    return csv({"t_s": time, **channels}).encode()


def _points(text: str) -> bytes:
    return f'<?xml version="1.0"?><gpx><trk><trkseg>{text}</trkseg></trk></gpx>'.encode()


def _gap_bombs() -> list[Bomb]:
    dense = np.arange(100) * 1e-8
    gap = np.r_[dense, 0.2 + dense]
    slow = np.r_[np.arange(100) * 1e-7, 0.9 + np.arange(100) * 1e-7, 1.8]
    rows = mot(chain_coordinates()).split("\n")
    head, body = rows[:7], [row.split("\t", 1)[1] for row in rows[7:] if row]
    times = [i * 1e-9 for i in range(60)] + [0.9 + i * 1e-9 for i in range(len(body) - 60)]
    sparse = mvnx(orientations(90), index=[*range(45), *range(10**9, 10**9 + 45)])
    return [
        Bomb("gps 1e-8 s apart with a gap", {"gps.csv": _track(gap)}),
        Bomb("gps with the smallest step there is", {"gps.csv": _track(np.r_[np.arange(60) * 5e-324, 0.5, 1.0])}),
        Bomb("insoles 1e-7 s apart with gaps", {"insoles.csv": _loads(slow)}),
        Bomb("insoles with the smallest step", {"insoles.csv": _loads(np.r_[np.arange(60) * 5e-324, 0.9, 1.8])}),
        Bomb("mot 1e-9 s apart with a gap", {
            "run.mot": "\n".join([*head, *(f"{t!r}\t{row}" for t, row in zip(times, body, strict=True)), ""]).encode()
        }, ("run.mot",)),
        Bomb("mvnx with a gap of months", {"run.mvnx": sparse.encode()}, ("run.mvnx",)),
        Bomb("mvnx with indices of 4000 digits", {
            "run.mvnx": mvnx(orientations(90)).replace('index="7"', f'index="{"7" * 4000}"').encode()
        }, ("run.mvnx",)),
        *(
            Bomb(
                f"counts {step} s apart",
                {"foot.csv": _counts(step), "ski.csv": _log()},
                ("left_ski=ski.csv", "right_ski=ski.csv", "gps.csv", "insoles=foot.csv"),
            )
            for step in (1e-7, 1e-9, 0.0)
        ),
    ]  # fmt: skip


def _text_bombs() -> list[Bomb]:
    dots = ".".join(["a"] * 40_000)
    lines = "\n".join(".".join(["a"] * 2000) + str(i) + " = 1" for i in range(200))
    ski = "[mine]\nsource = "
    return [
        Bomb("dotted key", {"recording.toml": f"{TOML}\n{dots} = 1\n".encode()}),
        Bomb("dotted table", {"recording.toml": f"{TOML}\n[{dots}]\n".encode()}),
        Bomb("many dotted keys", {"recording.toml": f"{TOML}\n{lines}\n".encode()}),
        Bomb("key of 90 kB", {"recording.toml": f'"{"k" * 90_000}" = 1\n{TOML}'.encode()}),
        Bomb("brackets", {"recording.toml": b"x = " + b"[" * DEEP}),
        Bomb("nested arrays", {"recording.toml": b"x = " + b"[" * 300 + b"]" * 300 + b"\n" + TOML.encode()}),
        Bomb("number of 5000 digits", _toml("mass_kg = 70.0", f"mass_kg = {'7' * 5000}")),
        Bomb("number of 400 digits", _toml("mass_kg = 70.0", f"mass_kg = {'7' * 400}")),
        Bomb("hexadecimal of 90 kB", _toml("mass_kg = 70.0", f"mass_kg = 0x{'f' * 90_000}")),
        Bomb("nan", _toml("mass_kg = 70.0", "mass_kg = nan")),
        Bomb("name with commands", _toml('"tiny"', f'"{ANSI}"'.replace("\x1b", "\\u001b")), taken=True),
        Bomb("name of 90 kB", _toml('"tiny"', f'"{"n" * 90_000}"'), taken=True),
        Bomb("name of mathematics", _toml('"tiny"', "'$ \\frac{$'"), taken=True),
        Bomb("joint with commands", _toml('"Spine2"', '"\\u001b[2J\\n\\u202e"')),
        Bomb("ski that does not exist", _toml('"slalom_165"', '"slalom"')),
        Bomb("ski of dotted keys", _own_ski(f"[mine]\n{dots} = 1\n")),
        Bomb("ski nested", _own_ski(ski + "[" * 200 + "]" * 200)),
        Bomb("ski of a huge number", _own_ski(f"[mine]\nlength_m = {'9' * 400}\n")),
        Bomb("ski of arrays", _own_ski("[mine.width]\ns = [" + "0.5,\n" * 150_000 + "]\n")),
    ]  # fmt: skip


def _table_bombs() -> list[Bomb]:
    tiny = Tiny()
    bvh = tiny.bvh()
    negative = {name: column if name == "time_s" else -column for name, column in tiny.insoles.items()}
    insoles = csv(tiny.insoles)
    ended = bvh.replace("End Site\n{", "End Site\n{\nEnd Site\n{", 1)
    return [
        *(
            Bomb(
                f"cell number of {digits} digits",
                {"insoles.csv": insoles.replace("left_2_N", f"left_{'2' * digits}_N").encode()},
            )
            for digits in (90, 400, 5000)
        ),
        Bomb("forces that pull", {"insoles.csv": csv(negative).encode()}),
        Bomb("column of 90 kB", {"insoles.csv": insoles.replace("left_2_N", "c" * 90_000).encode()}),
        Bomb("column with commands", {"gps.csv": csv(tiny.gps).replace("altitude_m", ANSI).encode()}),
        Bomb("one endless line", {"gps.csv": b"1," * 20_000_000}),
        Bomb("endless lines", {"gps.csv": b"1\n" * 20_000_000}),
        Bomb("endless columns", {"insoles.csv": b"a," * 40_000 + b"\n" + b"1," * 40_000}),
        Bomb("end site before the root", {"motion.bvh": b"HIERARCHY\nEnd Site\n{\nOFFSET 0 0 0\n}\n" + bvh.encode()}),
        Bomb("end site in an end site", {"motion.bvh": ended.encode()}),
        Bomb("infinitely many frames", {"motion.bvh": bvh.replace("Frames: 481", "Frames: inf").encode()}),
        Bomb("1e300 frames", {"motion.bvh": bvh.replace("Frames: 481", "Frames: 1e300").encode()}),
        Bomb("arm of 1e300", {"motion.bvh": bvh.replace("OFFSET -25.0 0.0 0.0", "OFFSET -1e300 0.0 0.0").encode()}),
        Bomb("arm of 50 m", {"motion.bvh": bvh.replace("OFFSET -25.0 0.0 0.0", "OFFSET -5000 0.0 0.0").encode()}),
        Bomb("joint of 90 kB", {"motion.bvh": bvh.replace("Neck1", "N" * 90_000).encode()}),
        Bomb("joint with commands", {"motion.bvh": bvh.replace("RightHand", ANSI).encode()}),
        Bomb("channel of 1e300", {"motion.bvh": bvh.rstrip("\n").rsplit(" ", 1)[0].encode() + b" 1e300\n"}),
    ]  # fmt: skip


def _markup_bombs() -> list[Bomb]:
    long = ">a" * 4_000_000
    shapes = {
        "comment": f"<!--{long}-->",
        "instruction": f"<?a {long}?>",
        "attribute": f'<trkpt lat="{long}"/>',
        "tag": f"<trkpt {'a' * 4_000_000}/>",
        "text": f"<trkpt>{'1 ' * 8_000_000}</trkpt>",
        "elements": "<a/>" * 1_100_000,
        "nesting": "<a>" * 60_000,
        "attributes": '<a b="" c="" d=""/>' * 300_000,
        "comments": ("<!--" + ">a" * 90_000 + "-->\n<a/>") * 100,
    }
    bombs = [
        Bomb(f"gpx: {name}", {"track.gpx": _points(shape)}, ("motion.bvh", "track.gpx"))
        for name, shape in shapes.items()
    ]
    bombs += [
        Bomb(f"mvnx: {name}", {"run.mvnx": f'<mvnx><subject frameRate="60">{shapes[name]}</subject></mvnx>'.encode()},
             ("run.mvnx",))
        for name in ("comment", "attribute", "text")
    ]  # fmt: skip
    return bombs


def _special_bombs() -> list[Bomb]:
    kinds = {"pipe": os.mkfifo, "device": lambda path: path.symlink_to("/dev/zero"), "folder": Path.mkdir}
    named = (
        ("recording.toml", ()),
        ("gps.csv", ()),
        ("motion.bvh", ("motion.bvh",)),
        *((name, ("motion.bvh", name)) for name in ("gps.csv", "insoles.csv", "t.gpx", "t.fit", "t.nmea")),
        *((name, (name,)) for name in ("r.mvnx", "r.mot", "r.c3d")),
    )
    return [
        Bomb(f"{kind} as {name}" + (", imported" if imports else ""), {}, imports, special={name: make})
        for kind, make in kinds.items()
        for name, imports in named
    ]


def bombs() -> list[Bomb]:
    """Return all hostile cases."""
    return [*_gap_bombs(), *_text_bombs(), *_table_bombs(), *_markup_bombs(), *_special_bombs()]
