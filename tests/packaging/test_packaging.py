"""The installed package: the packages that exist, under their one name, with their data and without anything else."""

import ast
import importlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = {".md", ".ipynb", ".bvh", ".csv"}
FOLDERS = ("bodies", "contact", "fitting", "validation")


def installed() -> list[Path]:
    """List every file that is installed, relative to the package; the four model folders by their names in it."""
    tops = {Path(): ROOT / "sssi_exudyn"} | {Path(name): ROOT / name for name in (*FOLDERS, "examples")}
    kinds = {".py", ".toml", ".css", ".js", ".json"}
    return sorted(
        below / path.relative_to(top)
        for below, top in tops.items()
        for path in top.rglob("*")
        if path.suffix in (kinds | EXAMPLES if below == Path("examples") else kinds) or path.name == "py.typed"
        if below != Path() or path.relative_to(top).parts[0] not in FOLDERS
    )


@pytest.fixture(scope="module")
def declared() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a copy of the sources alone, without other files of a developer's tree."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    names = ("pyproject.toml", "README.md", "LICENSE", "sssi_exudyn", "examples", *FOLDERS)
    subprocess.run(["cp", "-a", *(str(ROOT / name) for name in names), str(source)], check=True)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    arguments = [*command, "--wheel-dir", str(folder), str(source)]
    done = subprocess.run(arguments, check=True, capture_output=True, text=True)
    assert "absent from the `packages`" not in done.stderr  # a page of warnings at every installation
    (built,) = folder.glob("*.whl")
    return built


def test_package_list_is_the_folders_that_exist(declared: dict[str, Any]) -> None:
    packages = {".".join(("sssi_exudyn", *path.parts[:-1])) for path in installed() if path.suffix == ".py"}
    data = [path for name in ("recording", "bench") for path in ROOT.glob(f"examples/*/{name}.toml")]
    examples = {f"sssi_exudyn.examples.{path.parent.name}" for path in data}
    assert set(declared["tool"]["setuptools"]["packages"]) == packages | examples


@pytest.mark.parametrize("name", FOLDERS)
def test_model_folders_are_one_package_under_one_name(name: str, declared: dict[str, Any]) -> None:
    link = ROOT / "sssi_exudyn" / name
    assert link.is_symlink()
    assert link.resolve() == (ROOT / name).resolve()
    assert not link.readlink().is_absolute()
    assert declared["tool"]["setuptools"]["package-dir"][f"sssi_exudyn.{name}"] == name
    command = [sys.executable, "-c", f"import {name}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert f"sssi_exudyn.{name}" in done.stderr.splitlines()[-1]


def test_every_dependency_is_imported_and_every_import_is_a_dependency(declared: dict[str, Any]) -> None:
    named = {re.split(r"[<>=]", entry)[0].replace("-", "_") for entry in declared["project"]["dependencies"]}
    wanted = {{"scikit_learn": "sklearn"}.get(name, name) for name in named}  # the one that is imported by another name
    imported: set[str] = set()
    for folder in ("sssi_exudyn", *FOLDERS):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Import):
                    imported |= {name.name.partition(".")[0] for name in node.names}
                elif isinstance(node, ast.ImportFrom) and node.module:
                    imported.add(node.module.partition(".")[0])
    third_party = imported - sys.stdlib_module_names - {"sssi_exudyn"}
    # pandas writes Parquet through pyarrow, which it loads by itself.
    assert third_party | {"pyarrow"} == wanted


def test_every_library_of_the_import_extra_is_asked_for_somewhere(declared: dict[str, Any]) -> None:
    wanted = {re.split(r"[<>=]", entry)[0] for entry in declared["project"]["optional-dependencies"]["import"]}
    asked = {
        str(node.args[0].value).partition(".")[0]
        for path in (ROOT / "sssi_exudyn").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "library"
        if isinstance(node.args[0], ast.Constant)
    }
    assert asked == wanted


@pytest.mark.long
def test_wheel_holds_every_module_and_table_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert inside == {f"sssi_exudyn/{path}" for path in installed()}


@pytest.mark.long
def test_source_distribution_holds_tests_examples_and_site(tmp_path: Path) -> None:
    source = tmp_path / "source"
    left_out = shutil.ignore_patterns(
        ".*", "*.egg-info", "__pycache__", "generated", "site", "build", "dist", "results"
    )
    shutil.copytree(ROOT, source, symlinks=True, ignore=left_out)
    shutil.copytree(ROOT / "sssi_exudyn" / "results", source / "sssi_exudyn" / "results")  # a package of that name
    shutil.copytree(ROOT / "tests" / "results", source / "tests" / "results")
    script = "from setuptools.build_meta import build_sdist; build_sdist('made')"
    subprocess.run([sys.executable, "-c", script], cwd=source, check=True, capture_output=True)
    (built,) = (source / "made").glob("*.tar.gz")
    with tarfile.open(built) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    for wanted in (
        *(
            "tests/conftest.py",
            "tests/support/tiny.py",
            "tests/results/old_result/summary.json",
            "mkdocs.yml",
            "Makefile",
        ),
        *("examples/beginner/motion.bvh", "examples/first_run.ipynb", "docs/index.md", "docs/images/report.png"),
        *("contact/terms/friction.py", "bodies/ski/skis.toml", "conda/meta.yaml", "CITATION.cff", "CHANGELOG.md"),
    ):
        assert wanted in inside, wanted


def test_every_recipe_has_the_same_version_and_dependencies(declared: dict[str, Any]) -> None:
    version = declared["project"]["version"]
    recipe = (ROOT / "conda" / "meta.yaml").read_text(encoding="utf-8")
    assert f'set version = "{version}"' in recipe
    assert f"version: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    run = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    required = {line.strip(" -").replace(" ", "").replace("matplotlib-base", "matplotlib") for line in run.splitlines()}
    assert required == {f"python{declared['project']['requires-python']}", *declared["project"]["dependencies"]}


def test_every_version_of_python_is_tried_on_every_platform(declared: dict[str, Any]) -> None:
    workflows = ROOT / ".github" / "workflows"
    stated = [entry.rpartition(":: ")[2] for entry in declared["project"]["classifiers"] if "Python :: 3." in entry]
    assert f"pythons: '{json.dumps(stated)}'" in (workflows / "platforms.yml").read_text(encoding="utf-8")
    assert "os: [ubuntu-latest, windows-latest, macos-latest]" in (workflows / "tests.yml").read_text(encoding="utf-8")


@pytest.mark.long
def test_wheel_works_away_from_its_source(wheel: Path, tmp_path: Path) -> None:
    target = tmp_path / "installed"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(target), str(wheel)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    script = (
        f"import sys; sys.path.insert(0, {str(target)!r})\n"
        "import sssi_exudyn, sssi_exudyn.bodies, sssi_exudyn.contact, sssi_exudyn.fitting, sssi_exudyn.validation\n"
        "from sssi_exudyn.bodies.ski.ski import read_ski\n"
        "from pathlib import Path\n"
        "read_ski('slalom_165', Path())\n"  # a table that has to travel with the code
        "import contextlib\n"
        "from sssi_exudyn.cli import main\n"
        "with contextlib.suppress(SystemExit): main(['example', 'beginner'])\n"
        "assert Path('beginner', 'motion.bvh').is_file()\n"
        "assert sssi_exudyn.read_recording('beginner').name == 'beginner'\n"
        "modules = [module for name, module in sys.modules.items() if name.startswith('sssi_exudyn')]\n"
        f"assert all(Path(module.__file__).is_relative_to({str(target)!r}) for module in modules)\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True)


def test_functions_of_the_package_are_not_hidden_by_its_modules() -> None:
    # Importing a submodule puts it under its name on the package, over a lazy function of the same name.
    import sssi_exudyn

    modules = {path.stem for path in (ROOT / "sssi_exudyn").iterdir()}
    assert modules.isdisjoint(sssi_exudyn.__all__)


@pytest.mark.parametrize("script", sorted((ROOT / "benchmarks").rglob("*.py")), ids=lambda path: path.name)
def test_what_a_benchmark_imports_of_the_package_exists(script: Path) -> None:
    """Nothing else runs these scripts: a name that has moved would be missed when figures are wanted."""
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("sssi_exudyn"):
            module = importlib.import_module(str(node.module))
            for name in (alias.name for alias in node.names):
                is_module = hasattr(module, "__path__") and importlib.util.find_spec(f"{node.module}.{name}")
                assert hasattr(module, name) or is_module, f"{node.module}.{name}"
