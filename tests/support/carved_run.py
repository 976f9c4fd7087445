"""The intermediate on snow that decides the heading, of which what-ifs are asked."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from bundled import bundled

from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of


@cache
def carved_intermediate(seconds: float) -> RecordedRun:
    """Return its first seconds, with hardness, strength and friction of the snow as fitted to this recording."""
    recording, motion = bundled("intermediate")
    nodes = nodes_of(motion.start, motion.start + seconds)
    short = spline_motion(motion.geometry, motion.inclination, nodes, motion.evaluate(nodes)[0])
    model = replace(model_of(recording, motion), sensors=())
    carving = Carving(hardness=4.3e7, strength=8e4, mu=0.13)
    return RecordedRun(replace(model, terms=combine_terms(model.terms, (carving,))), short, snow_turns=True)
