"""A run as numbers that a page can replay: places of skeleton and skis, and forces, a few times a second.

Everything is in the level frame (x along the fall line's azimuth, y left, z up; see ``frames``), counted from the start
of the centre of mass.  The page's script draws it; here it is only sampled and packed.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.integrate import cumulative_trapezoid

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.bodies.skier.boot import ski_on_foot
from sssi_exudyn.bodies.skier.chain import (
    COORDINATES,
    FEET,
    PARENT,
    SEGMENT,
    SEGMENTS,
    TRANSLATIONS,
    Geometry,
    Poses,
    forward_kinematics,
)
from sssi_exudyn.core.frames import GRAVITY, Array, level_to_enu, slope_to_level
from sssi_exudyn.model.model import Model
from sssi_exudyn.reports.section import Markup, Runs, Section
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.simulation.result import SIDES

RATE: Final = 20.0
"""Frames a second; the page interpolates between them.  A hand that swings 0.3 m twice a second is then drawn up to 15
mm off.
"""
STATIONS: Final = (0.0, 0.04, 0.2, 0.35, 0.5, 0.65, 0.8, 0.93, 0.97, 1.0)
"""Cross-sections drawn of each ski, from tail to tip, closer where tail and shovel turn up."""
_SPEEDS: Final = ("0.1", "0.25", "0.5", "1", "2")
"""Speeds of the replay; 1 is real time."""
_KEY: Final = "".join(
    f'<span><i style="background:var(--{colour})"></i>{word}</span> '
    for colour, word in (
        ("c1", "right"),
        ("c2", "left"),
        ("c3", "force of the snow"),
        ("ink", "weight"),
        ("c4", "air"),
        ("path", "path of the centre of mass"),
        ("ink", "poles, drawn as carried"),
    )
)
_TOGETHER: Final = (
    '<p class="together" hidden><button type="button">Play together</button>\n'
    '<input type="range" min="0" max="1" step="any" value="0" aria-label="time since each start"></p>\n'
)
"""Controls of several replays at once: the same time since each start, at the speed of the first replay."""
_LEAVES: Final = tuple(i for i in range(len(SEGMENTS)) if i not in PARENT)
"""Segments that carry no other: head, hands and toes are drawn to their far end."""
_BULK: Final = {"pelvis": 0.1, "torso": 0.09, "femur": 0.075, "tibia": 0.055, "humerus": 0.045, "ulna": 0.04}
"""Half the thickness drawn (m), to distinguish trunk and limbs; ``_THIN`` for all others."""
_THIN: Final = 0.035
POLE: Final = 0.7
"""Length of a pole over the skier's height, as shops advise for alpine skiing."""


_REACH: Final = 16.0
"""m of snow drawn around the path."""
_CELL: Final = 2.0
"""m between heights of the snow, where there are at most ``_MOST`` of them."""
_MOST: Final = 40_000
_EVEN: Final = 1e-3
"""m; deviation from the plane below which the snow is drawn as a plane."""


@dataclass(frozen=True)
class Hill:
    """Heights of the snow straight above the slope's plane, level frame.

    The heights are (a, b) m every ``spacing`` (m) down the fall line's azimuth and to its left, the first at ``corner``
    (2,) m.
    """

    corner: Array
    spacing: float
    heights: Array


@dataclass(frozen=True)
class Replay:
    """n frames of a run in the level frame, metres and newtons.

    time : (n,) s, the recording's clock
    com : (n, 3) centre of mass
    joints : (n, 21, 3) origins of the segments
    ends : (n, k, 3) far ends of the segments that carry no other
    skis : (n, 2, stations, 2, 3) left and right ski, from tail to tip, left and right edge of the running surface
    feet : (n, 2, 3) points where friction acts
    snow : (n, 2, 3) N, the snow's force on each ski
    air : (n, 3) N
    hill : heights of the snow; None where it is its plane
    """

    time: Array
    com: Array
    joints: Array
    ends: Array
    skis: Array
    feet: Array
    snow: Array
    air: Array
    hill: Hill | None = None


def poses_of(series: pd.DataFrame, geometry: Geometry, inclination: float) -> Poses:
    """Compute the poses of all segments in the slope frame at every row of a result's time series."""
    free = [f"{name}_m" for name in TRANSLATIONS]
    turning = [f"{name}_deg" for name in COORDINATES[len(TRANSLATIONS) :]]
    q = np.hstack([series[free].to_numpy(dtype=float), np.radians(series[turning].to_numpy(dtype=float))])
    return forward_kinematics(geometry, q, inclination)


def replay_of(series: pd.DataFrame, geometry: Geometry, model: Model, rate: float = RATE) -> Replay:
    """Return the run of ``series`` at ``rate`` frames a second: the rows nearest to evenly spaced times."""
    clock = series["time_s"].to_numpy(dtype=float)
    frames = np.linspace(clock[0], clock[-1], max(2, round((clock[-1] - clock[0]) * rate) + 1))
    middles = 0.5 * (clock[1:] + clock[:-1])
    rows = series.iloc[np.unique(np.searchsorted(middles, frames))]
    poses = poses_of(rows, geometry, model.inclination)
    level, from_enu = slope_to_level(model.inclination), level_to_enu(model.fall_line_azimuth).T

    def vectors(name: str, unit: str) -> Array:
        columns = [f"{name}_{axis}_{unit}" for axis in ("east", "north", "up")]
        return np.asarray(rows[columns].to_numpy(dtype=float) @ from_enu.T)

    com = vectors("com", "m")
    start = com[0]
    feet = np.stack([vectors(f"{side}_foot", "m") for side in SIDES], axis=1)
    friction = np.stack([vectors(f"{side}_friction", "N") for side in SIDES], axis=1)
    load = rows[[f"{side}_load_N" for side in SIDES]].to_numpy(dtype=float)
    ends = poses.origin + np.einsum("nsij,sj->nsi", poses.rotation, geometry.segment_end)
    bent = rows[[f"{side}_{end}_deflection_m" for side in SIDES for end in ("tip", "tail")]].to_numpy(dtype=float)
    on_foot = _edges(model.ski, bent.reshape(-1, 2, 2))
    ski_rotation = ski_on_foot(model.equipment.ramp_angle)
    skis = np.einsum("nfij,nfsej->nfsei", level @ poses.rotation[:, list(FEET)] @ ski_rotation, on_foot)
    return Replay(
        time=rows["time_s"].to_numpy(dtype=float),
        com=com - start,
        joints=poses.origin @ level.T - start,
        ends=ends[:, list(_LEAVES)] @ level.T - start,
        skis=skis + feet[:, :, None, None] - start,
        feet=feet - start,
        snow=load[..., None] * level[:, 2] + friction,
        air=vectors("drag", "N"),
        hill=hill_about(model, com, start),
    )


def hill_about(model: Model, com: Array, start: Array) -> Hill | None:
    """Return the snow around a path ``com`` (n, 3) m, level frame, counted from ``start`` (3,)."""
    low, high = com[:, :2].min(axis=0) - _REACH, com[:, :2].max(axis=0) + _REACH
    spacing = max(_CELL, float(np.sqrt(np.prod(high - low) / _MOST)))
    x, y = (np.arange(a, b + spacing, spacing) for a, b in zip(low, high, strict=True))
    slant = np.cos(model.inclination)
    places = np.stack(np.meshgrid(x / slant, y, indexing="ij"), axis=-1).reshape(-1, 2)
    heights = model.snow(places)[0].reshape(len(x), len(y)) / slant
    return None if np.max(np.abs(heights)) < _EVEN else Hill(low - start[:2], spacing, heights)


def _edges(ski: Ski, bent: Array) -> Array:
    """Return both edges (n, 2, stations, 2, 3) m in the feet's frames, for deflections (n, 2, 2) m of (tip, tail).

    Between boot and ends the ski has its shape under an even load, from its own stiffness; twist is not drawn.
    """
    s = np.array(STATIONS)
    shape = bent[..., :1] * _under_even_load(ski, s) + bent[..., 1:] * _under_even_load(ski, 1.0 - s, mirrored=True)
    height = ski.height(s) - ski.height(ski.s_of_x(0.0)) + shape
    half = 0.5 * ski.width(s)[:, None] * [1.0, -1.0]
    edges = np.empty((*bent.shape[:2], len(s), 2, 3))
    edges[..., 0], edges[..., 1], edges[..., 2] = ski.x_of_s(s)[:, None], half, height[..., None]
    return edges


def _under_even_load(ski: Ski, s: Array, *, mirrored: bool = False) -> Array:
    """Return the deflection at s over that at the end (1 at s = 1), of the half ski clamped at s = 1/2.

    w'' = (1 − s)²/EI.
    """
    fine = np.linspace(0.5, 1.0, 101)
    stiffness = ski.bending_stiffness(1.0 - fine if mirrored else fine)
    slope = cumulative_trapezoid((1.0 - fine) ** 2 / stiffness, fine, initial=0)
    deflection = cumulative_trapezoid(slope, fine, initial=0)
    return np.asarray(np.interp(s, fine, deflection / deflection[-1], left=0.0))


def pack(replay: Replay, name: str, model: Model) -> dict[str, Any]:
    """Pack a replay for the page's script, as JSON: numbers as little-endian binary in base64.

    ``path`` (n, 3) float32 is the centre of mass; ``points`` (n, k, 3) int16 count from it in steps of ``step`` m;
    ``forces`` (n, 3, 3) int16 (snow on the left ski, on the right, air) in steps of ``newton`` N.
    """
    n = len(replay.time)
    around = np.concatenate([replay.joints, replay.ends, replay.feet, replay.skis.reshape(n, -1, 3)], axis=1)
    around = around - replay.com[:, None]
    forces = np.concatenate([replay.snow, replay.air[:, None]], axis=1)
    step, newton = _step(around), _step(forces)
    gear = 2.0 * (model.equipment.boot_mass + model.equipment.ski_mass)
    return {
        "name": name,
        "start": float(replay.time[0]),
        "rate": (n - 1) / float(np.ptp(replay.time)),
        "frames": n,
        "points": around.shape[1],
        "step": step,
        "newton": newton,
        "bones": _bones(),
        "head": [SEGMENT["head"], len(SEGMENTS) + _LEAVES.index(SEGMENT["head"])],
        "hands": [len(SEGMENTS) + _LEAVES.index(SEGMENT[f"hand_{side}"]) for side in "lr"],
        "pole": POLE * model.skier.height,
        "feet": len(SEGMENTS) + len(_LEAVES),
        "skis": len(SEGMENTS) + len(_LEAVES) + 2,
        "stations": len(STATIONS),
        "inclination": model.inclination,
        "hill": None if replay.hill is None else _packed(replay.hill),
        "weight": GRAVITY * (model.skier.mass + gear),
        "bodyweight": GRAVITY * model.skier.mass,
        "path": _binary(replay.com, "<f4"),
        "around": _binary(np.rint(around / step), "<i2"),
        "forces": _binary(np.rint(forces / newton), "<i2"),
    }


def _packed(hill: Hill) -> dict[str, Any]:
    """Pack ``heights`` (a, b) as int16 in steps of ``step`` m."""
    step = _step(hill.heights)
    return {
        "corner": hill.corner.tolist(),
        "spacing": hill.spacing,
        "rows": hill.heights.shape[0],
        "columns": hill.heights.shape[1],
        "step": step,
        "heights": _binary(np.rint(hill.heights / step), "<i2"),
    }


def _bones() -> list[list[float | int]]:
    """Return [from point, to point, half thickness in m, side (0 trunk, 1 left, 2 right)] of every line to draw."""
    hips = (SEGMENT["femur_l"], SEGMENT["femur_r"])
    pairs = [(SEGMENTS[p], p, i) for i, p in enumerate(PARENT) if p >= 0 and i not in hips]
    pairs += [("pelvis", hip, SEGMENT["torso"]) for hip in hips] + [("pelvis", *hips)]
    pairs += [(SEGMENTS[i], i, len(SEGMENTS) + end) for end, i in enumerate(_LEAVES) if i != SEGMENT["head"]]
    return [[start, stop, *_look(segment)] for segment, start, stop in pairs]


def _look(segment: str) -> tuple[float, int]:
    stem, _, side = segment.partition("_")
    return _BULK.get(stem, _THIN), {"": 0, "l": 1, "r": 2}[side]


def _step(values: Array) -> float:
    """Return the step that brings the largest of ``values`` to the end of int16."""
    return float(np.max(np.abs(values), initial=1e-9)) / 32767.0


def _binary(values: Array, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode("ascii")


def the_runs(runs: Runs) -> Section:
    """Show several runs in 3D, side by side; only on a page, whose first screen shows the replay of a single run."""
    players = [replay_html(run) for run in runs] if len(runs) > 1 else []
    content = f'<div class="beside">\n{"".join(players)}</div>\n'
    if sum(map(bool, players)) > 1:
        content = _TOGETHER + content
    return Section("The runs", (Markup(content),) if any(players) else ())


def replay_html(run: StoredRun) -> str:
    """Return the replay of a run as HTML; "" for a run without a skeleton or of a single instant."""
    if run.geometry is None or len(run.time) < 2:
        return ""
    return player(pack(replay_of(run.series, run.geometry, run.model), run.name, run.model))


def player(content: Mapping[str, Any]) -> str:
    """Return HTML of one replay: a picture, its controls and its data, which the page's script draws."""
    name = escape(str(content["name"]))
    data = json.dumps(content).replace("<", "\\u003c")  # so that no name in it can end the element
    views = "".join(f"<option>{view}</option>" for view in ("front", "side", "behind", "above"))
    speeds = "".join(
        f'<option value="{value}"{" selected" if value == "1" else ""}>{value}×</option>' for value in _SPEEDS
    )
    return (
        f'<div class="replay">\n<h3>{name}</h3>\n'
        f'<canvas role="img" tabindex="0" aria-label="Replay of {name} in 3D; arrow keys turn it, space plays it">'
        "</canvas>\n"
        '<div class="controls" hidden>\n'
        '<input type="range" name="time" min="0" max="1" step="any" value="0" aria-label="time">\n'
        '<button type="button" name="play">Play</button>\n'
        f'<label>speed <select name="speed">{speeds}</select></label>\n'
        f'<label>seen from <select name="view">{views}</select></label>\n'
        '<button type="button" name="nearer" aria-label="nearer">+</button>\n'
        '<button type="button" name="farther" aria-label="farther">−</button>\n'
        '<label><input type="checkbox" name="forces" checked> forces</label>\n'
        '<output aria-live="off"></output>\n</div>\n'
        f"<noscript><p>The replay needs JavaScript.</p></noscript>\n<p class=key>{_KEY}</p>\n"
        f'<script type="application/json">{data}</script>\n</div>\n'
    )
