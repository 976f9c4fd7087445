"""The contract of every hypothesis, without exceptions, and that nothing else in the package knows their names."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled import bundled
from hypothesis_contract import check_on_run, check_statements

from sssi_exudyn.contact.terms.body_forces import PolePlant
from sssi_exudyn.contact.terms.wind import Gust, Wind
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.observations import measurements_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model, add_part
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.benchmark.concealed_terms import WorldCompaction
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import (
    BY_NAME,
    HYPOTHESES,
    STEADY_LAWS,
    distinguishing_measurement,
)
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    FittedRun,
    Hypothesis,
    Number,
    Numbers,
    Probe,
    SteadyLaw,
    probes_by,
    responses_of,
)

ROOT = Path(__file__).parents[3]


def test_a_clock_may_be_late_by_as_much_as_a_slow_receiver_takes() -> None:
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    gps = recording.gps
    slow = replace(gps, time=gps.time[::10], enu=gps.enu[::10], sigma=gps.sigma[::10], speed=None, course=None)
    motion = replace(motion, stop=motion.start + 5.0)
    hypothesis = BY_NAME["gps_delay"]
    places = []
    for recorded in (recording, replace(recording, gps=slow)):
        model = problem_of(recorded, motion, model_of(recorded, motion), "joint").model
        prepared = prepare(model, motion, step=0.01)
        run = simulate_reduced(model, prepared)
        measurements = measurements_of(recorded, model, motion.start, motion.stop)
        fitted = FittedRun(model, prepared, run, measurements, measurements.predict(model, run))
        responses = responses_of(hypothesis.probes(fitted), prepared, measurements)
        candidates = hypothesis.candidates(fitted, responses)
        places.append([candidate.model.start.clock_offset for candidate in candidates])
        # the first by the course at each fix, the others by where the skier was then
        late = candidates[-1]
        way = fitted.prediction + late.free.columns[:, 0] * late.model.start.clock_offset
        x = measurements.blocks["x"]
        if len(candidates) > 1:
            np.testing.assert_allclose(way[x][2:], fitted.prediction[x][:-2], atol=1e-6)  # two fixes ago
    assert places == [[0.0], [0.0, -1.0, -2.0, 1.0, 2.0]]


def test_names_are_unique() -> None:
    assert len(BY_NAME) == len(HYPOTHESES)


@pytest.mark.parametrize("hypothesis", HYPOTHESES, ids=lambda hypothesis: hypothesis.name)
def test_each_states_all_that_is_asked(hypothesis: Hypothesis) -> None:
    check_statements(hypothesis)
    assert any(distinguishing_measurement(hypothesis.name, other) for other in BY_NAME if other != hypothesis.name)


@pytest.mark.parametrize("hypothesis", HYPOTHESES, ids=lambda hypothesis: hypothesis.name)
@pytest.mark.long
def test_each_is_tried_on_a_run(hypothesis: Hypothesis, fitted: FittedRun) -> None:
    check_on_run(hypothesis, fitted)


def test_displaced_fixes_are_usually_several_times_what_the_receiver_states(fitted: FittedRun) -> None:
    jump = BY_NAME["gps_jump"]
    responses = np.zeros((len(fitted.prediction), 0))
    telephone = replace(fitted, measurements=replace(fitted.measurements, gps_sigma=12.0))
    assert np.all(jump.candidates(fitted, responses)[0].free.scales == 0.6)  # stated 2 cm
    assert np.all(jump.candidates(telephone, responses)[0].free.scales == 36.0)


def test_displaced_fixes_that_come_and_go_are_found_where_they_do(fitted: FittedRun) -> None:
    """A straight rise and fall, which no candidate has, is nearer to a gradual one than to any step."""
    time = fitted.measurements.fixes
    n, t0, long = len(time), float(time[0] + 0.3 * (time[-1] - time[0])), 0.4 * float(time[-1] - time[0])
    ramp = np.clip(np.minimum(time - t0, t0 + long - time) / (0.25 * long), 0.0, 1.0)
    left = {True: np.inf, False: np.inf}
    for candidate in BY_NAME["gps_jump"].candidates(fitted, np.zeros((len(fitted.prediction), 0))):
        shape = candidate.free.columns[:n, 0]
        np.testing.assert_array_equal(candidate.free.columns[n : 2 * n, 1], shape)
        gradual = bool(candidate.places)
        left[gradual] = min(left[gradual], float(np.sum((ramp - shape * (shape @ ramp) / (shape @ shape)) ** 2)))
    assert left[True] < 0.5 * left[False]


def test_a_late_clock_is_usually_as_late_as_a_receiver_s_interval(fitted: FittedRun) -> None:
    delay, responses = BY_NAME["gps_delay"], np.zeros((len(fitted.prediction), 1))
    assert delay.candidates(fitted, responses)[0].free.scales == 0.25  # ten fixes a second
    measurements = replace(fitted.measurements, fixes=np.arange(5.0))
    second = replace(fitted, measurements=measurements, prediction=measurements.predict(fitted.model, fitted.run))
    assert delay.candidates(second, responses)[0].free.scales == 1.0


@pytest.mark.parametrize(
    ("name", "number"), [("heading_misalignment", "heading_offset"), ("gps_delay", "clock_offset")]
)
def test_a_fault_is_more_than_its_instrument_states(name: str, number: str, fitted: FittedRun) -> None:
    hypothesis, responses = BY_NAME[name], np.zeros((len(fitted.prediction), 1))
    usual = float(hypothesis.candidates(fitted, responses)[0].free.scales[0])
    poor = replace(fitted, stated={f"start.{number}": 0.5})
    assert hypothesis.candidates(poor, responses)[0].free.scales == 1.5
    good = replace(fitted, stated={f"start.{number}": 0.001})
    assert hypothesis.candidates(good, responses)[0].free.scales == usual


def test_faults_of_instruments_that_a_recording_lacks_are_not_weighed(fitted: FittedRun) -> None:
    measurements = fitted.measurements
    without = replace(measurements, windows=np.zeros(0), loads=np.zeros((0, 2)))
    place = FittedRun(fitted.model, fitted.prepared, fitted.run, without, without.predict(fitted.model, fitted.run))
    for name in ("insole_gain", "boot_cuff", "insole_offset", "insole_delay"):
        for run, count in ((fitted, 1), (place, 0)):
            hypothesis = BY_NAME[name]
            responses = responses_of(hypothesis.probes(run), run.prepared, run.measurements)
            assert len(hypothesis.candidates(run, responses)) == count


def test_snow_resists_by_any_power_of_the_groove(fitted: FittedRun) -> None:
    """A resistance whose power is between one strength at any depth and one that grows with depth has its candidate."""
    compaction, measurements = BY_NAME["snow_compaction"], fitted.measurements
    hidden = responses_of(probes_by(fitted.model, WorldCompaction(), ["c"]), fitted.prepared, measurements)[:, 0]
    columns = responses_of(compaction.probes(fitted), fitted.prepared, measurements)
    left = []
    for candidate in compaction.candidates(fitted, columns):
        column = candidate.free.columns[:, 0]
        unlike = hidden - column * (column @ hidden) / (column @ column)
        left.append(float(np.sqrt(np.sum(unlike**2) / np.sum(hidden**2))))
        (power,) = candidate.places
        assert candidate.model.value(power) in (1.0, 1.5, 2.0)
    first, middle, last = left
    # the hidden law has the power 1.5, is smoothed over 0.1 m/s and has no switch at a newton
    assert middle < 1e-3
    assert min(first, last) > 10.0 * middle


def test_a_wind_that_swells_is_a_wind(fitted: FittedRun) -> None:
    """One that is a third stronger and weaker every six seconds moves the measurements as the law's numbers can."""
    gust, wind = BY_NAME["gust"], BY_NAME["wind"]
    edges = fitted.time_edges
    cells = responses_of(gust.probes(fitted), fitted.prepared, fitted.measurements)[:, : len(edges) - 1]
    swelling = cells @ (1.0 + np.sin(np.pi / 3.0 * 0.5 * (edges[1:] + edges[:-1])) / 3.0)
    columns = responses_of(wind.probes(fitted), fitted.prepared, fitted.measurements)
    (candidate,) = wind.candidates(fitted, columns)
    assert len(candidate.amplitudes) == 2 + min(6, 1 + int((edges[-1] - edges[0]) / 2.5))

    def left(columns: Array) -> float:
        """Return the share of its effect, root mean square, that the ``columns`` (N, k) do not have."""
        explained = columns @ np.linalg.lstsq(columns, swelling, rcond=None)[0]
        return float(np.linalg.norm(swelling - explained) / np.linalg.norm(swelling))

    # 0.36: straight from 2.5 s to 2.5 s it is not, and the run of 5 s has three of them
    assert left(candidate.free.columns) < 0.5 * left(candidate.free.columns[:, :2])


def test_one_place_for_each_pair() -> None:
    pairs = [
        frozenset({hypothesis.name, other})
        for hypothesis in HYPOTHESES
        for distinction in hypothesis.distinctions
        for other in distinction.others
    ]
    assert len(pairs) == len(set(pairs))
    for pair in pairs:
        one, other = pair
        assert distinguishing_measurement(one, other) == distinguishing_measurement(other, one) is not None
    assert distinguishing_measurement("nothing", "wind") is None


def test_laws_of_a_day_are_no_faults_of_instruments() -> None:
    assert {hypothesis.kind for hypothesis in STEADY_LAWS} == {"physics", "unexplained"}
    assert not any(hypothesis.moves_all for hypothesis in STEADY_LAWS)


class Draught(SteadyLaw):
    """A hypothesis as it should be."""

    name = "draught"
    caption = "a draught"
    amplitudes = (("w_f", 1.0),)

    def part(self, fitted: FittedRun) -> Wind:
        return Wind()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"a draught of {numbers['w_f'].value:.1f} m/s"


class Uncaptioned(Draught):
    """No caption."""

    caption = ""


class Impossible(Draught):
    """A prior of zero."""

    weight = 0.0


class OneSided(Draught):
    """The same words for wind from both sides."""

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return "a draught"


class Unfelt(Draught):
    """A probe that changes nothing: a gust that is over when the run begins."""

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return probes_by(fitted.model, Gust(t0=-5.0, t1=-4.0), ["w_f"])


class Misshapen(Draught):
    """Usual sizes for amplitudes that it has not."""

    @property
    def scales(self) -> Array:
        return np.array([1.0, 1.0])


class Timeless(Draught):
    """A window that is not inside the run."""

    def window(self, fitted: FittedRun, candidate: object, numbers: Numbers) -> tuple[float, float]:  # type: ignore[override]
        return -1.0, 0.0


def test_the_contract_accepts_a_whole_hypothesis(fitted: FittedRun) -> None:
    check_statements(Draught())
    check_on_run(Draught(), fitted)


@pytest.mark.parametrize("wrong", [Uncaptioned, Impossible])
def test_a_statement_that_is_missing_is_noticed(wrong: type[Draught]) -> None:
    with pytest.raises(AssertionError):
        check_statements(wrong())


@pytest.mark.parametrize("wrong", [OneSided, Unfelt, Misshapen, Timeless])
def test_a_hypothesis_that_does_not_fit_the_run_is_noticed(wrong: type[Draught], fitted: FittedRun) -> None:
    with pytest.raises(AssertionError):
        check_on_run(wrong(), fitted)


def test_the_words_for_other_snow_follow_the_number_that_differs() -> None:
    model = model_of(*bundled("beginner")).with_values({"friction.mu_t": 0.06, "friction.mu_n": 0.65})
    same, slower = Number(0.001, -0.003, 0.005, "1"), Number(0.04, 0.03, 0.05, "1")
    softer = Number(-0.25, -0.30, -0.20, "1")
    patch = BY_NAME["snow_patch"]
    along, across = {"delta_mu_t": slower, "delta_mu_n": same}, {"delta_mu_t": same, "delta_mu_n": softer}
    assert patch.sentence(along, model) == "the skis glide on slower snow: μ_t is 0.100 there against 0.060 elsewhere"
    assert patch.plain_words(along, model) == "the snow is slower there: as if the slope were 2.3° flatter"
    assert patch.sentence(across, model) == "the skis hold less across: μ_n is 0.40 there against 0.65"
    assert patch.plain_words(across, model) == "the snow holds less across the skis there, and glides as elsewhere"
    both = patch.sentence({"delta_mu_t": slower, "delta_mu_n": softer}, model)
    assert both.endswith("against 0.060 elsewhere, and hold less across: μ_n is 0.40 there against 0.65")


def test_a_pole_does_not_pull() -> None:
    low, _ = add_part(model_of(*bundled("beginner")), PolePlant()).bounds("pole_plant.up")
    assert low == 0.0


def test_no_hypothesis_without_a_sentence() -> None:
    class Silent(SteadyLaw):
        """What it means stands nowhere."""

        name = "silent"
        caption = "nothing"
        amplitudes = (("w_f", 1.0),)

        def part(self, fitted: FittedRun) -> Wind:
            return Wind()

    with pytest.raises(TypeError, match="sentence"):
        Silent()  # type: ignore[abstract]


def names_outside(tree: ast.Module, names: set[str]) -> list[str]:
    """String literals that are one of ``names``, but for the name that a term's or fault's class gives itself."""
    own = {
        id(statement.value)
        for cls in ast.walk(tree)
        if isinstance(cls, ast.ClassDef)
        for statement in cls.body
        if isinstance(statement, ast.AnnAssign | ast.Assign)
        for target in (statement.targets if isinstance(statement, ast.Assign) else [statement.target])
        if isinstance(target, ast.Name) and target.id in ("name", "kind")
    }
    return [
        f"{node.value!r} in line {node.lineno}"
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and node.value in names and id(node) not in own
    ]


@pytest.mark.long
def test_nothing_else_in_the_package_knows_their_names() -> None:
    known = {
        # the kind of a term, which wind's own name happens to be
        "contact/codegen/compiled.py": {"wind"},
        "contact/codegen/law_source.py": {"wind"},
        "contact/conformance_states.py": {"wind"},
        # what carries skiers up
        "sssi_exudyn/importing/days/day.py": {"lift"},
        "sssi_exudyn/importing/days/descents.py": {"lift"},
    }
    folder = ROOT / "validation" / "diagnosis" / "hypotheses"
    tops = [ROOT / name for name in ("sssi_exudyn", "bodies", "contact", "fitting", "validation")]
    files = {path.resolve() for top in tops for path in top.rglob("*.py")}
    mentioned = {
        str(path.relative_to(ROOT)): mentions
        for path in sorted(files)
        if folder not in path.parents
        if (
            mentions := names_outside(
                ast.parse(path.read_text(encoding="utf-8")),
                BY_NAME.keys() - known.get(str(path.relative_to(ROOT)), set()),
            )
        )
    }
    assert mentioned == {}
    assert names_outside(ast.parse('TABLE = {"gust": 1}'), set(BY_NAME)) == ["'gust' in line 1"]


def candidate_at(candidates: list[Candidate], begin: float, end: float) -> Candidate:
    """Return the first candidate that begins and ends so."""
    ends = [[candidate.model.value(line) for line in candidate.places] for candidate in candidates]
    return candidates[int(np.argmin(np.abs(np.array(ends) - [begin, end]).sum(axis=1)))]


@pytest.mark.parametrize("name", ["snow_patch", "gust", "unexplained_force"])
def test_what_begins_within_a_cell_does_nearly_what_its_half_cells_do(fitted: FittedRun, name: str) -> None:
    hypothesis = BY_NAME[name]
    responses = responses_of(hypothesis.probes(fitted), fitted.prepared, fitted.measurements)
    candidates = hypothesis.candidates(fitted, responses)
    edges = fitted.place_edges if name == "snow_patch" else fitted.time_edges
    within = candidate_at(candidates, 0.5 * (edges[2] + edges[3]), 0.5 * (edges[7] + edges[8]))
    shifted = candidate_at(candidates, edges[3], edges[8])
    track = slice(0, fitted.measurements.blocks["height"].stop)
    exact, other = (
        responses_of([Probe(one.model, one.amplitudes[0][0])], fitted.prepared, fitted.measurements)[track, 0]
        for one in (within, shifted)
    )
    # 1.4 % of a patch and 0.4 % of a gust or a force, which half a cell's shift changes by 11 to 13 %
    apart = np.linalg.norm(within.free.columns[track, 0] - exact)
    assert apart < 0.03 * np.linalg.norm(exact)
    assert apart < 0.2 * np.linalg.norm(other - exact)


def test_a_patch_changes_gliding_alone_or_both_at_every_place(fitted: FittedRun) -> None:
    hypothesis = BY_NAME["snow_patch"]
    responses = responses_of(hypothesis.probes(fitted), fitted.prepared, fitted.measurements)
    candidates = hypothesis.candidates(fitted, responses)
    half = len(candidates) // 2
    for gliding, both in zip(candidates[:half], candidates[half:], strict=True):
        assert gliding.window == both.window
        assert [name.key for (name,) in gliding.amplitudes] == ["delta_mu_t"]
        assert [name.key for (name,) in both.amplitudes] == ["delta_mu_t", "delta_mu_n"]
        np.testing.assert_array_equal(gliding.free.columns[:, 0], both.free.columns[:, 0])
