"""The snow's surface under the skis: a template that ``compiled`` joins with the other kernels and the laws."""

from __future__ import annotations

from collections.abc import Callable

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.terrain.surface import PATCH, grid_patch, on_patch, patch_under

terrain_height: Callable[..., tuple[float, float, float]]
terrain_linearisation: Callable[..., None]
uneven: Callable[..., bool]
snow_normal: Callable[..., tuple[float, float, float]]
ski_axes: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float], float]]


@njit(cache=True, error_model="numpy")
def heights(parameters, under, f, l):
    """Return the height of the snow over the slope's plane (m) and its two slopes at a place near a patch."""
    h, h_f, h_l = terrain_height(parameters, f, l)
    more, more_f, more_l = on_patch(under, f, l)
    return h + more, h_f + more_f, h_l + more_l


@inlined
def snow_over(parameters, under, shaped, point):
    """Return the gap (m) of snow over a point near a patch along the slope's normal, and the snow's two slopes there.

    shaped : ``uneven``, asked once for all points: the laws' own call costs more than a point off the snow
    """
    h, h_f, h_l = on_patch(under, point[0], point[1])
    if shaped:
        more, more_f, more_l = terrain_height(parameters, point[0], point[1])
        h, h_f, h_l = h + more, h_f + more_f, h_l + more_l
    return h - point[2], h_f, h_l


@njit(cache=True, error_model="numpy")
def linearise_ground(parameters, under, f, l, by_state, by_parameter):
    """Fill the derivatives of the snow's height and slopes at a place near a patch by the place and by the laws'
    parameters.
    """
    if uneven(parameters):
        terrain_linearisation(parameters, f, l, by_state, by_parameter)
    else:
        by_state[:] = 0.0
    _, h_f, h_l = on_patch(under, f, l)
    by_state[0, 0] += h_f
    by_state[0, 1] += h_l
    by_state[1, 0] += under[5]
    by_state[1, 1] += under[6]
    by_state[2, 0] += under[6]
    by_state[2, 1] += under[7]


@njit(cache=True, error_model="numpy")
def collect_patch(z, inputs, surface, f, l):
    """Fill the last rows of ``z``, zeros before, with the tangents of the patch under a ski at a place."""
    first = z.shape[0] - PATCH
    for i in range(inputs.shaping.shape[0]):
        patch = grid_patch(inputs.surface[i], surface.origin, surface.spacing, f, l)
        for c in range(PATCH):
            z[first + c, inputs.shaping[i]] = patch[c]


@njit(cache=True, error_model="numpy")
def ground(parameters, under, f, l):
    """Return the height of the snow over the slope's plane (m) and its unit normal (3) at a place near a patch."""
    h, h_f, h_l = heights(parameters, under, f, l)
    return h, snow_normal(h_f, h_l)


@njit(cache=True, error_model="numpy")
def foot_axes(parameters, surface, place, rotation):
    """Return ``ski_axes`` of a foot on the snow at its place."""
    under = patch_under(surface, place[0], place[1])
    return ski_axes(ground(parameters, under, place[0], place[1])[1], rotation)


@njit(cache=True, error_model="numpy")
def with_values(parameters, values):
    """Return the same laws with other parameters (p,)."""
    return LawParameters(values, parameters.first, parameters.others, parameters.addresses)
