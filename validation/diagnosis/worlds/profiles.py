"""Courses over time or place of which worlds are made."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array

_SUBSTEPS: Final = 9
"""Points of a cell over which a pulse is averaged: pulses may be shorter than cells."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number between ``low`` and ``high`` whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def gaussian_process(rng: np.random.Generator, at: Array, memory: float) -> Array:
    """Draw (c,) a process of variance one at ``at`` (c,) whose correlation falls by e within ``memory``."""
    apart = np.abs(at[:, None] - at)
    lower = np.linalg.cholesky(np.exp(-apart / memory) + 1e-9 * np.eye(len(at)))
    return np.asarray(lower @ rng.standard_normal(len(at)))


def stretch(rng: np.random.Generator, edges: Array, shortest: float, longest: float) -> tuple[float, float]:
    """Draw the begin and the end of a stretch within ``edges`` (c + 1,), its length between two ones, or all of it."""
    begin, end = float(edges[0]), float(edges[-1])
    long = min(log_uniform(rng, shortest, longest), end - begin)
    first = float(rng.uniform(begin, end - long))
    return first, first + long


def pulse(rng: np.random.Generator, edges: Array, window: tuple[float, float]) -> Array:
    """Draw (c,) means over the cells between ``edges`` of a pulse within a ``window``, at most one: it rises and falls
    with random steepness and skewness.
    """
    share = np.linspace(0.0, 1.0, _SUBSTEPS)
    at = edges[:-1, None] + np.diff(edges)[:, None] * share
    x = (at - window[0]) / (window[1] - window[0])
    inside = (x >= 0.0) & (x <= 1.0)
    x = np.clip(x, 1e-9, 1.0 - 1e-9)
    a, b = np.exp(rng.uniform(np.log(0.05), np.log(3.0), 2))  # 0.05 is nearly a box, 1 a parabola, 3 a bell
    top = a / (a + b)
    shape = (x / top) ** a * ((1.0 - x) / (1.0 - top)) ** b
    return np.asarray(np.mean(np.where(inside, shape, 0.0), axis=1))


def direction(rng: np.random.Generator) -> Array:
    """Draw (3,) a direction along, across and normal: any, in the snow's plane, or one axis alone."""
    kept = [np.ones(3), np.array([1.0, 1.0, 0.0]), *np.eye(3)][int(rng.integers(5))]
    drawn = kept * rng.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))
