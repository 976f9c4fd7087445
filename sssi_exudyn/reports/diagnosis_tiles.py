"""A diagnosis in tiles: where, what, how sure, how much better, and what to measure next."""

from __future__ import annotations

from sssi_exudyn.reports.section import Tile
from sssi_exudyn.reports.sections.tables import in_reading_units
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Change, Diagnosis, Finding
from sssi_exudyn.validation.diagnosis.wording.paragraph import what_next
from sssi_exudyn.validation.diagnosis.wording.sentence import percent

Row = tuple[Tile, ...]


def tiles_of_diagnosis(diagnosis: Diagnosis) -> tuple[Row, ...]:
    """Return a row of tiles a finding, or one row where nothing was found; what to do next ends the first row."""
    rows = [_of_finding(finding) for finding in diagnosis.findings] or [_of_nothing(diagnosis)]
    return ((*rows[0], _friction(diagnosis), _next(diagnosis)), *rows[1:])


def lines_of_diagnosis(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return the first row of tiles as lines of text."""
    return tuple(
        f"{tile.name}: {tile.value}" + (f" ({tile.note})" if tile.note else "")
        for tile in tiles_of_diagnosis(diagnosis)[0]
    )


def _of_finding(finding: Finding) -> Row:
    others = ", ".join(f"{_words(other.name)} {other.probability:.0%}" for other in finding.alternatives)
    numbers = ", ".join(
        f"{number.meaning or name} {in_reading_units(number.value, number.unit)}"
        for name, number in finding.parameters.items()
    )
    evidence = finding.evidence
    return (
        _where(finding),
        Tile("what", _words(finding.name), numbers),
        Tile("how sure", percent(finding.probability), f"else {others}" if others else "no other explanation remains"),
        Tile("how much better", _better(evidence.trajectory_error_m), _on_other_turns(evidence.held_out_error_m)),
    )


def _where(finding: Finding) -> Tile:
    where = finding.where
    if where is None:
        return Tile("where", "all along", "it acts on the whole run")
    phases = f", {' and '.join(where.phase)}" if where.phase else ""
    path = f"{where.distance_m[0]:.0f} to {where.distance_m[1]:.0f} m of the path{phases}"
    return Tile("where", f"{where.t0_s:.1f} to {where.t1_s:.1f} s", path)


def _of_nothing(diagnosis: Diagnosis) -> Row:
    weighed = diagnosis.weighed[-1] if diagnosis.weighed else ()
    nothing = next((hypothesis for hypothesis in weighed if hypothesis.name == NOTHING_MISSING), None)
    sure = "–" if nothing is None else f"{nothing.probability:.0%}"
    what = "nothing is missing" if diagnosis.verdict == "none" else "the recording cannot tell"
    return (
        Tile("where", "nowhere", "no force stands out") if diagnosis.verdict == "none" else Tile("where", "–"),
        Tile("what", what),
        Tile("how sure", sure, "that nothing is missing"),
        Tile("how much better", "–", "nothing was added"),
    )


def _friction(diagnosis: Diagnosis) -> Tile:
    """Return μ_t over all explanations, where these were weighed, and what it is without a finding."""
    before, after = diagnosis.friction.before.mu_t, diagnosis.friction.after.mu_t
    averaged = (diagnosis.friction_averaged or {}).get("mu_t")
    value = f"μ_t {after:.3f}" if averaged is None else f"μ_t {averaged.value:.3f}"
    notes = []
    if averaged is not None:
        notes.append(f"90 % interval over all explanations {averaged.low:.3f} to {averaged.high:.3f}")
    notes += [f"{before:.3f} with nothing added"] if diagnosis.findings else []
    return Tile("friction", value, "; ".join(notes))


def _next(diagnosis: Diagnosis) -> Tile:
    if not diagnosis.next:
        adequate = diagnosis.adequacy is None or diagnosis.adequacy.adequate
        return Tile("what next", what_next(diagnosis.findings, diagnosis.verdict, (), adequate=adequate))
    first = diagnosis.next[0]
    names = " or ".join(_words(name) for name in first.distinguishes)
    return Tile("what next", first.measurement, f"{percent(first.probability)} probable to leave one of {names}")


def _better(change: Change) -> str:
    before, after = ("–" if value is None else f"{value:.3f} m" for value in (change.before, change.after))
    return f"{after}, was {before}"


def _on_other_turns(change: Change) -> str:
    if change.before is None or change.after is None:
        return "mean error of the track"
    return f"mean error of the track; on turns not fitted {change.after:.3f} m, was {change.before:.3f} m"


def _words(name: str) -> str:
    return name.replace("_", " ")
