"""Makes ``docs/reproduction.md``: the paper's Table 1 and the figures of its Figures 4 to 8 in numbers, beside this
program's on the two bundled recordings.

Run as ``python docs/make_reproduction.py [RESULTS]``; it fits and simulates both recordings into the folder RESULTS
(``results/reproduction`` unless given) and takes a few minutes.  What RESULTS holds already is not done again.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sssi_exudyn import commands
from sssi_exudyn.analysis.biomechanics import Spread, shift
from sssi_exudyn.analysis.turns import Turn
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.reports.sections.tables import friction, with_spread
from sssi_exudyn.reports.sections.turn_tables import peak_moment
from sssi_exudyn.reports.sentences import mean_of, spread_of
from sssi_exudyn.results.folder import SUMMARY
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.validation.agreement import filtered_ratio
from sssi_exudyn.validation.metrics import path_length

ROOT = Path(__file__).parents[1]
NAMES = ("beginner", "intermediate")

HEAD = """# The paper's results beside this program's

Made by `python docs/make_reproduction.py`, which runs `sssi run` on both bundled recordings (and `sssi fit --method paper`,
for one row). *Paper* is Gao et al.; *here* is what the program finds in the bundled recording of that name, mean over its
complete turns (± their standard deviation; for friction ± the standard error); *recorded* is the same figure from the
recording's own GPS and insoles, without any simulation, where they give it.

The bundled recordings are not the paper's: its data are not public. They come from a simulated world, which is no part of
this program, with skiers, slopes and friction like the paper's. So friction can be compared with the paper's as with a
true value; how the skiers move and load their skis belongs to the recordings, and `recorded` shows it.

"""

CLOSE = """
## Why they differ

"""

WHY: dict[str, str] = {
    "a": "The recordings were made with the paper's friction, so the difference is the program's error. The standard error "
    "counts the track's noise alone; the captured posture is off by some 0.3°, and what that does to friction it does not "
    "count.",
    "b": "The paper's snow, slope and GPS are real, the bundled ones are a plane of even snow and a GPS with 2 cm of noise; "
    "besides, start and heading are fitted along here. Beside it stands the fit of the paper's two parameters alone.",
    "c": "The slope is given with the recording, not found.",
    "d": "The paper compares the snow's normal force with the insoles, as do the rows in brackets; the others take what presses "
    "square on the sole (`decisions/0003-what-insoles-feel.md`), which matters where skis are edged as much as the "
    "intermediate's. The paper gives nothing for its intermediate, who wore no insoles.",
    "e": "A property of the recording: its skiers turn about as the paper's do, not just as they do. Capture and GPS fix it, and "
    "the simulation follows them (`recorded`). Both shifts count from the instant at which the path of the centre of mass "
    "turns least, found on the simulated path.",
    "f": "The angle lies between the captured heading of a foot and the way it goes, both of which the recording fixes: its "
    "beginner skids less and its intermediate carves more purely than the paper's. Means are over both skis and the whole "
    "turn; the paper does not say over what it takes its own.",
    "g": "The paper says that its beginner is inside of one ski throughout, its intermediate always inside of both. Here inside "
    "of both is: beyond the lines of both skis, towards the turn's centre. Around a transition, where the skier crosses from "
    "one side to the other, nobody is; the bundled beginner is for the rest of the turn.",
    "h": "The insoles of the bundled recordings, too, show an outside ski that bears less than the paper's. The simulated share "
    "is off from them by up to 0.08: at 2 cm of penetration 1 mm of a foot's height is 7 % of its load, and the captured "
    "posture gives the feet's places to about 1 mm.",
    "i": "On an edged ski friction across it bears a part of the load. The whole force is nearer to the paper's figures, which do "
    "not say what they include. The insoles agree with it, less the 6 % that the boot's cuff carries.",
    "j": "The instant depends on small differences between both loads: turns of one run differ by as much as the recording from "
    "the paper. The insoles cross at about the same time.",
    "k": "Moments follow from loads and postures, which differ as said above: in the control phase the bundled intermediate's "
    "outside ski bears {outside:.2f} body weights square to the snow, the paper's 1.12; the bundled beginner's knees are bent by "
    "up to {knee:.0f}°. The paper does not give the postures that would explain more. Its figures for the hip are the largest of "
    "both skiers.",
}

_OUTSIDE = ("outside_force_share", "total_force_bodyweights")
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
                    commands.fit(ROOT / "examples" / name, out, method="paper")
                else:
                    commands.run(ROOT / "examples" / name, out)
        runs.append(read_run(results / name))
        plain.append(read_run(results / f"{name}-paper"))
    alike = {run.name: other for run, other in zip(runs, plain, strict=True)}
    knee = max(float(run.series[f"knee_angle_{side}_deg"].max()) for run in runs[:1] for side in "lr")
    lines = [HEAD.rstrip() + "\n", *table(runs, rows(alike)), CLOSE.rstrip() + "\n"]
    outside = float(np.prod([mean_of(runs[1].summary, name, "control") or np.nan for name in _OUTSIDE]))
    lines += [f"- **{letter}**: {why.format(knee=knee, outside=outside)}" for letter, why in WHY.items()]
    (ROOT / "docs" / "reproduction.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def table(runs: list[StoredRun], entries: list[Row]) -> Iterator[str]:
    """Lines of Markdown."""
    yield "| | " + " | ".join(f"{name}: paper | here | recorded" for name in NAMES) + " | why |"
    yield "|---|" + "---|" * (3 * len(NAMES) + 1)
    for row in entries:
        cells = [f"{row.paper[k]} | {row.here(run)} | {row.recorded(run)}" for k, run in enumerate(runs)]
        yield f"| {row.what} | " + " | ".join(cells) + f" | {row.why} |"


def rows(alike: Mapping[str, StoredRun]) -> list[Row]:
    """Every figure of the paper's results, in its order; ``alike`` has the runs fitted by the paper's two parameters."""

    def by_paper(run: StoredRun) -> str:
        other = alike[run.name].summary
        mu = ", ".join(f"{getattr(other.friction, name).value:.3f}" for name in ("mu_t", "mu_n"))
        return f"{other.trajectory.percent_of_length:.2f} % ({mu})"

    return [
        Row("Table 1: μ_t", ("0.06", "0.19"), lambda run: friction(run.summary, "mu_t"), nothing, "a"),
        Row("μ_n", ("0.55", "0.9"), lambda run: friction(run.summary, "mu_n"), nothing, "a"),
        Row("trajectory error, share of the path", ("0.7 %", "0.6 %"), of("trajectory", "percent_of_length", "{:.2f} %"), nothing, "b"),
        Row("the same with the paper's two parameters alone (μ_t, μ_n)", ("", ""), by_paper, nothing, "b"),
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
    """Of the antenna: the fixes' path over the time."""
    assert run.measured is not None
    seen = run.measured.dropna(subset=["gps_east_m"])
    time, path = seen["time_s"].to_numpy(), seen[["gps_east_m", "gps_north_m", "gps_up_m"]].to_numpy()
    within = [(time >= turn.start) & (time <= turn.end) for turn in complete(run)]
    return over([path_length(path[of]) / float(np.ptp(time[of])) for of in within], "{:.1f}")


def insoles(run: StoredRun) -> tuple[Array, Array]:
    """(n,) s and (n, 2) N, left and right."""
    assert run.measured is not None
    seen = run.measured.dropna(subset=["left_insole_N"])
    return seen["time_s"].to_numpy(), seen[["left_insole_N", "right_insole_N"]].to_numpy()


def insole_share(run: StoredRun) -> str:
    time, load = insoles(run)
    left = filtered_ratio(time, *load.T)
    found = []
    for turn in complete(run):
        begin, end = turn.phases["control"]
        of = (time >= begin) & (time <= end)
        found.append(float(np.nanmean(left[of] if turn.side == "right" else 1.0 - left[of])))
    return over(found, "{:.2f}")


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
        found = [getattr(shift(time[known], ratio[known] - 0.5, turn), name) for turn in complete(run)]
        return over(found, form)

    return crossing


if __name__ == "__main__":
    main()
