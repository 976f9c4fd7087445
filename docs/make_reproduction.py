"""Makes ``docs/notebook/reproduction.md``: the paper's Table 1 and its Figures 4 to 8 in numbers, next to this program's
results.

The results are those of the two bundled recordings.

Run it as ``python docs/make_reproduction.py [RESULTS]``; it fits and simulates both recordings into the folder RESULTS
(``results/reproduction`` unless given) and takes a few minutes.  Results that are already in RESULTS are not computed
again.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from make_measured_turns import section
from scipy.ndimage import uniform_filter1d

import sssi_exudyn
from sssi_exudyn.analysis.biomechanics import ResidualMoment, Spread, residual_moment, shift
from sssi_exudyn.analysis.turns import Turn
from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.fitting.first_fit import fit_reduced, problem_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.reports.sections.tables import friction, with_spread
from sssi_exudyn.reports.sections.turn_tables import peak_moment
from sssi_exudyn.reports.sentences import mean_of, spread_of
from sssi_exudyn.results.folder import SUMMARY
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.validation.agreement import filtered_ratio
from sssi_exudyn.validation.metrics import path_length

ROOT = Path(__file__).parents[1]
NAMES = ("beginner", "intermediate")

HEAD = """# The paper's results next to this program's

Made by `python docs/make_reproduction.py`, which runs `sssi run` on both bundled recordings (and `sssi fit --method paper`,
for one row). *Paper* is Gao et al.; *here* is what the program finds in the bundled recording of that name, mean over its
complete turns (± their standard deviation; for friction ± the standard error); *recorded* is the same figure from the
recording's own GPS and insoles, without any simulation, where they give it.

The bundled recordings are not the paper's: its data are not public. They come from a simulated world, which is no part of
this program, with skiers, slopes and friction like the paper's. So friction can be compared with the paper's as with a
true value; how the skiers move and load their skis belongs to the recordings, and `recorded` shows it. The skiers are in
balance: snow, air and gravity alone can make their motion. Their snow is a plane, which the estimate does not know: it
takes the snow for a surface of unknown height, and finds it plane to {flat} m.

"""

CLOSE = """
## Why they differ

"""

WHY: dict[str, str] = {
    "a": "The recordings were made with the paper's friction, so the difference is the program's error: {z}. The standard "
    "error counts all that the estimate takes as uncertain (`docs/theory/uncertainty.md`).",
    "b": "The paper's snow, slope and GPS are real, the bundled ones are a plane of even snow and a GPS with 2 cm of noise; "
    "start, heading, snow surface and the errors of capture and instruments are estimated here, too. The paper's two "
    "parameters alone take the start from the first fixes, and friction makes up for its error; with start and heading "
    "fitted too, on the captured posture, it does not.",
    "c": "The slope is given with the recording, not found.",
    "d": "The paper compares the snow's normal force with the insoles, as do the rows in brackets; the others take what presses "
    "square on the sole (`docs/notebook/decisions/0003-what-insoles-feel.md`). The insoles are among what the estimate fits, so their agreement "
    "proves little; the fits of the paper's two parameters, which do not see them, have correlations of {apart}. The paper gives "
    "nothing for its intermediate, who wore no insoles.",
    "e": "A property of the recording: its skiers turn about as the paper's do, not just as they do. Capture and GPS fix it, and "
    "the simulation follows them (`recorded`). Both shifts count from the instant at which the path of the centre of mass "
    "turns least, found on the simulated path.",
    "f": "The angle lies between the captured heading of a foot and its direction of travel, both of which the recording fixes: its "
    "beginner skids less and its intermediate carves more purely than the paper's. Means are over both skis and the whole "
    "turn; the paper does not say over what it takes its own.",
    "g": "The paper says that its beginner is inside of one ski throughout, its intermediate always inside of both. Here inside "
    "of both is: beyond the lines of both skis, towards the turn's centre. Around a transition, where the skier crosses from "
    "one side to the other, no skier is.",
    "h": "The world that made the recordings put {truth} of the load on the outside ski; the insoles show it, and the simulation "
    "agrees to 0.01. So the bundled intermediate loads his skis as the paper's does, the bundled beginner stands on the inside ski "
    "a little more than the paper's. The insoles are among what is fitted; without them, by the paper's two parameters, the shares are "
    "{alone}.",
    "i": "On an edged ski friction across it bears a part of the load. The whole force is near to the paper's figures, which do "
    "not say what they include. The insoles agree with it, less the 6 % that the boot's cuff carries.",
    "j": "A property of the recording: its skiers shift their load sooner than the paper's beginner. The insoles cross at the "
    "same time.",
    "k": "The paper's order is met, and the beginner's knee nearly so; the intermediate's moment is about half of the paper's. His "
    "load is not less: the outside ski bears {outside:.2f} body weights in all in the control phase, by the paper's figures 1.12. "
    "What differs is the lever: the peak over that force is {levers} m here, 0.10 and 0.25 m in the paper. A force from the ankle "
    "to the hip passes the knee at 0.25 m where a leg of his length is bent by {needed:.0f}°; the bundled intermediate's outside "
    "knee is bent by {bent:.0f}° in the control phase. The paper does not give the angles that would show its own. Its figures for "
    "the hip are the largest of both skiers.",
    "l": "The paper does not report it. Nothing holds a real skier's pelvis, so it should be none. By the physics of the world "
    "that made the recordings it is {own} N m with the true posture, and {recorded} with the recorded one, whose error is the capture's: "
    "as here. The estimate corrects the posture within that error, which lessens the mean square, not every peak. What is left stands "
    "at the changes of turns for some hundredths of a second: averaged over 0.1 s it is {smooth} N m at most. By OpenSim's "
    "thresholds the root mean squares are good (30 N m) and the largest values are not (75 N m).",
}

TRUE: dict[str, dict[str, float]] = {
    "beginner": {"mu_t": 0.06, "mu_n": 0.55, "outside": 0.933},
    "intermediate": {"mu_t": 0.19, "mu_n": 0.90, "outside": 0.800},
}
"""True values of the world that made the recordings: friction, and the outside ski's share."""
OWN_MOMENT = {"own": "13 (75) and 13 (63)", "recorded": "33 (109) and 27 (124)"}
"""N m; root mean square (largest) of the moment about the pelvis there, with the true posture and the recorded one."""
PAPER_LEVER = 0.25
"""m; the paper's 2.74 N m/kg over 0.80 · 1.40 body weights."""
MEAN_OVER = 0.1
"""s over which the moment about the pelvis is averaged."""
_OUTSIDE = ("outside_snow_force_share", "snow_force_bodyweights")
Number = Callable[[StoredRun], str]


@dataclass(frozen=True)
class Row:
    """A figure: the paper's for beginner and intermediate, the program's, the recording's own, and the reason's letter."""

    what: str
    paper: tuple[str, str]
    here: Number
    recorded: Number
    why: str


def nothing(_: StoredRun) -> str:
    return "–"


def main() -> None:
    results = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "results" / "reproduction"
    runs, plain = [], []
    for name in NAMES:
        for out in (results / name, results / f"{name}-paper"):
            if not (out / SUMMARY).is_file():
                if out.name.endswith("-paper"):
                    sssi_exudyn.fit(ROOT / "examples" / name, out, method="paper")
                else:
                    sssi_exudyn.run(ROOT / "examples" / name, out)
        runs.append(read_run(results / name))
        plain.append(read_run(results / f"{name}-paper"))
    alike = {run.name: other for run, other in zip(runs, plain, strict=True)}
    flat = " and ".join(f"{max(-s.lowest_m, s.highest_m):.2f}" for s in (run.summary.surface for run in runs) if s)
    lines = [HEAD.format(flat=flat).rstrip() + "\n", *table(runs, rows(alike)), CLOSE.rstrip() + "\n"]
    lines += [f"- **{letter}**: {why.format(**reasons(runs, plain))}" for letter, why in WHY.items()]
    (ROOT / "docs" / "notebook" / "reproduction.md").write_text("\n".join(lines) + "\n\n" + section(), encoding="utf-8")


def reasons(runs: list[StoredRun], plain: list[StoredRun]) -> dict[str, str | float]:
    """Return the figures that the reasons quote, of beginner and intermediate."""

    def both(form: str, values: list[float]) -> str:
        return " and ".join(form.format(value) for value in values)

    def errors(name: str) -> list[float]:
        estimates = [getattr(run.summary.friction, name) for run in runs]
        return [(mu.value - TRUE[run.name][name]) / mu.se for run, mu in zip(runs, estimates, strict=True)]

    forces = [float(np.prod([mean_of(run.summary, name, "control") or np.nan for name in _OUTSIDE])) for run in runs]
    moments = [peak_moment(run.summary, "knee_angle", "min") or np.nan for run in runs]
    return {
        "z": f"{both('{:+.1f}', errors('mu_t'))} standard errors for μ_t, {both('{:+.1f}', errors('mu_n'))} for μ_n".replace(
            "-", "−"
        ),
        "apart": both("{:.3f}", [run.summary.pressure_ratio.correlation or np.nan for run in plain]),
        "truth": both("{:.3f}", [TRUE[run.name]["outside"] for run in runs]),
        "alone": both("{:.2f}", [mean_of(run.summary, "outside_force_share", "control") or np.nan for run in plain]),
        "outside": forces[1],
        "levers": both("{:.2f}", [m / (GRAVITY * force) for m, force in zip(moments, forces, strict=True)]),
        "needed": bend_of(runs[1], PAPER_LEVER),
        "bent": outside_knee(runs[1]),
        **OWN_MOMENT,
        "smooth": both("{:.0f}", [largest_mean(run) for run in runs]),
    }


def bend_of(run: StoredRun, lever: float) -> float:
    """Return the bend (°) of a knee that is ``lever`` (m) off the line from hip to ankle."""
    assert run.geometry is not None
    thigh, shank = (float(np.linalg.norm(run.geometry.joint_in_parent[SEGMENT[s]])) for s in ("tibia_r", "talus_r"))
    bend = np.radians(np.arange(1.0, 150.0, 0.1))
    off = thigh * shank * np.sin(bend) / np.sqrt(thigh**2 + shank**2 + 2.0 * thigh * shank * np.cos(bend))
    return float(np.degrees(np.interp(lever, off[: np.argmax(off)], bend[: np.argmax(off)])))


def outside_knee(run: StoredRun) -> float:
    """Return the bend (°) of the outside knee, mean over the control phases."""
    means = []
    for turn in complete(run):
        begin, end = turn.phases["control"]
        side = "l" if turn.side == "right" else "r"
        means.append(run.series.loc[(run.time >= begin) & (run.time <= end), f"knee_angle_{side}_deg"].mean())
    return float(np.mean(means))


def largest_mean(run: StoredRun) -> float:
    """Return the largest moment (N m) about the pelvis, averaged over a short while."""
    moment = run.series[[f"pelvis_{name}_moment_Nm" for name in ("rotation", "list", "tilt")]].to_numpy()
    count = round(MEAN_OVER / float(run.time[1] - run.time[0]))
    return float(np.linalg.norm(uniform_filter1d(moment, count, axis=0, mode="nearest"), axis=1).max())


@cache
def as_captured(name: str) -> tuple[Model, ResidualMoment]:
    """Fit friction, start and heading by the reduced model on the captured posture, with its residual moment."""
    recording = read_recording(ROOT / "examples" / name)
    motion = motion_from_recording(recording)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    model = problem.model_at(fit_reduced(problem, prepare(problem.model, motion)).values)
    return model, residual_moment(simulate(model, motion))


def friction_as_captured(run: StoredRun) -> str:
    friction = as_captured(run.name)[0].friction
    return f"({friction.mu_t:.3f}, {friction.mu_n:.3f})"


def moment_left(residual: ResidualMoment) -> str:
    return "–" if residual.rms_Nm is None else f"{residual.rms_Nm:.0f} ({residual.peak_Nm:.0f})"


def table(runs: list[StoredRun], entries: list[Row]) -> Iterator[str]:
    """Yield lines of Markdown."""
    yield "| | " + " | ".join(f"{name}: paper | here | recorded" for name in NAMES) + " | why |"
    yield "|---|" + "---|" * (3 * len(NAMES) + 1)
    for row in entries:
        cells = [f"{row.paper[k]} | {row.here(run)} | {row.recorded(run)}" for k, run in enumerate(runs)]
        yield f"| {row.what} | " + " | ".join(cells) + f" | {row.why} |"


def rows(alike: Mapping[str, StoredRun]) -> list[Row]:
    """Return every figure of the paper's results, in its order; ``alike`` has the runs fitted by the paper's method."""

    def by_paper(run: StoredRun) -> str:
        other = alike[run.name].summary
        mu = ", ".join(f"{getattr(other.friction, name).value:.3f}" for name in ("mu_t", "mu_n"))
        return f"{other.trajectory.percent_of_length:.2f} % ({mu})"

    return [
        Row("Table 1: μ_t", ("0.06", "0.19"), lambda run: friction(run.summary, "mu_t"), nothing, "a"),
        Row("μ_n", ("0.55", "0.9"), lambda run: friction(run.summary, "mu_n"), nothing, "a"),
        Row("trajectory error, share of the path", ("0.7 %", "0.6 %"), of("trajectory", "percent_of_length", "{:.2f} %"), nothing, "b"),
        Row("the same with the paper's two parameters alone (μ_t, μ_n)", ("", ""), by_paper, nothing, "b"),
        Row("friction with start and heading fitted too (μ_t, μ_n)", ("", ""), friction_as_captured, nothing, "b"),
        Row("piste inclination (°)", ("15.4", "16.5"), lambda run: f"{np.degrees(run.model.inclination):.1f}", nothing, "c"),
        Row("Figure 4: mean trajectory error (m)", ("0.134", "–"), of("trajectory", "mean_error_m", "{:.3f}"), nothing, "b"),
        Row("pressure ratio, correlation", ("0.964", "–"), of("pressure_ratio", "correlation", "{:.3f}"), nothing, "d"),
        Row("(of the normal forces)", ("", ""), of("pressure_ratio", "snow_correlation", "{:.3f}"), nothing, "d"),
        Row("pressure ratio, root mean squared difference", ("0.162", "–"), of("pressure_ratio", "rmsd", "{:.3f}"), nothing, "d"),
        Row("(of the normal forces)", ("", ""), of("pressure_ratio", "snow_rmsd", "{:.3f}"), nothing, "d"),
        Row("Figure 5: duration of two turns (s)", ("3.6", "5.0"), two_turns, nothing, "e"),
        Row("hip flexion of the outside leg, largest (°)", ("55", "65"), turns("hip_flexion_outside_max_deg", "{:.0f}"), nothing, "e"),
        Row("postural shift after the transition (s)", ("0.2", "0"), turns("postural_shift_s", "{:.2f}"), nothing, "e"),
        Row("Figure 6: turn radius (m)", ("7.7", "17.6"), turns("turn_radius_m", "{:.1f}"), nothing, "e"),
        Row("mean speed (m/s)", ("5.5", "11.5"), turns("mean_speed_mps", "{:.1f}"), gps_speed, "e"),
        Row("angle between the skis (°)", ("9", "2"), turns("ski_angle_mean_deg", "{:.1f}"), nothing, "e"),
        Row("steering angle, mean (°)", ("25", "6"), turns("steering_angle_mean_deg", "{:.1f}"), nothing, "f"),
        Row("steering angle, peak (°)", ("51", "17"), turns("steering_angle_peak_deg", "{:.0f}"), nothing, "f"),
        Row("centre of mass inside both skis (% of the turn)", ("0", "100"), turns("com_inside_both_share", "{:.0f}", 100.0), nothing, "g"),
        Row("Figure 7: outside ski's share, control phase", ("0.99", "0.80"), control("outside_force_share"), insole_share, "h"),
        Row("total force, control phase (BW): square to the snow", ("1.19", "1.40"), control("total_force_bodyweights"), insole_total, "i"),
        Row("whole", ("", ""), control("snow_force_bodyweights"), nothing, "i"),
        Row("load shift after the transition (s)", ("0.24", "0.13"), turns("load_shift_s", "{:.2f}"), insole_shift("after", "{:.2f}"), "j"),
        Row("of the turn (%)", ("13.3", "5.2"), turns("load_shift_percent", "{:.1f}"), insole_shift("percent", "{:.1f}"), "j"),
        Row("Figure 8: hip flexion moment, peak (N m/kg)", ("1.69 in all", "1.69 in all"), moment("hip_flexion", "max"), nothing, "k"),
        Row("hip extension moment, peak (N m/kg)", ("2.71 in all", "2.71 in all"), moment("hip_flexion", "min"), nothing, "k"),
        Row("knee extension moment, peak (N m/kg)", ("1.13", "2.74"), moment("knee_angle", "min"), nothing, "k"),
        Row("moment left over at the pelvis, rms (largest) (N m)", ("–", "–"), lambda run: moment_left(run.summary.residual_moment), nothing, "l"),
        Row("the same with the captured posture", ("", ""), lambda run: moment_left(as_captured(run.name)[1]), nothing, "l"),
    ]  # fmt: skip


def of(group: str, name: str, form: str) -> Number:
    return lambda run: form.format(getattr(getattr(run.summary, group), name))


def turns(name: str, form: str, factor: float = 1.0) -> Number:
    return lambda run: spread(spread_of(run.summary, name), form, factor)


def control(name: str) -> Number:
    return lambda run: spread(spread_of(run.summary, name, "control"), "{:.2f}")


def moment(joint: str, end: str) -> Number:
    def peak(run: StoredRun) -> str:
        value = peak_moment(run.summary, joint, end)
        return "–" if value is None else f"{value:.2f}"

    return peak


def spread(figure: Spread, form: str, factor: float = 1.0) -> str:
    if figure.mean is None:
        return "–"
    if figure.sd is None:
        return form.format(factor * figure.mean)
    return with_spread(factor * figure.mean, factor * figure.sd)


def two_turns(run: StoredRun) -> str:
    mean = mean_of(run.summary, "duration_s")
    return "–" if mean is None else f"{2.0 * mean:.1f}"


def complete(run: StoredRun) -> list[Turn]:
    return [turn for turn in run.turns.turns if turn.complete]


def over(values: list[float], form: str) -> str:
    known = np.array([value for value in values if np.isfinite(value)])
    return spread(Spread(known.mean(), known.std(ddof=1)), form) if len(known) > 1 else "–"


def gps_speed(run: StoredRun) -> str:
    """Return the speed of the antenna: the fixes' path over the time."""
    assert run.measured is not None
    fixes = run.measured.dropna(subset=["gps_east_m"])
    time, path = fixes["time_s"].to_numpy(), fixes[["gps_east_m", "gps_north_m", "gps_up_m"]].to_numpy()
    within = [(time >= turn.start) & (time <= turn.end) for turn in complete(run)]
    return over([path_length(path[rows]) / float(np.ptp(time[rows])) for rows in within], "{:.1f}")


def insoles(run: StoredRun) -> tuple[Array, Array]:
    """Return the insoles' times (n,) s and forces (n, 2) N, left and right."""
    assert run.measured is not None
    readings = run.measured.dropna(subset=["left_insole_N"])
    return readings["time_s"].to_numpy(), readings[["left_insole_N", "right_insole_N"]].to_numpy()


def insole_share(run: StoredRun) -> str:
    time, load = insoles(run)
    left = filtered_ratio(time, *load.T)
    shares = []
    for turn in complete(run):
        begin, end = turn.phases["control"]
        rows = (time >= begin) & (time <= end)
        shares.append(float(np.nanmean(left[rows] if turn.side == "right" else 1.0 - left[rows])))
    return over(shares, "{:.2f}")


def insole_total(run: StoredRun) -> str:
    time, load = insoles(run)
    total = load.sum(axis=1) / (GRAVITY * run.model.skier.mass)
    phases = [turn.phases["control"] for turn in complete(run)]
    return over([float(np.mean(total[(time >= begin) & (time <= end)])) for begin, end in phases], "{:.2f}")


def insole_shift(name: str, form: str) -> Number:
    def crossing(run: StoredRun) -> str:
        time, load = insoles(run)
        ratio = filtered_ratio(time, *load.T)
        known = np.isfinite(ratio)
        shifts = [getattr(shift(time[known], ratio[known] - 0.5, turn), name) for turn in complete(run)]
        return over(shifts, form)

    return crossing


if __name__ == "__main__":
    main()
