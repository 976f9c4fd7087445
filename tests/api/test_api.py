"""What scripts and notebooks use: names, signatures, results in memory and in folders."""

import doctest
import inspect
import pydoc
import re
import subprocess
import sys
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd
import pytest
from a_diagnosis import diagnosis_of, finding_of
from a_run import a_run
from bundled import bundled
from tiny import ANSWERS, Tiny

import sssi_exudyn
from sssi_exudyn.api.result import Result
from sssi_exudyn.api.result_tables import with_units
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.results.summary import Summary

FUNCTIONS = sorted(name for name in sssi_exudyn.__all__ if inspect.isfunction(getattr(sssi_exudyn, name)))
HEAVY = ("numpy", "pandas", "scipy", "exudyn", "numba", "matplotlib")


@pytest.fixture
def result() -> Result:
    return Result(a_run(4.0), {"coordinates.mot": "text\n"})


def test_importing_loads_nothing_heavy() -> None:
    script = f"import sys, sssi_exudyn; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_dir_and_help_show_every_name_and_none_else() -> None:
    assert set(sssi_exudyn.__all__) <= set(dir(sssi_exudyn))
    shown = pydoc.render_doc(sssi_exudyn, renderer=pydoc.plaintext)
    for name in sssi_exudyn.__all__:
        assert name in shown
    assert "__getattr__" not in shown
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        getattr(sssi_exudyn, "simulat")  # noqa: B009 - as a typing error would be


@pytest.mark.parametrize("name", sssi_exudyn.__all__)
def test_every_name_has_a_docstring_with_what_it_is(name: str) -> None:
    documented = inspect.getdoc(getattr(sssi_exudyn, name)) or ""
    assert re.match(r"[A-Z].*\.(\s|$)", documented.split("\n\n")[0].replace("\n", " ") + " ")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_has_types_and_an_example(name: str) -> None:
    function = getattr(sssi_exudyn, name)
    signature = inspect.signature(function)
    assert signature.return_annotation is not signature.empty
    assert all(parameter.annotation is not parameter.empty for parameter in signature.parameters.values())
    examples = re.findall(r">>> (.*)", function.__doc__ or "")
    assert any(f"{name}(" in line for line in examples)
    for line in examples:
        compile(line, name, "exec")
    listed = re.findall(r"^    (\w+)(?:, \w+)* : ", function.__doc__ or "", re.MULTILINE)
    if listed:
        assert set(listed) == set(signature.parameters)


@pytest.mark.parametrize("name", sorted(set(sssi_exudyn.__all__) - set(FUNCTIONS)))
def test_every_class_has_an_example(name: str) -> None:
    examples = doctest.DocTestParser().get_examples(getattr(sssi_exudyn, name).__doc__ or "")
    assert examples
    for example in examples:
        compile(example.source, name, "exec")


@pytest.mark.long(seconds=4)
@pytest.mark.parametrize("name", [name for name in sssi_exudyn.__all__ if name.endswith("Term")])
def test_the_law_of_an_example_keeps_every_rule(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = doctest.DocTestParser().get_examples(getattr(sssi_exudyn, name).__doc__ or "")
    script = ModuleType("script_of_the_example")  # where pickle finds the class
    monkeypatch.setitem(sys.modules, script.__name__, script)
    vars(script).update(sssi_exudyn=sssi_exudyn, dataclass=dataclass, quantity=sssi_exudyn.quantity)
    exec(example.source, vars(script))
    (law,) = (value for value in vars(script).values() if getattr(value, "__module__", "") == script.__name__)
    assert sssi_exudyn.check_term(law)


def test_texts_and_paths_are_taken_alike(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path / "tiny")
    assert sssi_exudyn.read_recording(folder).name == "tiny"
    assert sssi_exudyn.model_of(str(folder)).name == "tiny"


def test_a_result_is_short_to_look_at(result: Result) -> None:
    diagnosed = replace(result, stored=replace(result.stored, diagnosis=diagnosis_of(finding_of("gust", 0.9))))
    recording = bundled("beginner")[0]
    for value in (result, diagnosed, result.summary, result.model, result.stored, recording, diagnosed.diagnosis):
        assert len(repr(value)) < 300
        assert "\n" not in repr(value)
    html = diagnosed._repr_html_()
    assert len(html) < 3000
    assert "<b>hill</b>" not in html  # names come from files
    assert "diagnosis" in html


def test_series_have_units(result: Result) -> None:
    units = result.series.attrs["units"]
    numbers = {name for name in result.series if name not in ("turn", "turn_side", "turn_phase")}
    assert set(units) == numbers
    assert units["left_load_N"] == "N"
    assert units["com_velocity_up_mps"] == "m/s"
    assert units["knee_angle_r_moment_Nm"] == "N m"
    assert "units" not in result.stored.series.attrs  # what is written stays as it was
    assert with_units(pd.DataFrame({"of_no_table": [0.1]})).attrs["units"] == {}


@pytest.mark.usefixtures("words_only")
def test_a_run_in_memory_is_reported_saved_and_loaded(result: Result, tmp_path: Path) -> None:
    page = result.report(str(tmp_path / "page.html"))
    assert "little" in page.read_text(encoding="utf-8")
    saved = result.save(str(tmp_path / "result"))
    assert saved.folder == tmp_path / "result"
    loaded = sssi_exudyn.load(str(tmp_path / "result"))
    pd.testing.assert_frame_equal(loaded.series, result.series)
    assert loaded.opensim == result.opensim
    again = loaded.save(tmp_path / "copy")
    assert (tmp_path / "copy" / "coordinates.mot").read_text(encoding="utf-8") == "text\n"
    assert sssi_exudyn.load(again.folder or "").summary == result.summary
    both = sssi_exudyn.report([loaded, str(tmp_path / "copy"), result], tmp_path / "all.html").read_text(
        encoding="utf-8"
    )
    for own in ("(result)", "(copy)", "(result 3)"):  # three results of one recording
        assert own in both


def test_progress_goes_where_it_is_wanted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from sssi_exudyn.api.progress import progress_of

    seen: list[tuple[str, float | None, str]] = []

    def note(stage: str, share: float | None, detail: str) -> None:
        seen.append((stage, share, detail))

    for wanted in (False, note, True):
        with progress_of(wanted).stage("fit") as stage:
            stage.advance(0.5, "half")
    assert seen == [("fit", None, ""), ("fit", 0.5, "half")]
    text = capsys.readouterr()
    assert text.out == ""
    assert text.err.count("fit") == 1


def test_answers_of_an_import_are_known_by_name(tmp_path: Path) -> None:
    tiny = Tiny().write(tmp_path / "tiny")
    files = [tiny / "motion.bvh", str(tiny / "gps.csv")]
    given: dict[str, Any] = {entry.name: getattr(ANSWERS, entry.name) for entry in fields(ANSWERS)}
    with pytest.raises(InputError, match="did you mean 'mass_kg'"):
        sssi_exudyn.import_files(files, tmp_path / "none", mass=70.0)  # type: ignore[call-arg]
    recording = sssi_exudyn.import_files(files, tmp_path / "made", **given)
    assert recording.skier.mass == 70.0
    assert recording.folder == tmp_path / "made"


@pytest.mark.long
@pytest.mark.usefixtures("words_only", "coarse_skis")
def test_a_short_run_in_memory(tmp_path: Path) -> None:
    recording = bundled("beginner")[0]
    short = replace(recording, stop=recording.start + 1.0)
    slower = sssi_exudyn.model_of(short).with_values({"friction.mu_t": 0.3})
    first, second = sssi_exudyn.simulate(short), sssi_exudyn.simulate(short, tmp_path / "second", model=slower)
    assert first.folder is None
    assert isinstance(first.summary, Summary)
    assert second.turns is None  # none within a second
    assert second.stored.com[-1, 0] < first.stored.com[-1, 0]
    same = sssi_exudyn.simulate(short, model=tmp_path / "second" / "model.toml")
    # the file has all digits of every number
    pd.testing.assert_frame_equal(same.series, sssi_exudyn.load(tmp_path / "second").series)
    strong = sssi_exudyn.muscles(first)
    assert strong.summary.muscles is not None
    assert first.summary.muscles is None
    assert {"muscle_forces.sto", "coordinates.mot"} <= set(strong.opensim)


@pytest.mark.long
@pytest.mark.usefixtures("words_only", "coarse_skis")
def test_a_stretch_of_a_recording_is_simulated_alone(tmp_path: Path) -> None:
    whole = bundled("beginner")[0]
    run = sssi_exudyn.simulate(whole, tmp_path / "stretch", seconds=(4.0, 6.0))
    time = run.series["time_s"]
    assert (time.iloc[0], time.iloc[-1]) == pytest.approx((4.0, 6.0), abs=1e-9)
    assert run.summary.provenance.settings["seconds"] == [4.0, 6.0]
    fixes = run.measured
    assert fixes is not None
    measured = fixes["time_s"][fixes["gps_e_m"].notna()] if "gps_e_m" in fixes else fixes["time_s"]
    assert measured.between(4.0, 6.0).any()
    # the skier starts with the speed that the fixes have there, not with that of the whole recording's begin
    assert run.model.start.velocity_f != sssi_exudyn.model_of(whole).start.velocity_f


def test_a_given_model_keeps_its_own_begin() -> None:
    whole = bundled("beginner")[0]
    with pytest.raises(InputError, match="its own run's begin"):
        sssi_exudyn.simulate(whole, model=sssi_exudyn.model_of(whole), seconds=(4.0, 7.0))


@pytest.mark.parametrize("given", ["3", "5:3", "a:b", "1:2:3", (1.0,), (30.0, 40.0), "0:1.5"])
def test_what_is_no_stretch_is_said(given: Any) -> None:
    with pytest.raises(InputError, match="stretch"):
        sssi_exudyn.simulate(bundled("beginner")[0], seconds=given)


def test_a_run_too_long_to_be_simulated_is_refused_before_anything_is_computed() -> None:
    whole = bundled("beginner")[0]
    with pytest.raises(InputError, match=r"1201 s are more than the 1200 s .* --seconds BEGIN:END"):
        sssi_exudyn.simulate(replace(whole, stop=whole.start + 1201.0))


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
def test_one_worker_of_a_sweep_works_in_this_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise AssertionError("a process was started")

    monkeypatch.setattr("sssi_exudyn.sweeps.workers.pools.ProcessPoolExecutor", none)
    settings = {
        "format": 1,
        "recordings": [str(bundled("beginner")[0].folder)],
        "duration_s": 0.5,
        "design": {"kind": "grid"},
        "parameter": [{"name": "friction.mu_t", "values": [0.05, 0.1]}],
    }
    swept = sssi_exudyn.sweep(settings, tmp_path / "sweep", workers=1)
    assert swept.counts["done"] == 2
    assert swept.table["friction.mu_t"].tolist() == [0.05, 0.1]
    assert swept.table.attrs["units"]["mean_speed_mps"] == "m/s"
    assert len(repr(swept)) < 300
    assert len(swept._repr_html_()) < 1000
    assert swept.report(str(tmp_path / "page.html")).is_file()
    assert sssi_exudyn.load_sweep(tmp_path / "sweep").counts == swept.counts
