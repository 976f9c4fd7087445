"""One run of a sweep, and the command line that starts it."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from bundled import bundled

from sssi_exudyn import cli
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.sweeps import run as sweep_run
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.file import sweep_from
from sssi_exudyn.sweeps.plan import Plan, plan_sweep
from sssi_exudyn.sweeps.records import last_records
from sssi_exudyn.sweeps.run import perform_run, record_of
from sssi_exudyn.sweeps.table import table_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def plan_of(**settings: Any) -> Plan:
    return plan_sweep(sweep_from({"format": 1, "recordings": ["beginner"], **settings}, EXAMPLES / "swept.toml"))


@pytest.mark.long
def test_run_is_the_simulation_that_its_parameters_say(tmp_path: Path) -> None:
    parameter = [{"name": "friction.mu_t", "values": [0.07]}, {"name": "skier.mass", "values": [72.0]}]
    plan = plan_of(parameter=parameter, duration_s=1.0)
    figures = record_of(plan.job, plan.run(0), tmp_path).figures
    recording, motion = bundled("beginner")
    model = model_of(recording, motion)
    model = replace(model, skier=replace(model.skier, mass=72.0)).with_values({"friction.mu_t": 0.07})
    run = simulate_reduced(model, prepare(model, motion, stop=motion.start + 1.0))
    # the very same computation
    assert figures["down_m"] == float(run.com[-1, 0] - run.com[0, 0])
    assert figures["max_speed_mps"] == float(np.linalg.norm(run.com_velocity, axis=1).max())
    # friction takes what gravity gives and speed does not show, but for air and the joints' work: it takes
    assert figures["friction_work_J"] < 0.0


def test_full_model_adds_joint_moments(tmp_path: Path) -> None:
    plan = plan_of(tier="full", duration_s=0.1, parameter=[{"name": "solver.step", "values": [0.01]}])
    assert perform_run(tmp_path, plan.job, plan.run(0)) == "done"
    records, _ = last_records(tmp_path)
    table = table_of(plan, records)
    assert table["max_penetration_m"][0] > 0.0
    moments = table[[f"max_{name}_moment_Nm" for name in PRESCRIBED]]
    assert moments.notna().all(axis=None)
    series = pd.read_parquet(tmp_path / table["series"][0])
    assert series["knee_angle_r_moment_Nm"].abs().max() == pytest.approx(
        table["max_knee_angle_r_moment_Nm"][0], rel=1e-6
    )  # single precision
    assert perform_run(tmp_path, plan.job, plan.run(0)) == "done"  # not run again
    assert len(last_records(tmp_path)[0]) == 1


@pytest.mark.long
def test_fits_are_swept_without_any_parameter(tmp_path: Path) -> None:
    plan = plan_of(task="fit", method="paper", duration_s=3.0)
    record = record_of(plan.job, plan.run(0), tmp_path)
    assert record.error == ""
    # half to twice the truth in 3 s: that it is a fit, not how good
    assert 0.03 < record.figures["fitted_mu_t"] < 0.12
    assert record.figures["converged"] == 1.0
    assert list(record.figures) == [column.name for column in plan.columns]


@pytest.mark.long(seconds=7)
def test_joint_fits_of_a_sweep_are_those_of_sssi_fit(tmp_path: Path) -> None:
    plan = plan_of(task="fit", duration_s=3.0)
    record = record_of(plan.job, plan.run(0), tmp_path)
    assert record.error == ""
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + 3.0)
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    fitted = estimate(problem_of(recording, motion, model, "joint"), recording, motion, full=False).fitted
    # the very same computation, of whose numbers a table has the first
    assert record.figures["fitted_mu_t"] == fitted.value("friction.mu_t")
    assert record.figures["fitted_mu_n_se"] == fitted.standard_error("friction.mu_n")
    assert list(record.figures) == [column.name for column in plan.columns]


def test_diverged_run_says_when_and_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    def gives_up(*_: Any) -> Any:
        raise SimulationDiverged(1.25, "Newton's method does not converge")

    monkeypatch.setattr(sweep_run, "simulate_reduced", gives_up)
    plan = plan_of(duration_s=1.0)
    record = record_of(plan.job, plan.run(0), tmp_path)
    assert record.status == "diverged"
    assert "1.250 s" in record.error
    table = table_of(plan, {record.key: record})
    assert table["mean_speed_mps"].isna().all()


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> Callable[[list[str]], tuple[int, dict[str, Any]]]:
    """Call the command line with functions of ``sweeps`` that only note their arguments."""
    call_noted: dict[str, Any] = {}

    def note(name: str) -> Callable[..., dict[str, Any]]:
        def noted(*positional: Any, **named: Any) -> dict[str, Any]:
            call_noted.update(named, name=name, given=positional)
            return {"name": "swept", "runs": 3, "done": 3, "diverged": 0, "failed": 0, "crashed": 0, "left": 0}

        return noted

    for name in ("sweep", "resume", "retry", "status"):
        monkeypatch.setattr(sweeps, name, note(name))

    def call(arguments: list[str]) -> tuple[int, dict[str, Any]]:
        with pytest.raises(SystemExit) as end:
            cli.main(arguments)
        assert isinstance(end.value.code, int)
        return end.value.code, call_noted

    return call


def test_command_line_knows_files_and_verbs(
    called: Callable[[list[str]], tuple[int, dict[str, Any]]], capsys: pytest.CaptureFixture[str]
) -> None:
    code, seen = called(["sweep", "file.toml", "--out", "dir", "--workers", "3", "--cluster", "local"])
    assert (code, seen["name"], seen["given"]) == (0, "sweep", (Path("file.toml"), Path("dir")))
    assert (seen["workers"], seen["cluster"], seen["scheduler"]) == (3, "local", None)
    assert "swept" in capsys.readouterr().out
    for verb, more in (("status", []), ("resume", []), ("retry", ["--failed"])):
        code, seen = called(["sweep", verb, "dir", *more, "--json"])
        assert (code, seen["name"], seen["given"]) == (0, verb, (Path("dir"),))
        assert json.loads(capsys.readouterr().out)["runs"] == 3


def test_command_line_refuses_no_workers(
    called: Callable[[list[str]], tuple[int, dict[str, Any]]], capsys: pytest.CaptureFixture[str]
) -> None:
    code, _ = called(["sweep", "resume", "dir", "--workers", "0"])
    assert code == 2
    assert "--workers" in capsys.readouterr().err


def test_folder_without_a_sweep_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        cli.main(["sweep", "status", str(tmp_path)])
    assert end.value.code == 2
    assert "holds no sweep" in capsys.readouterr().err
