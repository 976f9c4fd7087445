"""Other people's laws, hypotheses and readers: used when they are named, recorded where they are needed."""

from __future__ import annotations

import importlib
import json
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import pytest
import tomli_w
from a_run import a_run
from bundled import bundled
from plugged import as_it_was
from tiny import ANSWERS, Tiny

import sssi_exudyn
from sssi_exudyn.cli import main
from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.registry import term_named, terms_table
from sssi_exudyn.contact.term import FootState, FootTerm
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantity
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.parameters import seek_too
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.toml import model_to_dict, read_model
from sssi_exudyn.plugins import use_plugin
from sssi_exudyn.recording.instruments.gps import READERS
from sssi_exudyn.reports.sections.terms import terms as terms_section
from sssi_exudyn.runtime.plugins import origin_of
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.plan import plan_sweep
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES, LATENT_FORCE, STEADY_LAWS

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_snow.py"


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    with as_it_was():
        yield


@pytest.fixture
def snow(tmp_path: Path) -> Path:
    """Copy the example's plug-in into a file that may be changed."""
    return Path(shutil.copy(EXAMPLE, tmp_path / "my_snow.py"))


def failing(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that is refused and return its error line."""
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize("before", [True, False])
def test_the_command_line_takes_it_before_and_after_the_command(
    before: bool, snow: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    option = ["--plugin", str(snow)]
    with pytest.raises(SystemExit) as end:
        main([*option, "terms", "--json"] if before else ["terms", "--json", *option])
    assert end.value.code == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["wet_snow"]["unit"] == "s^2/m^2"


def test_its_hypothesis_is_weighed_and_what_nothing_explains_stays_last(snow: Path) -> None:
    use_plugin(snow)
    use_plugin(str(snow))  # twice is once
    assert [hypothesis.name for hypothesis in HYPOTHESES].count("wet_snow") == 1
    assert HYPOTHESES[-1] is LATENT_FORCE
    assert BY_NAME["wet_snow"] in STEADY_LAWS


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("x = 1\n", "it offers no force term, hypothesis or reader"),
        ("x = 1\n1 / 0\n", "line 2: ZeroDivisionError"),
        ("def f(:\n", "line 1: SyntaxError"),
        ("import sys\nsys.exit(3)\n", "line 2: SystemExit"),
    ],
)
def test_faulty_plugins_are_one_clear_line(
    text: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "faulty.py"
    path.write_text(text, encoding="utf-8")
    assert line in failing(["--plugin", str(path), "terms"], capsys)


def test_a_missing_plugin_and_a_name_that_is_taken(snow: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.py: no such file"):
        use_plugin(tmp_path / "none.py")
    with pytest.raises(InputError, match="no package of this name"):
        use_plugin("no-such-package-of-laws")
    snow.write_text(snow.read_text(encoding="utf-8").replace('"wet_snow"', '"friction"'), encoding="utf-8")
    with pytest.raises(InputError, match="there is a force term named 'friction' already"):
        use_plugin(snow)


def test_a_model_records_it_and_without_it_says_so_and_stops(snow: Path, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    with as_it_was():
        use_plugin(snow)
        model = model_of(*bundled("beginner"))
        model = replace(model, terms=(*model.terms, term_named("wet_snow")(c=0.002)))  # type: ignore[call-arg]
        path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
        again = read_model(path)
        assert again.value("wet_snow.c") == 0.002
        assert any("s^2/m^2" in str(block) for block in terms_section([replace(a_run(2.0), model=again)]).blocks)
    assert "my_snow.py" in path.read_text(encoding="utf-8")
    assert str(tmp_path) not in path.read_text(encoding="utf-8")  # no place of this machine
    with pytest.raises(InputError, match=r"needs the plug-in 'my_snow.py'.*--plugin my_snow.py"):
        read_model(path)
    assert sssi_exudyn.read_model(path, plugins=[snow]).value("wet_snow.c") == 0.002


def test_another_plugin_of_the_name_is_refused(snow: Path, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    with as_it_was():
        use_plugin(snow)
        model = replace(model_of(*bundled("beginner")), terms=(term_named("wet_snow")(),))
        path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
    snow.write_text(snow.read_text(encoding="utf-8").replace("-self.c", "-2.0 * self.c"), encoding="utf-8")
    with pytest.raises(InputError, match="not what it was when this was written"):
        sssi_exudyn.read_model(path, plugins=[snow])


def test_a_file_that_was_changed_takes_the_place_of_what_it_was(snow: Path, tmp_path: Path) -> None:
    text = snow.read_text(encoding="utf-8")
    use_plugin(snow)
    first = term_named("wet_snow")
    snow.write_text(text.replace("-self.c", "-2.0 * self.c"), encoding="utf-8")
    use_plugin(snow)
    second = term_named("wet_snow")
    assert second is not first
    assert [hypothesis.name for hypothesis in HYPOTHESES].count("wet_snow") == 1
    assert type(BY_NAME["wet_snow"]).__module__ == second.__module__
    path = tmp_path / "model.toml"
    snow.write_text(text, encoding="utf-8")
    use_plugin(snow)  # and back again
    model = replace(model_of(*bundled("beginner")), terms=(term_named("wet_snow")(),))
    path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
    assert type(read_model(path).terms[0]) is first


def test_a_file_runs_nothing(snow: Path, tmp_path: Path) -> None:
    folder = tmp_path / "from_elsewhere"
    folder.mkdir()
    (folder / "evil.py").write_text("import pathlib\npathlib.Path('run').touch()\n", encoding="utf-8")
    table = model_to_dict(model_of(*bundled("beginner"))) | {"plugin": [{"name": "evil.py"}]}
    (folder / "model.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    with pytest.raises(InputError, match="not loaded"):
        read_model(folder / "model.toml")
    assert not (folder / "run").exists()
    assert not Path("run").exists()


@pytest.mark.parametrize("plugin", ["x", [1], [{"digest": "x"}], [{"name": "a", "path": "/tmp"}], [{"name": 3}]])
def test_faulty_records_are_one_clear_line(plugin: object, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(tomli_w.dumps(model_to_dict(model_of(*bundled("beginner"))) | {"plugin": plugin}))
    with pytest.raises(InputError, match=r"\[\[plugin\]\]"):
        read_model(path)


@pytest.mark.parametrize("package", ["laws_of_wet_snow", "sssi_exudyn_snow"])
def test_an_installed_package_is_used_when_it_is_named(
    package: str, snow: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / package).mkdir()
    shutil.copy(snow, tmp_path / package / "laws.py")
    (tmp_path / package / "__init__.py").write_text(
        "from sssi_exudyn import FixReader\n"
        "from sssi_exudyn.recording.instruments.gps import fixes_csv\n"
        f"from {package}.laws import FrictionOfWetSnow, WetSnow\n"
        "reader = FixReader('.wet', fixes_csv)\n"
    )
    about = tmp_path / f"{package}-1.2.dist-info"
    about.mkdir()
    name = package.replace("_", "-")
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
    (about / "entry_points.txt").write_text(
        f"[sssi_exudyn.terms]\nwet = {package}:WetSnow\n"
        f"[sssi_exudyn.hypotheses]\nwet = {package}:FrictionOfWetSnow\n"
        f"[sssi_exudyn.readers]\nwet = {package}:reader\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(KeyError):
        term_named("wet_snow")
    use_plugin(package)
    assert "wet_snow" in BY_NAME
    assert ".wet" in READERS
    origin = origin_of(term_named("wet_snow"))
    assert origin is not None
    assert origin.as_table() == {"name": name, "digest": "1.2"}  # however it was written
    origins = {row["name"]: row["origin"] for row in terms_table()}
    assert origins["wet_snow"] == name
    assert origins["friction"] == "built in"


def test_readers_of_plugins_read_what_is_imported(tmp_path: Path) -> None:
    path = tmp_path / "formats.py"
    path.write_text(
        "from sssi_exudyn import FixReader, MotionReader\n"
        "from sssi_exudyn.recording.instruments.bvh import read_bvh\n"
        "from sssi_exudyn.recording.instruments.gps import fixes_csv\n"
        "motions = MotionReader('.mine', lambda path, height: (read_bvh(path), None))\n"
        "fixes = FixReader('.fixes', fixes_csv)\n"
    )
    tiny = Tiny().write(tmp_path / "tiny")
    files = [Path(shutil.copy(tiny / "motion.bvh", tmp_path / "a.mine")), tmp_path / "a.fixes"]
    shutil.copy(tiny / "gps.csv", files[1])
    with pytest.raises(InputError, match=r"no reader for '.mine'"):
        import_recording(files, tmp_path / "none", ANSWERS)
    use_plugin(path)
    assert import_recording(files, tmp_path / "made", replace(ANSWERS, gps_offset_s=0.0)).gps is not None
    path.write_text(path.read_text(encoding="utf-8").replace(".fixes", ".gpx"), encoding="utf-8")
    with pytest.raises(InputError, match="have a reader already"):
        use_plugin(path)


@dataclass(frozen=True)
class Sticky(FootTerm):
    """Friction that sticks.

    Formula: f_t = −c·ΣF_N·sign(v_t)
    """

    name: ClassVar[str] = "sticky"
    corrects: ClassVar[str] = "friction"
    sources: ClassVar[tuple[str, ...]] = ("made up for the tests",)

    c: float = quantity(0.0, "1", low=0.0, high=0.5, source="made up", meaning="how sticky it is")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        return -self.c * state.load * math.saturate(state.v_t, 0.1), 0.0


def test_a_class_of_a_notebook_is_saved_and_read_where_it_was_defined(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    model = replace(model_of(*bundled("beginner")), terms=(Sticky(c=0.1),))
    path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
    with pytest.raises(InputError, match="needs the plug-in 'test_plugins'"):
        read_model(path)
    use_plugin(Sticky)
    assert read_model(path).terms == (Sticky(c=0.1),)
    with pytest.raises(InputError, match="neither a force term"):
        use_plugin(3)


def test_numbers_of_own_laws_are_sought_along() -> None:
    recording, motion = bundled("beginner")
    model = model_of(*bundled("beginner"))
    model = replace(model, terms=(*model.terms, Sticky(c=0.1)))
    problem = problem_of(recording, motion, model, "joint")
    more = seek_too(problem, ["sticky.c", "penetration.k"])
    assert more.names == (*problem.names, "sticky.c", "penetration.k")
    assert more.priors["sticky.c"].mean == 0.1
    assert more.priors["sticky.c"].sigma == 0.25  # half the range of its bounds
    assert seek_too(problem_of(recording, motion, model, "paper"), ["sticky.c"]).priors == {}
    for name, message in (("sticky.d", "did you mean 'sticky.c'"), ("friction.mu_t", "fitted anyway")):
        with pytest.raises(InputError, match=message):
            seek_too(problem, [name])


@pytest.mark.long(seconds=20)
@pytest.mark.usefixtures("words_only", "coarse_skis")
def test_own_laws_act_and_are_reported(snow: Path, tmp_path: Path) -> None:
    use_plugin(snow)
    recording, _ = bundled("beginner")
    short = replace(recording, stop=recording.start + 1.0)
    wet = term_named("wet_snow")
    # over arrays, which compiles nothing
    dry, slow = (sssi_exudyn.simulate(short, terms=[wet(c=c)], backend="numpy") for c in (0.0, 0.01))  # type: ignore[call-arg]
    assert slow.stored.com[-1, 0] < dry.stored.com[-1, 0] - 0.05
    saved = slow.save(tmp_path / "slow")
    assert "c·v_t²" in (tmp_path / "slow" / "report.html").read_text(encoding="utf-8")
    origin = json.loads((tmp_path / "slow" / "summary.json").read_text(encoding="utf-8"))["provenance"]
    assert origin["settings"]["plugins"][0]["name"] == "my_snow.py"
    script = "import sys; from sssi_exudyn.cli import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", script, "report", str(saved.folder), "--out", str(tmp_path / "again.html")]
    alone = subprocess.run(command, capture_output=True, text=True, check=False)
    assert alone.returncode == 2
    assert "needs the plug-in 'my_snow.py'" in alone.stderr
    named = subprocess.run([*command, "--plugin", str(snow)], capture_output=True, text=True, check=False)
    assert named.returncode == 0, named.stderr


def sweep_of_wet_snow() -> dict[str, object]:
    return {
        "format": 1,
        "recordings": [str(bundled("beginner")[0].folder)],
        "duration_s": 0.3,
        "series": False,
        "term": [{"name": "wet_snow"}],
        "parameter": [{"name": "wet_snow.c", "values": [0.0, 0.01]}],
    }


def test_a_sweep_records_it_and_workers_get_what_the_user_named(snow: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no force term is named 'wet_snow'"):
        sweeps.sweep(sweep_of_wet_snow(), tmp_path / "out")
    with as_it_was():
        use_plugin(snow)
        file = sweeps.sweep_from(sweep_of_wet_snow(), tmp_path / "sweep.toml")
        job = plan_sweep(file).job
        assert [plugin.source for plugin in job.plugins] == [str(snow)]
        copy = file.portable(tmp_path)
        assert copy["plugin"][0]["name"] == "my_snow.py"
        assert str(snow) not in str(copy["plugin"])
    with pytest.raises(InputError, match=r"needs the plug-in 'my_snow.py'"):
        sweeps.sweep_from(copy, tmp_path / "sweep.toml")
    use_plugin(Sticky)
    own = {**sweep_of_wet_snow(), "term": [{"name": "sticky"}], "parameter": [{"name": "sticky.c", "values": [0.1]}]}
    with pytest.raises(InputError, match="worker processes cannot load the law of 'test_plugins'"):
        sweeps.sweep(own, tmp_path / "own", workers=2)


@pytest.mark.slow
def test_own_laws_are_swept_by_workers(snow: Path, tmp_path: Path) -> None:
    swept = sssi_exudyn.sweep(sweep_of_wet_snow(), tmp_path / "out", workers=2, plugins=[snow])
    assert swept.counts["done"] == 2
    first, second = swept.table["mean_speed_mps"]
    assert second < first


@pytest.mark.slow
def test_own_laws_are_fitted(snow: Path, tmp_path: Path) -> None:
    recording, _ = bundled("beginner")
    short = replace(recording, stop=recording.start + 4.0)
    use_plugin(snow)
    fit = sssi_exudyn.fit(short, terms=[term_named("wet_snow")()], parameters=["wet_snow.c"])
    estimate = (fit.fitted.parameters or {})["wet_snow.c"]
    assert estimate.value is not None
    assert estimate.se is not None
    assert 0.0 < estimate.se < 0.005  # the track says something: half the range was known beforehand
    assert "wet_snow.c" in fit.summary.fit.parameters  # type: ignore[operator]


PAGES = EXAMPLE.parents[1] / "docs"


@pytest.mark.long(seconds=15)
def test_the_page_s_snippets_work_as_they_are_written(monkeypatch: pytest.MonkeyPatch) -> None:
    page = next(PAGES.rglob("own-law.md")).read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    law, use, *_ = blocks
    module = ModuleType("page_of_laws")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.chdir(EXAMPLE.parents[1])
    exec(law, vars(module))
    assert sssi_exudyn.check_term(vars(module)["WetSnow"])
    exec(use, vars(module))
    assert vars(module)["WetSnow"].__module__.startswith("sssi_plugin_my_snow")
    hypothesis = next(block for block in blocks if "SteadyLaw" in block)
    exec(hypothesis, vars(module))
    (row,) = (row for row in sssi_exudyn.hypotheses() if row["name"] == "wet_snow")
    assert row["adds"] == "suction of a water film"


@pytest.mark.long
def test_what_was_loaded_is_returned_and_can_be_pickled(snow: Path) -> None:
    loaded = sssi_exudyn.use_plugin(snow)
    assert list(loaded) == ["WetSnow", "FrictionOfWetSnow"]
    law = loaded["WetSnow"](c=0.001)
    assert pickle.loads(pickle.dumps(law)) == law
    assert pickle.loads(pickle.dumps(loaded["WetSnow"])) is loaded["WetSnow"]
    script = (
        f"import pickle, sys, sssi_exudyn; sssi_exudyn.use_plugin({str(snow)!r});"
        "print(pickle.loads(sys.stdin.buffer.read()).c)"
    )
    done = subprocess.run([sys.executable, "-c", script], input=pickle.dumps(law), capture_output=True, check=True)
    assert float(done.stdout) == 0.001


def test_a_plug_in_imports_its_neighbour_and_is_another_one_when_that_changes(snow: Path) -> None:
    snow.with_name("my_table.py").write_text("FACTOR = 2.0\n", encoding="utf-8")
    snow.write_text(f"{snow.read_text(encoding='utf-8')}\nfrom my_table import FACTOR\n", encoding="utf-8")
    before = list(sys.path)
    first = origin_of(use_plugin(snow)["WetSnow"])
    assert sys.path == before
    assert sys.modules["my_table"].FACTOR == 2.0
    snow.with_name("my_table.py").write_text("FACTOR = 30.0\n", encoding="utf-8")
    importlib.invalidate_caches()
    second = origin_of(use_plugin(snow)["WetSnow"])
    assert first is not None
    assert second is not None
    assert first.digest != second.digest
    assert sys.modules["my_table"].FACTOR == 30.0


def test_neighbours_of_one_name_are_each_plug_in_s_own(tmp_path: Path) -> None:
    values = []
    for number in (1, 2):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "constants_of_snow.py").write_text(f"SIZE = {number}\n", encoding="utf-8")
        text = EXAMPLE.read_text(encoding="utf-8").replace('"wet_snow"', f'"wet_snow_{number}"')
        (folder / f"snow_{number}.py").write_text(f"{text}\nfrom constants_of_snow import SIZE\n", encoding="utf-8")
        cls = use_plugin(folder / f"snow_{number}.py")["WetSnow"]
        values.append(vars(sys.modules[cls.__module__])["SIZE"])
    assert values == [1, 2]


def test_the_command_lists_the_hypotheses_with_a_plug_in_s(snow: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--plugin", str(snow), "hypotheses", "--json"])
    assert end.value.code == 0
    rows = json.loads(capsys.readouterr().out)
    assert sum(row["prior"] for row in rows) == pytest.approx(1.0, abs=1e-3)  # each is rounded to 1e-4
    assert {row["origin"] for row in rows} == {"built in", "my_snow.py"}
    assert rows[-1]["name"] == LATENT_FORCE.name
