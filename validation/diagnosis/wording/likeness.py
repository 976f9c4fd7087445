"""What simulated runs had hidden that look like the recording, in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.judgement import Judgement
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE

_WORDS: Final = {
    NOTHING_MISSING: "nothing hidden",
    NOT_IN_THE_LIST: "something that is not in the list",
    TWO_AT_ONCE: "two causes at once",
}


def answer_of(name: str) -> str:
    """Return the answer that the name of a hypothesis, or of nothing, is."""
    return NOT_IN_THE_LIST if name in BY_NAME and BY_NAME[name].kind == "unexplained" else name


def caption_of(answer: str) -> str:
    """Return the words for an answer."""
    return _WORDS[answer] if answer in _WORDS else BY_NAME[answer].caption


def likeness_sentence(judgement: Judgement, thresholds: Thresholds) -> str:
    """Return what the runs had hidden, and what could be said at best of the finding that they vary, or of nothing.

    Where the recording is unlike all that was simulated, the sentence says that it says nothing.
    """
    if judgement.outside < thresholds.world_outside:
        return (
            f"This recording looks like none of {judgement.runs:,} simulated runs of it with known causes: of these, "
            f"{judgement.outside:.1%} are as far from their kind, so they say nothing of its cause."
        )
    answer = answer_of(judgement.about)
    runs = f"{judgement.runs:,} simulated runs of this recording with known causes"
    sentences = [f"Of {runs}, those that look like it had: {_list(judgement.probabilities, thresholds)}"]
    if answer in judgement.best_possible:
        sentences.append(
            f"Where {caption_of(answer)} is the truth, the best possible method gives it "
            f"{judgement.best_possible[answer]:.0%} on average"
        )
    return ". ".join(sentences) + "."


def _list(probabilities: Mapping[str, float], thresholds: Thresholds) -> str:
    named = [(name, p) for name, p in probabilities.items() if p >= thresholds.worth_naming]
    return ", ".join(f"{caption_of(name)} {p:.0%}" for name, p in named)
