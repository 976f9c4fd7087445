"""Balance on snow that edges cut: a slow lean of the whole posture under which the skier does not fall sideways.

A captured posture fits one path.  Where other skis or other snow lead along another one, what the snow does about the
centre of mass is not what the posture needs.  In roll, about the path, the difference is

    r = (moment of the snow − d/dt angular momentum) · way,

of which a skier rids himself by leaning as a whole.  That lean, about the pelvis' forward axis, is sought as a spline
by Gauss and Newton's method with Broyden's updates, so that the means of r over windows and the lean itself are small,

    Σ (r/σ_r)² + Σ (lean/σ)².

Air acts along the path and has no part in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.advance import Advance
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import PostureCorrection
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.reduced.carved_run import Carved, carved_run
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.ski_on_snow.boot_joint import BootJoint

KNOTS: Final = 1.0
"""s between the knots of the lean: what is faster is the posture's own."""
WINDOW: Final = 0.5
"""s over which the moment left over is averaged."""
MOMENT_SIGMA: Final = 20.0
"""N m of it that do not matter: as much is left over where the posture does fit the path."""
LEAN_SIGMA: Final = float(np.radians(5.0))
"""rad by which a skier leans otherwise with other skis."""
_TRIED: Final = float(np.radians(0.3))
"""rad, of a difference."""
_ROUNDS: Final = 8
_ENOUGH: Final = 0.02
"""Share of what is minimised; a search ends when two rounds, one after the other, gain less: one may for
derivatives that are off, and corrects them."""
_LIST: Final = PRESCRIBED.index("pelvis_list")


@dataclass(frozen=True)
class Balanced:
    """A model whose posture leans so that the skier is in balance.

    model : with the lean in its posture correction
    time, lean : (k,) s, rad of the knots, > 0 to the right
    before, after : (w,) N m of roll left over, means over ``WINDOW``, with the lean that the search began with (the
        captured one unless another was given) and with this one
    by_lean : (w, k) N m/rad, the derivative of these
    """

    model: Model
    time: Array
    lean: Array
    before: Array
    after: Array
    by_lean: Array


def roll_left_over(done: Carved) -> Array:
    """Return the moment (n,) N m that posture and snow leave over about the path of the centre of mass, > 0 to the
    right.
    """
    at, series = done.at, done.series
    whole = at.whole_body()
    arm = at.foot_place - whole.place[:, None]
    given = np.sum(cross(arm, series.force) + series.moment, axis=1)
    left = given - np.gradient(whole.momentum, at.time, axis=0)
    way = series.velocity + whole.velocity
    way = way - (way @ at.up)[:, None] * at.up
    return np.asarray(np.sum(left * way, axis=1) / np.linalg.norm(way, axis=1))


def lean_by(model: Model, time: Array, lean: Array) -> Model:
    """Return the model with a posture that also leans by ``lean`` (k,) rad at ``time`` (k,) s, > 0 to the right."""
    known = model.posture
    instants = time if known is None else np.union1d(time, known.time)
    angles = np.zeros((len(instants), len(PRESCRIBED))) if known is None else known.at(instants)
    angles[:, _LIST] += PostureCorrection(time, lean[:, None]).at(instants)[:, 0]
    return replace(model, posture=PostureCorrection(instants, angles))


def balance(
    model: Model,
    motion: Motion,
    *,
    stop: float | None = None,
    joint: BootJoint | None = None,
    begin: Balanced | None = None,
    progress: Advance | None = None,
) -> Balanced:
    """Return the lean that balances a run of the reduced model from the motion's start to ``stop`` (s; its end if
    None).

    joint : as in ``carved_run``;  begin : what was found for much the same model over the same time, whose lean and
    derivatives the search begins with; the model is to be without that lean.

    Raises SimulationDiverged as ``simulate_carved`` does.
    """
    end = motion.stop if stop is None else stop
    count = max(2, 1 + round((end - motion.start) / KNOTS))
    time = np.linspace(motion.start, end, count)

    runs = 0

    def left_over(lean: Array) -> Array:
        nonlocal runs
        runs += 1
        if progress is not None:
            progress(None, f"run {runs} of {count + 2} or more")
        tried = lean_by(model, time, lean)
        done = carved_run(tried, prepare(tried, motion, stop=stop), joint)
        windows = np.array_split(roll_left_over(done), max(1, round((end - motion.start) / WINDOW)))
        return np.array([window.mean() for window in windows])

    def value(moments: Array, lean: Array) -> float:
        return float(np.sum((moments / MOMENT_SIGMA) ** 2) + np.sum((lean / LEAN_SIGMA) ** 2))

    lean = np.zeros(count) if begin is None else begin.lean
    before = moments = left_over(lean)
    if begin is None:
        by_lean = np.column_stack([(left_over(_TRIED * unit) - moments) / _TRIED for unit in np.eye(count)])
    else:
        by_lean = begin.by_lean
    share, enough = 1.0, False
    for _ in range(_ROUNDS):
        normal = by_lean.T @ by_lean / MOMENT_SIGMA**2 + np.eye(count) / LEAN_SIGMA**2
        step = -share * np.linalg.solve(normal, by_lean.T @ moments / MOMENT_SIGMA**2 + lean / LEAN_SIGMA**2)
        tried = left_over(lean + step)
        by_lean = by_lean + np.outer(tried - moments - by_lean @ step, step) / (step @ step)
        gained = value(moments, lean) - value(tried, lean + step)
        if gained <= 0.0:
            share *= 0.5
            continue
        little = gained < _ENOUGH * value(moments, lean)
        lean, moments, share = lean + step, tried, min(1.0, 2.0 * share)
        if little and enough:
            break
        enough = little
    return Balanced(lean_by(model, time, lean), time, lean, before, moments, by_lean)
