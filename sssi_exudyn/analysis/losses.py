"""What snow and air take from a skier, and the lateral force that the turns need.

By the paper's law μ_n is the largest lateral load ratio of a skier, not a property of the snow: where skis slip, the
force across them stands at μ_n times their load.  Three figures compare between skiers and between laws: the lateral
ratio that the path needs, the mechanical energy lost on the way down, and friction as an energy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sssi_exudyn.core.frames import GRAVITY, Array, gravity_in_slope
from sssi_exudyn.simulation.result import PRESSED, SimulationResult

QUANTILE: Final = 0.9
"""Share of the time within which the lateral ratio stays: its largest value would be that of one bump."""
AT_LIMIT: Final = 0.9
"""Share of μ_n·load above which the force across a ski counts as at its limit."""
LEAST_DROP: Final = 0.05
"""m; over less, energy for each metre of drop is the noise of heights: phases of turns drop by 0.3 m and more."""
_SNOW: Final = ("contact", "friction", "skid")
"""Works of the snow: of its normal force, of friction, and of edges that slip."""


@dataclass(frozen=True)
class Losses:
    """Figures of n samples.

    lateral_ratio : (n,) force of the snow across the path of the centre of mass over its normal force, of both skis
        together; NaN where they press with less than ``PRESSED``
    energy : (n,) J/kg of the centre of mass, kinetic and potential
    drop : (n,) m, height lost since the start
    snow, air : (n,) J that snow and air have taken since the start
    load_path : (n,) N m, normal force times path of each ski, summed since the start
    """

    lateral_ratio: Array
    energy: Array
    drop: Array
    snow: Array
    air: Array
    load_path: Array


def losses(result: SimulationResult, inclination: float) -> Losses:
    """Compute the losses along a run on a slope of that inclination (rad)."""
    time, normal = result.time, result.snow.normal
    load = np.einsum("nsk,nsk->ns", result.snow.force, normal)
    both = normal.sum(axis=1)
    both /= np.linalg.norm(both, axis=1, keepdims=True)
    along = _direction(result.com_velocity, both)
    lateral = np.einsum("nsk,nk->n", result.snow.force, np.cross(both, along))
    pressing = load.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(pressing > PRESSED, np.abs(lateral) / pressing, np.nan)
    fall = gravity_in_slope(inclination)
    drop = (result.com - result.com[0]) @ fall / GRAVITY
    slide = result.foot_velocity - np.einsum("nsk,nsk->ns", result.foot_velocity, normal)[..., None] * normal
    rate = np.sum(np.maximum(load, 0.0) * np.linalg.norm(slide, axis=-1), axis=1)
    none = np.zeros(len(time))
    return Losses(
        lateral_ratio=ratio,
        energy=0.5 * np.sum(result.com_velocity**2, axis=1) - GRAVITY * drop,
        drop=drop,
        snow=-sum((result.energy[name] for name in _SNOW if name in result.energy), none),
        air=-result.energy.get("air", none),
        load_path=np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]),
    )


def loss_columns(lost: Losses, rows: NDArray[np.bool_]) -> dict[str, float]:
    """Return the figures of the samples ``rows`` (n,), an interval of the run, as columns of the table of turns."""

    def gained(values: Array) -> float:
        within = values[rows]
        return float(within[-1] - within[0])

    energy, drop = -gained(lost.energy), gained(lost.drop)
    snow, air, load_path = gained(lost.snow), gained(lost.air), gained(lost.load_path)
    ratio = lost.lateral_ratio[rows]
    ratio = ratio[np.isfinite(ratio)]
    return {
        "lateral_ratio_p90": float(np.quantile(ratio, QUANTILE)) if len(ratio) else float("nan"),
        "drop_m": drop,
        "energy_lost_J_per_kg": energy,
        "energy_lost_J_per_kg_m": energy / drop if drop > LEAST_DROP else float("nan"),
        "effective_friction": snow / load_path if load_path > 0.0 else float("nan"),
        "air_share_of_losses": air / (snow + air) if snow + air > 0.0 else float("nan"),
    }


@dataclass(frozen=True)
class LossFigures:
    """Losses of a run, and the lateral force that it needed.

    lateral_ratio_p90 : 90th percentile of the force across the path over the normal force, of both skis together
    lateral_at_limit_share : share of the load in time at which the force across a ski exceeded 90 % of μ_n times its
        load; null where edges cut the snow, which has no μ_n
    effective_friction : energy that the snow took over the normal force times the path of each ski
    air_share : the air's share of what snow and air took
    energy_lost_J_per_kg_m : mechanical energy of the centre of mass lost for each kilogram and metre of drop, mean over
        complete turns, of the whole turn and of each phase; g (9.81) where all that the drop gives is lost
    """

    lateral_ratio_p90: float | None = None
    lateral_at_limit_share: float | None = None
    effective_friction: float | None = None
    air_share: float | None = None
    energy_lost_J_per_kg_m: Mapping[str, float | None] | None = None


def loss_figures(
    result: SimulationResult, table: pd.DataFrame, inclination: float, mu_n: float | None = None
) -> LossFigures:
    """Return the figures of a run; empty where it stopped at once.

    Parameters
    ----------
    table : one row a turn and phase, with the columns of ``loss_columns``
    inclination : rad, of the slope
    mu_n : of the law of friction; None where edges cut
    """
    if len(result.time) < 2:
        return LossFigures()
    whole = loss_columns(losses(result, inclination), np.ones(len(result.time), dtype=bool))
    by_phase: dict[str, float | None] | None = None
    if not table.empty and table["complete"].any():
        complete = table[table["complete"]]
        drops = complete.groupby("phase", sort=False)[["energy_lost_J_per_kg", "drop_m"]].sum()
        by_phase = {
            str(phase): float(lost / drop) if drop > LEAST_DROP else None for phase, lost, drop in drops.itertuples()
        }
    return LossFigures(
        lateral_ratio_p90=whole["lateral_ratio_p90"],
        lateral_at_limit_share=None if mu_n is None else at_limit_share(result, mu_n),
        effective_friction=whole["effective_friction"],
        air_share=whole["air_share_of_losses"],
        energy_lost_J_per_kg_m=by_phase,
    )


def at_limit_share(result: SimulationResult, mu_n: float) -> float:
    """Return the share of the load in time at which the force across a ski exceeds ``AT_LIMIT`` of ``mu_n`` times it.

    NaN where the skis never press.
    """
    normal = result.snow.normal
    load = np.maximum(np.einsum("nsk,nsk->ns", result.snow.force, normal), 0.0)
    left = np.cross(normal, _direction(result.foot_forward, normal))
    across = np.abs(np.einsum("nsk,nsk->ns", result.snow.force, left))
    step = np.gradient(result.time)[:, None]
    pressing = float(np.sum(load * step))
    at_limit = float(np.sum(np.where(across > AT_LIMIT * mu_n * load, load, 0.0) * step))
    return at_limit / pressing if pressing > 0.0 else float("nan")


def _direction(vectors: Array, normal: Array) -> Array:
    """Return unit vectors (…, 3) along ``vectors`` within the planes across ``normal``; NaN where they have no part."""
    within = vectors - np.sum(vectors * normal, axis=-1, keepdims=True) * normal
    size = np.linalg.norm(within, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(size > 0.0, within / size, np.nan))
