"""Runs of one descent from place to place, drawn as the joint comparison takes them to be: linear and Gaussian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, draw_noise
from sssi_exudyn.season.stretches import Passage

OFF, KINETIC, HEIGHT, WANDER = 0.5, 0.3, 0.5, ExponentialNoise(4.0, 60.0)
"""m of height: own ground, speeds (0.3 m/s at 10 m/s), independent and slow error of a telephone's heights."""


def draw_passages(
    rng: np.random.Generator,
    place: Array,
    runs: Sequence[float],
    cells: Mapping[tuple[int, int], float],
    scatters: Sequence[float],
    noise: float = 1.0,
) -> tuple[Array, list[Passage]]:
    """Draw runs over stretches of some 100 m.

    Parameters
    ----------
    place : (s,) friction of the stretches;  runs : of each run over it;  cells : of a run's stretch over both
    scatters : spread of each run from stretch to stretch;  noise : factor of all errors of instruments
    """
    count = len(place)
    ground = -np.concatenate([[0.0], np.cumsum(rng.uniform(12.0, 22.0, count))])
    drag = 0.25 * noise * rng.normal()
    passages = []
    for run, (more, scatter) in enumerate(zip(runs, scatters, strict=True)):
        time = np.arange(count + 1.0) * rng.uniform(8.0, 12.0)
        way, air = rng.uniform(100.0, 108.0, count), np.full(count, 2.0)
        friction = place + more + scatter * rng.normal(size=count)
        friction += [cells.get((run, stretch), 0.0) for stretch in range(count)]
        own = ground + OFF * noise * rng.normal(size=count + 1)
        lost = friction * way + air * (1.0 + drag + 0.1 * noise * rng.normal())
        kinetic = 5.0 + np.concatenate([[0.0], np.cumsum(own[:-1] - own[1:] - lost)])
        seen = (
            own + rng.normal(0.0, 20.0) + noise * (draw_noise(rng, time, WANDER) + HEIGHT * rng.normal(size=count + 1))
        )
        passages.append(
            Passage(
                time=time,
                height=seen,
                off=np.full(count + 1, OFF),
                kinetic=kinetic + KINETIC * noise * rng.normal(size=count + 1),
                kinetic_sigma=np.full(count + 1, KINETIC),
                way=way,
                air=air,
                height_sigma=HEIGHT,
                wander=WANDER,
                skier="",
            )
        )
    return 100.0 * np.arange(count + 1.0), passages
