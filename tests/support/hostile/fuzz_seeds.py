"""Seeds of the fuzzer: recordings, files of every importable format, models, skis, results, sweeps, caches."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import numpy as np
import osim_example
import pandas as pd
import rasterio
import tomli_w
from a_diagnosis import whole_version
from a_run import a_run
from bvh_file import cmu, from_t_pose, rokoko
from c3d_file import marker_places, write_c3d, write_theia
from fix_files import START, fit, gnss_logger, gpx, nmea, phone, rtklib, ski_app, tcx
from gopro_file import film, payloads
from insole_files import EXPORTS
from mvnx_file import mvnx, orientations
from rasterio.transform import from_origin
from scipy.spatial.transform import Rotation
from strapped import write_few
from swinging import HEIGHT, chain_coordinates, mot
from tiny import ANSWERS, ORIGIN, TOML, Columns, Tiny, csv
from trc_file import joint_places, mediapipe, opencap, trc

from sssi_exudyn.bodies.ski.ski import read_ski, ski_to_table
from sssi_exudyn.bodies.skier.chain import average_geometry, forward_kinematics, geometry_to_dict
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.results.folder import ResultContent, write_result
from sssi_exudyn.runtime.cache import Arrays, Cache, fingerprint
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.plan import SweepRun
from sssi_exudyn.sweeps.records import DONE, Record, write_record
from sssi_exudyn.sweeps.workers.scheduler import Work
from sssi_exudyn.terrain.file import FILE, surface_bytes
from sssi_exudyn.terrain.surface import Surface

EXAMPLES = Path(__file__).parents[3] / "examples"
KNOWN = replace(ANSWERS, gps_offset_s=0.0)
PLACED = {"left_ski.csv": "left_ski=", "right_ski.csv": "right_ski=", "foot.csv": "insoles="}
"""Files that are imported under a place, and the text of that place."""
KEY = fingerprint("entry")
"""Key of the cache's entry."""
_FRAMES = 90
"""Number of a capture's frames: enough to be read, and few enough to be read ten thousand times."""
_STEP = 10
"""Step between the lines that are kept of real tables, which are long."""


@dataclass(frozen=True)
class Seed:
    """Whole files and their use: a recording is read, others are imported first."""

    name: str
    files: dict[str, bytes]
    kind: str
    """One of ``fuzz_uses.USES``."""
    made: bool = True
    """Whether it was made here, so that it is whole; files from elsewhere may be refused as they are."""
    weight: float = 1.0
    """How often it is drawn: slow ones less often."""


def bundled(folder: Path) -> list[Seed]:
    """Return seeds from the examples and from made files of every format.

    ``folder`` is for files that have to be written.
    """
    tiny = Tiny()
    tiny.rotations = {name: angles[:_FRAMES] for name, angles in tiny.rotations.items()}
    tiny.gps = {name: column[: _FRAMES // 6] for name, column in tiny.gps.items()}
    tiny.insoles = {name: column[: _FRAMES * 5 // 6] for name, column in tiny.insoles.items()}
    small = _folder(tiny.write(folder / "tiny"))
    few = _folder(write_few(read_recording(EXAMPLES / "intermediate"), ("left_ski", "right_ski"), folder / "few"))
    few = {name: _head(data, 400 if name.startswith("sensors") else 40) for name, data in few.items()}
    read = [
        cut(EXAMPLES / "beginner", _FRAMES),
        cut(EXAMPLES / "intermediate", _FRAMES),
        Seed("tiny", small, "recording"),
        Seed("few", few, "recording", weight=0.1),
        Seed("terrain", _with_elevations(small, folder / "dem"), "recording", weight=0.3),  # it needs a process
    ]
    imported = list(_imports(tiny, few, folder))
    return [
        *read,
        *imported,
        *(replace(seed, kind=f"{seed.kind} to fit", weight=0.2 * seed.weight) for seed in (*read, *imported)),
        *_readers(tiny.gps),
        *_settings(),
        *_results(folder, small),
        *_sweeps(folder / "sweep", small),
        _cache(folder / "cache"),
    ]


def _with_elevations(recording: dict[str, bytes], folder: Path) -> dict[str, bytes]:
    """Return the recording with an elevation model of a level ground around its start."""
    folder.mkdir()
    latitude, longitude, altitude = ORIGIN
    step, size = 2e-5, 160
    with rasterio.open(
        folder / "dem.tif", "w", driver="GTiff", height=size, width=size, count=1, dtype="float32", crs="EPSG:4326",
        transform=from_origin(longitude - step * size / 2, latitude + step * size / 2, step, step),
    ) as dataset:  # fmt: skip
        dataset.write(np.full((size, size), altitude, dtype="float32"), 1)
    table = b'\n[terrain]\nfile = "dem.tif"\ndatum = "other"\n'
    added = {"recording.toml": recording["recording.toml"] + table, "dem.tif": (folder / "dem.tif").read_bytes()}
    return recording | added


def _imports(tiny: Tiny, few: dict[str, bytes], folder: Path) -> Iterator[Seed]:
    """Yield a file of every format that is imported, alone or with a capture."""
    poses = forward_kinematics(average_geometry(HEIGHT), chain_coordinates(), 0.0)
    write_c3d(folder / "run.c3d", marker_places(poses, HEIGHT), 60.0)
    write_theia(folder / "theia.c3d", poses, 60.0)
    for name, content in (
        ("run.mvnx", mvnx(orientations(75), began=START.timestamp()).encode()),
        ("run.mot", mot(chain_coordinates()).encode()),
        ("run.c3d", (folder / "run.c3d").read_bytes()),
        ("theia.c3d", (folder / "theia.c3d").read_bytes()),
    ):
        yield Seed(name, {name: content}, "import", weight=0.2 if name.endswith(".c3d") else 1.0)  # it needs a process
    counts = "".join(f"{0.02 * i:.2f},{side},{500 + i % 9},{400 - i % 7}\n" for i in range(100) for side in "LR")
    for name, content in (
        ("track.gpx", gpx(tiny.gps).encode()),
        ("track.nmea", nmea(tiny.gps).encode()),
        ("Location.csv", phone(Tiny().gps, bearing=-1.0).encode()),
    ):
        yield Seed(name, {"motion.bvh": tiny.bvh().encode(), name: content}, "import")
    watch = fit({name: column[::10] for name, column in Tiny().gps.items()})  # a fix a second needs all of the capture
    yield Seed("watch.fit", {"motion.bvh": Tiny().bvh().encode(), "watch.fit": watch}, "import", weight=0.3)
    sensors = {name.removeprefix("sensors/"): data for name, data in few.items() if name.startswith("sensors")}
    sensors |= {"gps.csv": few["gps.csv"], "foot.csv": f"t_s,side,heel_adc,toe_adc\n{counts}".encode()}
    yield Seed("single sensors", sensors, "import", weight=0.1)


def _readers(track: Columns) -> Iterator[Seed]:
    """Yield files whose readers are used alone, which takes milliseconds, and a day's track."""
    time = np.arange(0.0, 3.0, 0.02)
    sensor = np.column_stack([np.sin(time), np.cos(time), 9.0 + time])
    parts = payloads({name: column[:15] for name, column in track.items()}, time, sensor, sensor, own_clock=False)
    newer = payloads({name: column[:15] for name, column in track.items()}, time, sensor, sensor)
    poses = forward_kinematics(average_geometry(HEIGHT), chain_coordinates()[:_FRAMES], 0.0)
    places, turned = joint_places(poses), from_t_pose(poses)
    for name, content in {
        "watch.tcx": tcx(track).encode(),
        "day.skiz": ski_app(track, ".skiz"),
        "day.slopes": ski_app(track, ".slopes"),
        "gnss_log.txt": gnss_logger(track).encode(),
        "run.pos": rtklib(track).encode(),
        "minutes.pos": rtklib(track, "minutes").encode(),
        "film.mp4": film(parts),
        "telemetry.gpmf": b"".join(newer),
        "imu.sto": _orientations(time).encode(),
        "run.trc": trc(mediapipe(places), 60.0).encode(),
        "study.trc": trc(opencap(places), 60.0).encode(),
        "rokoko.bvh": rokoko(turned, 60.0).encode(),
        "cmu.bvh": cmu(turned, 60.0).encode(),
        "cmu_joints.bvh": cmu(turned, 60.0, by_joints=True).encode(),
        **{name: _head(text.encode(), 60) for name, text in EXPORTS.items()},
    }.items():
        yield Seed(name, {name: content}, "reader", weight=0.3)
    share = np.r_[np.linspace(0.0, 1.0, 60), np.linspace(1.0, 0.0, 20)]
    height = np.tile(share, 2)
    day = {"time_s": 5.0 * np.arange(len(height)), "latitude_deg": 46.8 + 0.007 * height,
           "longitude_deg": 9.8 + 0.001 * height, "altitude_m": 1800.0 + 130.0 * height}  # fmt: skip
    yield Seed("day.tcx", {"day.tcx": tcx(day).encode()}, "day", weight=0.3)
    yield Seed("day.gpx", {"day.gpx": gpx(day).encode()}, "day", weight=0.3)


def _orientations(time: Array) -> str:
    """Return OpenSense's orientations of two sensors that swing."""
    swing = np.column_stack([np.sin(time), 0.3 * np.cos(3.0 * time), 0.2 * np.sin(2.0 * time)])
    cells = [[",".join(f"{part:.6f}" for part in row) for row in Rotation.from_rotvec(sign * swing).as_quat().tolist()]
             for sign in (1.0, -0.5)]  # fmt: skip
    rows = ["\t".join([f"{moment:.3f}", *pair]) for moment, *pair in zip(time.tolist(), *cells, strict=True)]
    return "DataType=Quaternion\nendheader\ntime\tcalcn_l_imu\ttorso_imu\n" + "\n".join(rows) + "\n"


def _settings() -> Iterator[Seed]:
    """Yield models, skis and bench tests alone, and OpenSim's models."""
    model = tomli_w.dumps(model_to_dict(a_run(1.0, 25.0).model)).encode()
    yield Seed("model", {"model.toml": model}, "model")
    on_hill = replace(a_run(1.0, 25.0).model, surface=_surface())
    files = {"model.toml": tomli_w.dumps(model_to_dict(on_hill)).encode(), FILE: surface_bytes(_surface())}
    yield Seed("model on a surface", files, "model")
    own = {"own": ski_to_table(read_ski("slalom_165", "."))}
    yield Seed("ski", {"own.toml": tomli_w.dumps(own).encode()}, "ski")
    yield Seed("bench", _bench(), "bench")
    for name, text in (("3.osim", osim_example.version_3()), ("4.osim", osim_example.version_4())):
        yield Seed(name, {name: text.encode()}, "osim")
    names = ("wind", "nothing")
    truth = {name: {"name": "wind", "kind": "physics"} for name in names}
    files = {"recordings/truth.json": to_json(truth).encode()}
    for name in names:
        files[f"recordings/{name}/recording.toml"] = TOML.encode()
        files[f"diagnosed/{name}/diagnosis.json"] = to_json(whole_version()).encode()
    yield Seed("truth", files, "truth")


def _surface() -> Surface:
    """Return a surface of two modes."""
    grid = np.linspace(-0.2, 0.3, 30).reshape(6, 5)
    return Surface((-3.0, -4.0), 2.0, grid, np.full((6, 5), 0.1), np.stack([grid, -grid]), (0.5, -1.0))


def _bench() -> dict[str, bytes]:
    """Return tests of a ski; their result does not matter."""
    place = np.linspace(0.0, 1650.0, 40)
    time = np.arange(0.0, 0.5, 0.002)
    force = np.linspace(20.0, 200.0, 10)
    tables = {
        "scan.csv": {
            "from_tail_mm": place,
            "width_mm": 80.0 + 0.02 * np.abs(place - 825.0),
            "thickness_mm": 15.0 - 0.01 * np.abs(place - 825.0),
            "height_mm": 0.0 * place,
        },
        "bending.csv": {"force_N": force, "deflection_mm": 0.1 * force},
        "vibration.csv": {"time_s": time, "signal": np.exp(-3.0 * time) * np.cos(90.0 * time)},
    }
    settings = {
        "name": "bench",
        "mass_kg": 1.75,
        "mass_sigma_kg": 0.005,
        "boot_centre_m": 0.76,
        "scan": {"file": "scan.csv", "thickness_sigma_mm": 0.05},
        "bending": {"file": "bending.csv", "left_m": 0.33, "load_m": 0.8, "right_m": 1.3},
        "vibration": {"file": "vibration.csv"},
    }
    return {
        "bench.toml": tomli_w.dumps(settings).encode(),
        **{name: csv(columns).encode() for name, columns in tables.items()},
    }


def _results(folder: Path, recording: dict[str, bytes]) -> Iterator[Seed]:
    """Yield a result with all its files, for the report on screen and on paper, the muscles, and the validation."""
    run = a_run(2.0, 12.5)
    simple_content = ResultContent(
        run.summary,
        run.series,
        model_to_dict(run.model),
        measured=run.measured,
        skeleton=geometry_to_dict(average_geometry(1.75)),
        turns=run.turn_table,
    )
    half = pd.DataFrame({"time_s": [0.0, 1.0], "measured_mps": [9.0, 9.5], "predicted_mps": [9.1, 9.4]})
    write_result(folder / "simple", simple_content)
    write_result(folder / "whole", replace(simple_content, diagnosis=whole_version(), second_half=half))
    simple = _folder(folder / "simple")
    whole = _folder(folder / "whole")
    both = {f"result/{name}": data for name, data in simple.items()}
    both |= {f"recording/{name}": data for name, data in recording.items()}
    yield Seed("result", whole, "result", weight=2.0)
    yield Seed("result", whole, "report", weight=0.1)
    yield Seed("result", whole, "report on paper", weight=0.03)
    yield Seed("result", simple, "muscles", weight=0.02)
    yield Seed("result", both, "validate", weight=0.1)


def _sweeps(folder: Path, recording: dict[str, bytes]) -> Iterator[Seed]:
    """Yield a sweep's file, and a sweep of which two of three runs have ended, both with their recording."""
    files = _folder(begun_sweep(folder, recording))
    yield Seed("sweep", files, "sweep")
    alone = {name: data for name, data in files.items() if name.startswith("recording/") or name == "sweep.toml"}
    yield Seed("sweep.toml", alone, "sweep file")


def begun_sweep(folder: Path, recording: dict[str, bytes]) -> Path:
    """Write a sweep's folder with its recording in it.

    Of three runs the first one's record is gathered, the second one's not yet.
    """
    (folder / "recording").mkdir(parents=True)
    for name, data in recording.items():
        (folder / "recording" / name).write_bytes(data)
    friction = {"name": "friction.mu_t", "values": [0.05, 0.08, 0.11]}
    file = {"format": 1, "name": "begun", "recordings": [str(folder / "recording")], "parameter": [friction]}
    keys: list[str] = []

    def end_one(work: Work, runs: Iterable[SweepRun], *_: object) -> None:
        """Take the place of a sweep's workers."""
        keys.extend(run.key for run in runs)
        write_record(work.folder, _record(keys[0]))

    with mock.patch.object(sweeps, "do_all", end_one):
        sweeps.sweep(file, folder, workers=1)
    write_record(folder, _record(keys[1]))
    (folder / ".lock").unlink(missing_ok=True)
    return folder


def _record(key: str) -> Record:
    return Record(key, 0, DONE, "", {}, 1.0, 1.0, 7, 300.0, 1.7e9, 1.7e9 + 1.0)


def entry() -> Arrays:
    """Return the arrays that the cache keeps under ``KEY``."""
    return {"time": np.arange(50.0), "track": np.zeros((50, 3)), "name": np.array("run")}


def _cache(folder: Path) -> Seed:
    Cache(folder).put(KEY, entry())
    return Seed("cache", _folder(folder), "cache")


def real(folder: Path) -> Iterator[Seed]:
    """Yield seeds from every file below ``folder`` that is not a note: captures alone, others with a capture."""
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


def _head(data: bytes, lines: int) -> bytes:
    return b"\n".join(data.split(b"\n")[:lines]) + b"\n"


def cut(folder: Path, frames: int = 240) -> Seed:
    """Return a recording's first ``frames``, by default four seconds."""
    files = _folder(folder)
    for name, every in (("gps.csv", 6.0), ("insoles.csv", 0.6)):
        files[name] = _head(files[name], round(frames / every) + 1)
    head, _, rest = files["motion.bvh"].partition(b"Frame Time:")
    announced = head[: head.rindex(b"Frames:")] + b"Frames: %d\n" % frames
    files["motion.bvh"] = announced + b"Frame Time:" + _head(rest, frames + 1)
    return Seed(folder.name, files, "recording")
