"""Runs of one descent: tracks that begin, end and go alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.distance import squareform

from sssi_exudyn.core.frames import Array

ENDS: Final = 100.0
"""Greatest distance, m, between the starts and between the ends of runs of one descent: skiers set off within a lift's
top station, and runs are cut where speed is low, not where the piste ends."""
PATH: Final = 60.0
"""Greatest mean distance, m, between paths of one descent: pistes are some 50 m wide, and receivers err by 10 m."""
SAME_AREA: Final = 5000.0
"""Distance, m, within which runs are of one ski area, which has one map."""
_POINTS: Final = 32
"""Points at which two paths are compared, at equal shares of their lengths."""
_EARTH: Final = 6_371_000.0
"""Radius, m."""


def local(tracks: Sequence[Array]) -> list[Array]:
    """Return tracks (n, 2) of latitude and longitude (deg) as east and north (m) of the mean of all their starts."""
    if not tracks:
        return []
    starts = np.radians([track[0] for track in tracks])
    middle = starts.mean(axis=0)
    scale = np.array([np.cos(middle[0]), 1.0]) * _EARTH
    return [(np.radians(track) - middle)[:, ::-1] * scale for track in tracks]


def places_of(tracks: Sequence[Array]) -> list[str]:
    """Return the descent of each track (n, 2) m, ``A`` that with the most runs; "" where it was skied once.

    Runs are of one descent where every two of them begin and end within ``ENDS`` and their paths lie within ``PATH``:
    clusters of complete linkage.
    """
    if len(tracks) < 2:
        return [""] * len(tracks)
    paths = np.array([_resampled(track) for track in tracks])
    labels = np.zeros(len(tracks), dtype=int)
    for rows in _near(paths):
        labels[rows] = labels.max() + _clusters(paths[rows])
    counts = Counter(labels.tolist())
    ranked = [label for label, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])) if count > 1]
    names = {label: _letters(rank) for rank, label in enumerate(ranked)}
    return [names.get(label, "") for label in labels.tolist()]


def areas_of(tracks: Sequence[Array]) -> list[int]:
    """Return the number of each track's ski area, 0 for the one with the most runs."""
    if not tracks:
        return []
    starts = np.array([track[0] for track in tracks])
    labels = _components(starts, SAME_AREA)
    ranked = [label for label, _ in Counter(labels.tolist()).most_common()]
    return [ranked.index(label) for label in labels.tolist()]


def _near(paths: Array) -> list[NDArray[np.intp]]:
    """Return groups of rows that may be of one descent: linked by starts and ends that are near each other."""
    ends = np.hstack([paths[:, 0], paths[:, -1]])
    labels = _components(ends, np.sqrt(2.0) * ENDS)
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def _components(points: Array, reach: float) -> Array:
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    count = len(points)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _clusters(paths: Array) -> Array:
    """Return the cluster of each path (n, points, 2), from 1."""
    if len(paths) == 1:
        return np.ones(1, dtype=int)
    distances = np.zeros((len(paths), len(paths)))
    for row, path in enumerate(paths):
        apart = np.linalg.norm(paths - path, axis=2)
        distances[row] = np.maximum(np.maximum(apart[:, 0], apart[:, -1]) / ENDS, apart.mean(axis=1) / PATH)
    tree = linkage(squareform(distances, checks=False), "complete")
    return np.asarray(fcluster(tree, 1.0, "distance"))


def _resampled(track: Array) -> Array:
    """Return a path at equal shares of its length."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(track, axis=0), axis=1))])
    shares = np.linspace(0.0, along[-1], _POINTS)
    return np.column_stack([np.interp(shares, along, axis) for axis in track.T])


def _letters(rank: int) -> str:
    """Return A, B … Z, AA, AB …"""
    name = ""
    rank += 1
    while rank:
        rank, letter = divmod(rank - 1, 26)
        name = chr(ord("A") + letter) + name
    return name
