"""Pictures of the guide, which each build of the site draws again from the bundled examples.

They are drawn on white.  The site's style turns them over on a dark page (``site.css``).
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import pandas as pd

mpl.use("agg")
import matplotlib.pyplot as plt

import sssi_exudyn
from sssi_exudyn import commands
from sssi_exudyn.reports import figures
from sssi_exudyn.reports.plots import COLOURS
from sssi_exudyn.reports.section import Drawing, Panels
from sssi_exudyn.reports.sections.curve_figures import figure_5, figure_8
from sssi_exudyn.reports.sections.muscles import muscles
from sssi_exudyn.reports.sections.track_figures import figure_6

EXAMPLES: Final = Path(__file__).parents[1] / "examples"
BEGINNER: Final = EXAMPLES / "beginner"
_DPI: Final = 110
_INCHES_OF_A_KEY: Final = 1.5
_WIDE: Final = (7.0, 3.6)
"""Inches of a picture of one pair of axes."""
_BONES: Final = (
    ("head_vertex", "head", "torso", "pelvis"),
    *(("pelvis", f"femur_{side}", f"tibia_{side}", f"talus_{side}") for side in "rl"),
    *((f"talus_{side}", f"calcn_{side}", f"toes_{side}", f"toe_tip_{side}") for side in "rl"),
    *(("torso", f"humerus_{side}", f"ulna_{side}", f"radius_{side}", f"hand_{side}") for side in "rl"),
)
"""Lines of a stick figure, through the labels of ``markers.trc``."""
_METRES_A_NEWTON: Final = 8e-4
"""Length of a force in a picture."""


def make_pictures(folder: Path) -> None:
    """Draw all pictures into ``folder``, from a fit of the whole run of the beginner."""
    run = sssi_exudyn.fit(BEGINNER)
    draw_recording(folder)
    draw_run(run, folder)
    draw_snow_and_laws(run, folder)
    draw_muscles(run, folder)
    draw_opensim(run, folder)
    draw_imports(folder)
    draw_sweep(folder)
    draw_skis(folder)


def save(folder: Path, name: str, draw: Callable[[Any], object], size: tuple[float, float] = _WIDE) -> None:
    """Save what ``draw`` draws on one pair of axes."""
    save_row(folder, name, (draw,), size)


def save_row(folder: Path, name: str, draws: Sequence[Callable[[Any], object]], size: tuple[float, float]) -> None:
    """Save pairs of axes side by side, each with its legend; the size is in inches."""
    figure, row = plt.subplots(1, len(draws), figsize=size, layout="constrained", squeeze=False)
    for draw, axes in zip(draws, row.flat, strict=True):
        draw(axes)
        if axes.get_legend_handles_labels()[0]:
            columns = max(2, int(size[0] / len(draws) / _INCHES_OF_A_KEY))
            axes.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=columns)
    figure.savefig(folder / f"{name}.png", dpi=_DPI)
    plt.close(figure)


def draw_recording(folder: Path) -> None:
    """Draw what the beginner's instruments measured, and the snow under the run."""
    sssi_exudyn.inspect(BEGINNER, folder / "inspect.png")
    commands.terrain(BEGINNER, None, folder / "terrain.png")


def draw_run(run: Any, folder: Path) -> None:
    """Draw the fitted run: track, loads, posture, moments, and the shares of friction's uncertainty."""
    save(folder, "track", lambda axes: figures.draw_track(run.stored, axes))
    save(folder, "loads", lambda axes: figures.draw_loads(run.stored, axes))
    save(folder, "from_above", lambda axes: draw_panel(figure_6([run.stored]), axes), (5.0, 6.0))
    save(folder, "angles", lambda axes: draw_panel(figure_5([run.stored]), axes))
    save(folder, "moments", lambda axes: draw_panel(figure_8([run.stored]), axes))
    save(folder, "budget", lambda axes: draw_budget(run, axes))


def draw_panel(section: Any, axes: Any) -> None:
    """Draw the first panel of a section's figure with its title and legend, which the report shows around it."""
    (block,) = [block for block in section.blocks if isinstance(block, Panels)]
    block.panels[0].draw(axes)
    axes.set_title(block.panels[0].title)
    for key in block.keys:
        colour = "black" if key.colour is None else COLOURS[key.colour]
        axes.plot([], [], key.style, color=colour, label=key.meaning)


def draw_budget(run: Any, axes: Any) -> None:
    """Draw the largest shares of the variance of friction along the ski."""
    shares = sorted(run.uncertainty.shares["mu_t"].items(), key=lambda part: part[1])[-8:]
    axes.barh([name for name, _ in shares], [100.0 * share for _, share in shares])
    axes.set(xlabel="share of the variance of μ_t (%)", title="beginner: where the uncertainty comes from")


def draw_snow_and_laws(run: Any, folder: Path) -> None:
    """Draw the speed of the same movement on other snow, and under a law of a plug-in."""
    recording = sssi_exudyn.read_recording(BEGINNER)
    short = replace(recording, stop=recording.start + 6.0)

    def speed(axes: Any, colour: str, label: str, **options: Any) -> None:
        series = sssi_exudyn.simulate(short, **options).series
        values = np.linalg.norm(series[[f"com_velocity_{axis}_mps" for axis in ("east", "north", "up")]], axis=1)
        axes.plot(series["time_s"], values, color=colour, label=label)

    def snows(axes: Any) -> None:
        for colour, mu_t in zip(COLOURS, (0.04, 0.08, 0.12), strict=False):
            speed(axes, colour, f"μ_t = {mu_t:.2f}", model=run.model.with_values({"friction.mu_t": mu_t}))
        axes.set(xlabel="time (s)", ylabel="speed (m/s)", title="the same movement on faster and slower snow")

    save(folder, "speeds", snows)
    law = sssi_exudyn.use_plugin(EXAMPLES / "my_snow.py")["WetSnow"]
    strengths = (0.0, 0.0005, 0.002)

    def friction(axes: Any) -> None:
        v = np.linspace(0.0, 10.0, 101)
        for colour, c in zip(COLOURS, strengths, strict=False):
            axes.plot(v, run.friction.mu_t.value + c * v**2, color=colour, label=f"c = {c:g} s²/m²")
        axes.set(xlabel="speed (m/s)", ylabel="friction over load", title="the law", ylim=(0.0, None))

    def wet(axes: Any) -> None:
        for colour, c in zip(COLOURS, strengths, strict=False):
            speed(axes, colour, f"c = {c:g} s²/m²", model=run.model, terms=[law(c=c)])
        axes.set(xlabel="time (s)", ylabel="speed (m/s)", title="the same movement under it")

    save_row(folder, "wet_snow", (friction, wet), (9.0, 3.4))


def draw_muscles(run: Any, folder: Path) -> None:
    """Draw the load of the joints over a turn, and the activation of the quadriceps."""
    blocks = muscles([sssi_exudyn.muscles(run).stored]).blocks
    _, over_turn, quadriceps = [block for block in blocks if isinstance(block, Drawing)]

    def loads(axes: Any) -> None:
        over_turn.draw(axes)
        axes.set_title("contact forces over a turn")

    def activation(axes: Any) -> None:
        quadriceps.draw(axes)
        axes.set_title("activation of the quadriceps")

    save_row(folder, "muscle_loads", (loads, activation), (9.0, 3.4))


def draw_opensim(run: Any, folder: Path) -> None:
    """Draw what the files for OpenSim hold: joint centres and the snow's force at one instant, and a knee's moment."""
    markers, forces = markers_of(run.opensim["markers.trc"]), _table(run.opensim["snow_forces.mot"])
    moments = _table(run.opensim["joint_moments.sto"])
    load = np.hypot(forces["right_snow_force_vy"], forces["right_snow_force_vz"])
    instant = float(forces["time"][load.idxmax()])

    def posture(axes: Any) -> None:
        _draw_skier(axes, _at(markers, instant))
        row = forces.iloc[(forces["time"] - instant).abs().idxmin()]
        middle = markers["pelvis"][int(np.argmin(np.abs(markers["time"] - instant))), 2]
        for side, colour in (("left", COLOURS[1]), ("right", COLOURS[0])):
            place, force = ([row[f"{side}_snow_force_{kind}{axis}"] for axis in "zy"] for kind in "pv")
            if not np.all(np.isfinite(place)):
                continue
            axes.annotate(
                "",
                xy=[at + _METRES_A_NEWTON * part for at, part in zip(place, force, strict=True)],
                xytext=place,
                arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.0},
            )
            axes.plot([], [], color=colour, label=f"{side}: {np.linalg.norm(force):.0f} N")
        axes.set(aspect="equal", xlabel="z, to the right (m)", ylabel="y, up (m)", xlim=(middle - 0.8, middle + 0.8))
        axes.set_title(f"markers.trc and snow_forces.mot at {instant:.2f} s", fontsize="medium")

    def knees(axes: Any) -> None:
        for side, colour in (("left", COLOURS[1]), ("right", COLOURS[0])):
            axes.plot(moments["time"], moments[f"knee_angle_{side[0]}_moment"], color=colour, label=side)
        axes.axvline(instant, color="0.5", linestyle=":")
        axes.set(xlabel="time (s)", ylabel="knee moment, extension positive (N m)")
        axes.set_title("joint_moments.sto", fontsize="medium")

    save_row(folder, "opensim", (posture, knees), (9.0, 4.6))


def markers_of(text: str) -> dict[str, Any]:
    """Return the markers of a ``.trc`` by label, (n, 3) m in OpenSim's axes, and ``"time"`` (n,) s."""
    lines = text.splitlines()
    labels = [label for label in lines[3].split("\t")[2:] if label]
    values = np.loadtxt(lines[6:], ndmin=2)
    places = values[:, 2:].reshape(len(values), len(labels), 3)
    return {"time": values[:, 1]} | {label: places[:, index] for index, label in enumerate(labels)}


def _at(markers: dict[str, Any], instant: float) -> dict[str, Any]:
    """Return the markers' places at one instant."""
    row = int(np.argmin(np.abs(markers["time"] - instant)))
    return {label: places[row] for label, places in markers.items() if label != "time"}


def _draw_skier(axes: Any, places: dict[str, Any]) -> None:
    """Draw a stick figure from behind."""
    for bone in _BONES:
        line = np.array([places[label] for label in bone])
        axes.plot(line[:, 2], line[:, 1], color="0.45", linewidth=3.0, solid_capstyle="round")


def _table(text: str) -> pd.DataFrame:
    """Return the columns of a ``.mot`` or a ``.sto``."""
    return pd.read_csv(io.StringIO(text.partition("endheader\n")[2]), sep="\t")


def draw_imports(folder: Path) -> None:
    """Draw what an import makes of files, how a day is split, and how bad records are left out."""
    save(folder, "import_files", draw_files, (8.0, 3.0))
    save(folder, "import_day", draw_day)
    save(folder, "import_places", draw_places, (5.2, 4.4))
    save(folder, "import_records", draw_records)


def draw_files(axes: Any) -> None:
    """Draw which files an import takes, and what comes of them."""
    taken = (
        "motion capture\n.bvh  .mvnx  .c3d  .trc  .mot",
        "or sensors, such as a phone\n.csv  .zip  .mp4",
        "fixes\n.gpx  .fit  .nmea  .tcx  .pos  .csv",
        "insoles, load cells in poles\nOpenGo, loadsol, pedar, .csv",
    )

    def box(text: str, left: float, width: float, middle: float, height: float, colour: str) -> None:
        axes.add_patch(plt.Rectangle((left, middle - 0.5 * height), width, height, fill=False, edgecolor=colour))
        axes.text(left + 0.015, middle, text, va="center", fontsize=9.0, linespacing=1.6)

    def arrow(start: tuple[float, float], end: tuple[float, float]) -> None:
        axes.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": "0.4"})

    for index, text in enumerate(taken):
        middle = 0.875 - 0.25 * index
        box(text, 0.0, 0.33, middle, 0.2, COLOURS[1])
        arrow((0.335, middle), (0.455, 0.5 + 0.1 * (1.5 - index)))
    box("a recording\nmotion.bvh or sensors\ngps.csv  insoles.csv\nrecording.toml", 0.46, 0.25, 0.5, 0.5, COLOURS[0])
    arrow((0.715, 0.5), (0.815, 0.5))
    axes.text(0.83, 0.5, "sssi inspect\nsssi run", va="center", fontsize=9.0, linespacing=1.7)
    axes.set(xlim=(-0.01, 1.0), ylim=(0.0, 1.0))
    axes.set_axis_off()


def draw_day(axes: Any) -> None:
    """Draw the height of a made-up day of three runs, coloured by what the program finds in it."""
    from sssi_exudyn.importing.days.descents import split_day

    time, flat, height = a_day()
    words = {"run": "a run", "lift": "lift", "pause": "pause"}
    colours = dict(zip(words, (COLOURS[0], COLOURS[1], "0.5"), strict=True))
    count = 0
    for piece in split_day(time, flat, height):
        part = slice(piece.first, piece.last + 1)
        axes.plot(time[part] / 60.0, height[part], color=colours[piece.kind], label=words.pop(piece.kind, None))
        if piece.kind == "run":
            count += 1
            middle = (piece.first + piece.last) // 2
            axes.text(time[middle] / 60.0 + 0.4, height[middle] + 20.0, f"run_{count:02d}", fontsize="small")
    axes.margins(x=0.08)
    axes.set(xlabel="time (min)", ylabel="altitude (m)", title="one track, three runs")


def a_day() -> tuple[Any, Any, Any]:
    """Return time (n,) s, place over ground (n, 2) m and altitude (n,) m of three lifts and runs, a fix a second."""
    legs = [(240.0, 0.0, 0.0), (420.0, 900.0, 250.0), (150.0, 0.0, 0.0), (110.0, -900.0, -250.0)]
    seconds = np.arange(0.0, 3.0 * sum(leg[0] for leg in legs))
    corners = np.cumsum([(0.0, 0.0, 0.0), *legs * 3], axis=0)
    along, up = (np.interp(seconds, corners[:, 0], corners[:, column]) for column in (1, 2))
    noise = np.random.default_rng(1).normal(0.0, 0.3, (3, len(seconds)))
    return seconds, np.stack([along, np.zeros_like(along)], axis=1) + noise[:2].T, 1800.0 + up + noise[2]


def draw_places(axes: Any) -> None:
    """Draw the places of sensors on the beginner's body, seen from behind."""
    run = sssi_exudyn.simulate(replace(sssi_exudyn.read_recording(BEGINNER), stop=0.5))
    places = _at(markers_of(run.opensim["markers.trc"]), 0.0)
    _draw_skier(axes, places)
    marks = {
        "helmet": places["head_vertex"],
        "chest": 0.5 * (places["torso"] + places["head"]),
        "pelvis": places["pelvis"],
        "pocket": 0.7 * places["femur_r"] + 0.3 * places["tibia_r"],
        **{f"{side}_boot": places[f"talus_{side[0]}"] for side in ("left", "right")},
        **{f"{side}_ski": places[f"toe_tip_{side[0]}"] for side in ("left", "right")},
    }
    middle = places["pelvis"][2]
    for name, (_, up, aside) in marks.items():
        left = name.startswith("left")
        axes.plot(aside, up, "s", color=COLOURS[0], markersize=7.0)
        axes.annotate(
            name,
            (aside, up),
            (middle - 0.6 if left else middle + 0.5, up),
            ha="right" if left else "left",
            va="center",
            arrowprops={"arrowstyle": "-", "color": "0.7", "linewidth": 0.8},
        )
    axes.set(xlim=(middle - 1.0, middle + 0.85), aspect="equal")
    axes.set_axis_off()


def draw_records(axes: Any) -> None:
    """Draw the beginner's fixes with four bad records among them, and what the program keeps of them."""
    with tempfile.TemporaryDirectory() as scratch:
        copy = sssi_exudyn.example("beginner", Path(scratch) / "beginner")
        written = pd.read_csv(copy / "gps.csv")
        kept_of_all = sssi_exudyn.read_recording(copy).gps
        assert kept_of_all is not None
        metres = np.array([111_320.0 * np.cos(np.radians(written["latitude_deg"].iloc[0])), 110_950.0])
        wrong = {20: (6.0, 40.0), 45: (4.0, -36.0), 46: (7.0, -37.0), 80: (-9.0, 45.0)}
        for row, shift in wrong.items():
            for name, degrees in zip(("longitude_deg", "latitude_deg"), np.array(shift) / metres, strict=True):
                written.loc[row, name] += degrees
        written.to_csv(copy / "gps.csv", index=False)
        kept = sssi_exudyn.read_recording(copy).gps
        assert kept is not None
    rows = list(wrong)
    places = kept_of_all.enu[rows, :2] + np.array(list(wrong.values()))
    axes.plot(*places.T, "x", color=COLOURS[0], markersize=9.0, label="left out")
    axes.plot(kept.enu[:, 0], kept.enu[:, 1], ".", color=COLOURS[1], label="used")
    axes.set(xlabel="east (m)", ylabel="north (m)")
    axes.set_title(f"{len(kept_of_all.time)} fixes, four of them wrong", fontsize="medium")


def draw_sweep(folder: Path) -> None:
    """Draw the mean speed over the lean of the skier on five kinds of snow, as the example's sweep computes it."""
    with tempfile.TemporaryDirectory() as scratch:
        swept = sssi_exudyn.sweep(EXAMPLES / "sweep_edge_angle.toml", Path(scratch) / "swept", workers=1)
        table = swept.table

    def lines(axes: Any) -> None:
        for colour, (mu_t, runs) in zip(COLOURS, table.groupby("friction.mu_t"), strict=True):
            runs = runs.sort_values("posture.pelvis_list_deg")
            axes.plot(
                runs["posture.pelvis_list_deg"], runs["mean_speed_mps"], "o-", color=colour, label=f"μ_t = {mu_t:g}"
            )
        axes.set(xlabel="additional lean to the right (°)", ylabel="mean speed (m/s)")

    save(folder, "sweep", lines)


def draw_skis(folder: Path) -> None:
    """Draw steady turns of two skis, and what a ski's bench tests give."""
    save(folder, "radii", draw_radii)
    tests = pd.read_csv(EXAMPLES / "bench" / "bending.csv")
    identified = sssi_exudyn.identify(EXAMPLES / "bench")
    line, curves = identified.bending, identified.ski.curves()

    def bending(axes: Any) -> None:
        force = np.array([0.0, tests["force_N"].max()])
        axes.plot(tests["force_N"], tests["deflection_mm"], ".", color=COLOURS[0], label="measured")
        axes.plot(force, 1e3 * (line.intercept + line.slope * force), color=COLOURS[1], label="fitted")
        axes.set(xlabel="force (N)", ylabel="deflection (mm)", title="bending test")

    def stiffness(axes: Any) -> None:
        axes.plot(1e3 * curves["ahead_of_boot_m"], curves["bending_stiffness_Nm2"], color=COLOURS[0], label="bending")
        axes.plot(1e3 * curves["ahead_of_boot_m"], curves["torsional_stiffness_Nm2"], color=COLOURS[1], label="torsion")
        axes.set(xlabel="ahead of the boot centre (mm)", ylabel="stiffness (N m²)", title="the ski that follows")

    save_row(folder, "bench", (bending, stiffness), (9.0, 3.4))


def draw_radii(axes: Any) -> None:
    """Draw the radius of two skis over the edge angle, with the bars of snow and posture."""
    skis = ("slalom_165", "volkl_kendo_184")
    rows = sssi_exudyn.turn(skis, "30:60:15")
    for ski in skis:
        edge, radius, low, high = (
            [row[key] for row in rows if row["ski"] == ski]
            for key in ("edge_deg", "radius_m", "radius_low_m", "radius_high_m")
        )
        axes.plot(edge, radius, marker="o", label=ski)
        axes.fill_between(edge, low, high, alpha=0.2)
    axes.set(xlabel="edge angle (°)", ylabel="radius (m)", title="steady turns at 700 N and 10 m/s")
