"""The blind benchmark's scores as a page of Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from sssi_exudyn.validation.benchmark.scores import Scores, Share

_TARGETS = {
    "false_alarms": ("false alarms: a finding where nothing is hidden", "at most 5 %"),
    "false_alarms_bic": ("the same by BIC with white noise", ""),
    "false_alarms_in_sample": ("the same by the best fit in sample", ""),
    "false_alarms_force": ("the same by the latent force alone (Bayes factor above 20)", ""),
    "nothing_not_adequate": ("nothing hidden: called not adequate", ""),
    "right_name_first": ("all single effects: right name first", ""),
    "strong_right_or_small_set": ("clear effects: right name first, or in a set of at most 3", "at least 90 %"),
    "strong_right_name_first": ("clear effects: right name first", ""),
    "strong_right_bic": ("clear effects: right name by BIC", ""),
    "strong_right_in_sample": ("clear effects: right name by the best fit in sample", ""),
    "strong_seen_force": ("clear effects: a force by the latent force alone", ""),
    "set_coverage_where_found": ("of all that was found, the set holds the right name", "at least 95 %"),
    "interval_coverage_90": ("90 % intervals that hold the true number", "85 to 95 %"),
    "friction_inside_90": ("90 % intervals of μ_t and μ_n that hold the truth", "85 to 95 %"),
    "friction_inside_90_nothing": ("the same where nothing is hidden", "85 to 95 %"),
    "wrong_and_sure": ("of what is said with more than 80 %: wrong", "at most 3 %"),
    "sure_right": ("of what is said with more than 99 %: right", "at least 97 %"),
    "unexplained_called_so": ("effects outside the list: called unexplained", ""),
    "unexplained_where_found": ("the same, of those where something is found", "at least 80 %"),
    "unexplained_wrongly_named": ("effects outside the list: called something else with more than 80 %", ""),
    "pairs_both_named": ("pairs: both named", ""),
    "seen_pairs_both_named": (
        "pairs whose weaker effect is at least 5 standard errors strong: both named",
        "at least 60 %",
    ),
    "strong_better_than_placebos": (
        "clear effects, found: error on turns not fitted less than with any of 19 forces drawn at random instead",
        "",
    ),
    "strong_within_plain": (
        "clear effects, found: error on turns not fitted within 1.5 times what the same run with the same noise leaves "
        "when nothing is hidden",
        "",
    ),
    "strong_within_noise": ("the same, within 1.5 times the median of runs with nothing hidden", ""),
    "nothing_within_noise": ("runs with nothing hidden: within 1.5 times their own median", ""),
}
_BY_STRENGTH = {
    "found_by_strength": "a finding",
    "right_first_by_strength": "right name first",
    "oracle_sees_by_strength": "3 standard errors strong",
}


def benchmark_page(scores: Scores) -> str:
    """Return every figure with its 95 % interval (Clopper and Pearson), next to its target."""
    lines = [
        "# The diagnosis, tested blindly",
        "",
        f"{scores.cases} cases, {scores.with_full_model} of them diagnosed with the full model, the rest with "
        f"the reduced one; {scores.failed} could not be diagnosed. The answers were sealed before: their sha256 is "
        f"`{scores.seal}`.",
        "",
        "An effect is clear when it is at least 8 standard errors strong to one who sees the same run without it.",
        "",
        *shares_table(scores, tuple(_TARGETS)),
    ]
    overlap = scores.overlap_in_time
    mean = "–" if overlap.mean is None else f"{overlap.mean:.2f}"
    lines.append(
        f"| overlap in time of effects with a place, rightly named (mean of {overlap.cases}) | {mean} | | 0.6 |"
    )
    lines.append(f"| the same, at least 0.6 | {share_in_words(overlap.large)} | {interval_in_words(overlap.large)} | |")
    gain = scores.held_out_after_over_before_strong
    median = "–" if gain.median is None else f"{gain.median:.2f}"
    lines.append(
        f"| error on turns not fitted, after over before (median of {gain.cases} clear cases) | {median} | | |"
    )
    placebo = scores.placebo_after_over_before_strong
    if placebo is not None:
        lines.append(f"| the same with a force drawn at random in its place | {placebo:.2f} | | |")
    lines += ["", "| by strength | weakest | weak | strong | strongest |", "|---|---|---|---|---|"]
    for key, meaning in _BY_STRENGTH.items():
        lines.append(f"| {meaning} | " + " | ".join(share_in_words(share) for share in getattr(scores, key)) + " |")
    lines += ["", "| stated probability, mean | right | 95 % interval |", "|---|---|---|"]
    for level in scores.calibration:
        if level.stated is not None:
            lines.append(f"| {level.stated:.2f} | {share_in_words(level.right)} | {interval_in_words(level.right)} |")
    lines += ["", "| hidden | named first |", "|---|---|"]
    for name, row in sorted(scores.by_name.items()):
        named = ", ".join(f"{other} {count}" for other, count in sorted(row.items(), key=lambda item: -item[1]))
        lines.append(f"| {name} | {named} |")
    return "\n".join(lines) + "\n"


def shares_table(scores: Scores, keys: Sequence[str]) -> list[str]:
    """Return lines of a table of shares by their names in ``scores``, next to their targets."""
    lines = ["| | result | 95 % interval | target |", "|---|---|---|---|"]
    for key in keys:
        (meaning, aim), figure = _TARGETS[key], getattr(scores, key)
        lines.append(f"| {meaning} | {share_in_words(figure)} | {interval_in_words(figure)} | {aim} |")
    return lines


def share_in_words(figure: Share) -> str:
    """Return a share in per cent with its counts; a dash among none."""
    return "–" if figure.share is None else f"{100.0 * figure.share:.0f} % ({figure.hits} of {figure.of})"


def interval_in_words(figure: Share) -> str:
    """Return its 95 % interval; empty among none."""
    if figure.low is None or figure.high is None:
        return ""
    return f"{100.0 * figure.low:.0f} to {100.0 * figure.high:.0f} %"
