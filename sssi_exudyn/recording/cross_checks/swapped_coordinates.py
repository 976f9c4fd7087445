"""The turning of the skis against that of the track: latitude and longitude exchanged make left turns right ones."""

from __future__ import annotations

from collections.abc import Sequence

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.cross_checks.turning_offset import EXPLAINED, LEAST_OFFSET, offset_of_turns
from sssi_exudyn.recording.slope_and_heading import ski_direction_misfits, stance_at_fixes


class SwappedCoordinates:
    """A track that the skis follow only with latitude and longitude exchanged."""

    compares = "direction of the skis with the course, as it is and mirrored"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a sure finding where the mirrored track fits much better."""
        if evidence.bvh is None or evidence.gps is None:
            return ()
        stance = stance_at_fixes(evidence.bvh, evidence.gps, evidence.equipment.ankle_to_ski_base)
        if len(stance.time) < 5:
            return ()
        as_is, swapped = ski_direction_misfits(stance, evidence.gps)
        # skidding turns skis from the course, but along with it: mirrored, a true track fits three times worse, not
        # better.  0.03 is a deviation of 14°, below which a run is too straight to decide
        if as_is <= 0.03 or swapped >= 0.4 * as_is:
            return ()
        problem = "the skis turn left where the track turns right: latitude and longitude look swapped"
        place, fix = "latitude_deg, longitude_deg", "swap the two columns back, or fix a lost sign"
        offset = offset_of_turns(evidence)
        if offset is not None and offset.left < EXPLAINED and abs(offset.value) > LEAST_OFFSET:
            problem += f", or the clocks {abs(offset.value):.1f} s apart"
            fix += f", or add {offset.value:+.1f} s to time_offset_s of [motion]"
        return (Finding(evidence.files["gps"], place, problem, fix, sure=True),)
