"""In one sentence, what simulated runs had hidden that look like a recording."""

from __future__ import annotations

from collections.abc import Mapping

from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE
from sssi_exudyn.validation.diagnosis.worlds.judge import Judgement

_WORDS = {
    NOTHING_MISSING: "nothing hidden",
    NOT_IN_THE_LIST: "something that is not in the list",
    TWO_AT_ONCE: "two causes at once",
}


def likeness_sentence(judgement: Judgement, thresholds: Thresholds) -> str:
    """Return the sentence; where the recording is unlike all that was simulated, that it says nothing."""
    if judgement.outside < thresholds.world_outside:
        return (
            f"This recording looks like none of {judgement.runs:,} simulated runs of it with known causes: of these, "
            f"{judgement.outside:.1%} are as far from their kind, so they say nothing of its cause."
        )
    listed = _list(judgement.probabilities, thresholds)
    about = f"{judgement.runs:,} simulated runs of this recording with known causes"
    return f"Of {about}, those that look like it had: {listed}."


def _list(probabilities: Mapping[str, float], thresholds: Thresholds) -> str:
    named = [(name, p) for name, p in probabilities.items() if p >= thresholds.worth_naming]
    words = [f"{_WORDS[name] if name in _WORDS else BY_NAME[name].caption} {p:.0%}" for name, p in named]
    return ", ".join(words)
