"""The snow's surface under the skis: a template that ``compiled`` joins with the other kernels and the laws."""

from __future__ import annotations

import math
from collections.abc import Callable

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import ski_axes
from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.terrain.surface import on_patch, patch_under

terrain_height: Callable[..., tuple[float, float, float]]


@njit(cache=True, error_model="numpy")
def heights(parameters, under, f, l):
    """Height of the snow over the slope's plane (m) and its two slopes at a place near a patch."""
    h, h_f, h_l = terrain_height(parameters, f, l)
    more, more_f, more_l = on_patch(under, f, l)
    return h + more, h_f + more_f, h_l + more_l


@njit(cache=True, error_model="numpy")
def upright(h_f, h_l):
    """The snow's unit normal (3) where it has these slopes."""
    s = 1.0 / math.sqrt(1.0 + h_f * h_f + h_l * h_l)
    return -h_f * s, -h_l * s, s


@njit(cache=True, error_model="numpy")
def ground(parameters, under, f, l):
    """Height of the snow over the slope's plane (m) and its unit normal (3) at a place near a patch."""
    h, h_f, h_l = heights(parameters, under, f, l)
    return h, upright(h_f, h_l)


@njit(cache=True, error_model="numpy")
def foot_axes(parameters, surface, place, rotation):
    """``ski_axes`` of a foot on the snow at its place."""
    under = patch_under(surface, place[0], place[1])
    return ski_axes(ground(parameters, under, place[0], place[1])[1], rotation)


@njit(cache=True, error_model="numpy")
def section_angle(left, right, width):
    """The angle (rad) at which a ski's section of this width stands on the snow, by the depths of both its edges;
    positive on its right edge.
    """
    return math.asin(max(-1.0, min(1.0, (right - left) / width)))


@njit(cache=True, error_model="numpy")
def angle_by_depths(low, angle, width):
    """By how much that angle grows with how much deeper (m) the deeper edge is, ``low``, than the other (rad/m)."""
    cosine = math.cos(angle)
    return (1.0 if low == 1 else -1.0) / (width * cosine) if cosine > 1e-9 else 0.0


@njit(cache=True, error_model="numpy")
def with_values(parameters, values):
    """The same laws with other parameters (p,)."""
    return LawParameters(values, parameters.first, parameters.others, parameters.addresses)
