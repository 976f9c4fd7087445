"""Skiers on snow that edges cut, for ``make_carving``: fits, headings, ski against ski, the two models and derivatives.

The fits take long; they are kept in ``results/carving``.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from sssi_exudyn import load, run
from sssi_exudyn.api.result import Result
from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.commands.runs import add_terms
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.choices import HEADING_MODES
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.observations import measurements_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import first_guess, model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.results.carving import carving_figures
from sssi_exudyn.results.summary import CarvingFigures, UncertaintyFigures
from sssi_exudyn.simulation.assembly import CARVED_STEP, COARSE_CARVED_STEP
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.balanced_lean import balance
from sssi_exudyn.simulation.reduced.carved_run import simulate_carved
from sssi_exudyn.simulation.reduced.derivatives import run_tangents
from sssi_exudyn.simulation.reduced.prepared import ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.ski_on_snow.boot_joint import BootJoint, boot_joint

ROOT = Path(__file__).parents[1]
INTERMEDIATE = ROOT / "examples" / "intermediate"
SECONDS = 4.0
LOADED = 5.0
STIFFNESSES = ((1e9, 1e7), *((stiff, None) for stiff in (1e9, 3e5, 1.5e5, 8e4, 4e4, 2e4)))
"""N/m and N m/rad; stiffnesses of a leg and a boot that hold a ski in heave and pitch; None for the usual one."""
DIFFERENCES = {"carving.mu": 3e-4, "carving.strength": 1e3, "carving.hardness": 1e6}
"""Numbers of the snow by which derivatives are taken, and half the differences that they are compared with."""


def fitted(snow: Literal["paper", "carving"]) -> Result:
    """Return the fit of the intermediate skier on that snow; kept in ``results/carving``, as it takes long."""
    out = ROOT / "results" / "carving" / snow
    return load(out) if (out / "summary.json").is_file() else run(INTERMEDIATE, out, snow=snow, progress=True)


def both_laws() -> str:
    """Compare the paper's law and edges that cut on the intermediate skier's recording."""
    papers, cut = (fitted(snow).summary for snow in ("paper", "carving"))
    snow = cut.carving
    assert snow is not None
    assert papers.uncertainty is not None
    assert cut.uncertainty is not None
    mu_t, mu_n = (f"{mu.value:.3f} ± {mu.se:.3f}" for mu in (papers.friction.mu_t, papers.friction.mu_n))
    entries = [
        (
            "friction along",
            f"μ_t {mu_t}",
            f"μ {snow.mu.value:.3f} ± {snow.mu.se:.3f}; as μ_t {snow.equivalent_mu_t:.3f}",
        ),
        ("force across", f"μ_n {mu_n}", f"as μ_n {snow.equivalent_mu_n:.3f}"),
        ("H", "–", f"({1e-8 * snow.hardness_N_m3.value:.2f} ± {1e-8 * snow.hardness_N_m3.se:.2f})·10⁸ N/m³"),
        ("S_f", "–", f"({1e-5 * snow.strength_Pa.value:.2f} ± {1e-5 * snow.strength_Pa.se:.2f})·10⁵ Pa"),
        *(
            (what, *(figure(summary) for summary in (papers, cut)))
            for what, figure in (
                ("mean error against the GPS", lambda summary: f"{summary.trajectory.mean_error_m:.3f} m"),
                (
                    "load share against the insoles, correlation",
                    lambda summary: f"{summary.pressure_ratio.correlation:.3f}",
                ),
                ("moment left over at the pelvis, rms", lambda summary: f"{summary.residual_moment.rms_Nm:.0f} N m"),
                ("skis against the feet, rms", lambda summary: _against_feet(summary.carving)),
                ("largest correction", lambda summary: _largest(summary.uncertainty)),
                ("log evidence of all measurements", lambda summary: f"{summary.uncertainty.log_evidence:.0f}"),
                ("energy balance, largest gap", lambda summary: f"{summary.energy.closure_percent:.4f} %"),
                (
                    "fit",
                    lambda summary: (
                        f"{summary.fit.wall_s:.0f} s, {'converged' if summary.fit.converged else 'not converged'}"
                    ),
                ),
            )
        ),
    ]
    lines = ["| | the paper's law | edges that cut |", "|---|---|---|"]
    more = papers.uncertainty.log_evidence - cut.uncertainty.log_evidence
    verdict = (
        f"\nThe recording prefers the law of its own world by {more:.0f} in log evidence. The other law meets the track to "
        f"{cut.trajectory.mean_error_m:.2f} m all the same, with a μ_t that is near the paper's: what a skier of known "
        "movement needs of the snow is much the same force, whatever gives it. The standard errors of H and S_f hold were "
        "the law true, which it is not here.\n"
    )
    return (
        "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in entries)]).replace("| -", "| −") + "\n" + verdict
    )


def _against_feet(figures: CarvingFigures | None) -> str:
    if figures is None:
        return "–"
    return (
        f"yaw {figures.ski_yaw_rms_deg:.1f}°, roll {figures.ski_roll_rms_deg:.1f}°, "
        f"heave {1e3 * figures.ski_heave_rms_m:.0f} mm, pitch {figures.ski_pitch_rms_deg:.1f}°"
    )


def _largest(uncertainty: UncertaintyFigures) -> str:
    return f"{uncertainty.largest[0].what}, {uncertainty.largest[0].sigmas:+.1f} σ".replace("-", "−")


def headings() -> str:
    """Show the effect of the skier's heading on the run of that fit, by both models."""
    own = fitted("carving").model
    motion = motion_from_recording(read_recording(INTERMEDIATE))
    stop = motion.start + SECONDS
    prepared = prepare(own, motion, stop=stop)
    half = prepare(own, motion, stop=stop, step=0.5 * prepared.step)
    lines = [
        f"The same run, {SECONDS:g} s of it. Moments are those that posture and snow leave over by the full model's inverse "
        "dynamics, about gravity and about the direction of travel:\n",
        "| heading | against the captured one, rms, most | moment about gravity, rms | about the direction of travel, rms | from the "
        "replayed path at the end | the two models apart, most | half the step, most |",
        "|---|---|---|---|---|---|---|",
    ]
    replayed = None
    for mode in HEADING_MODES:
        model = own.with_heading(mode)
        reduced, halved = simulate_carved(model, prepared), simulate_carved(model, half)
        full = simulate(model, motion, stop=stop)
        replayed = reduced.run.com if replayed is None else replayed
        figures = carving_figures(model, full, {})
        assert figures is not None
        assert full.edges is not None
        apart = np.linalg.norm(full.com - reduced.run.com, axis=1).max()
        turned = np.degrees(np.abs(full.edges.heading - reduced.heading).max())
        by_step = np.linalg.norm(halved.run.com[::2] - reduced.run.com, axis=1).max()
        turned_by_step = np.degrees(np.abs(halved.heading[::2] - reduced.heading).max())
        most = np.degrees(np.abs(full.edges.heading).max())
        lines.append(
            f"| {mode} | {figures.heading_rms_deg:.1f}°, {most:.1f}° | {figures.yaw_residual_rms_Nm:.0f} N m "
            f"| {figures.roll_residual_rms_Nm:.0f} N m | {np.linalg.norm(reduced.run.com[-1] - replayed[-1]):.2f} m "
            f"| {apart:.2f} m, {turned:.1f}° | {by_step:.2f} m, {turned_by_step:.1f}° |"
        )
    return "\n".join(lines) + "\n"


def long_headings() -> str:
    """Show how far the two models are apart over the whole run of that fit where the heading is found."""
    own = fitted("carving").model
    motion = motion_from_recording(read_recording(INTERMEDIATE))
    prepared, until = prepare(own, motion), (4.0, 9.0, 15.0)
    lines = [
        "| heading | " + " | ".join(f"within {seconds:g} s" for seconds in until) + " |",
        "|---" * (len(until) + 1) + "|",
    ]
    for mode in HEADING_MODES[1:]:
        model = own.with_heading(mode)
        reduced, full = simulate_carved(model, prepared), simulate(model, motion)
        assert full.edges is not None
        apart = np.linalg.norm(full.com - reduced.run.com, axis=1)
        turned = np.degrees(np.abs(full.edges.heading - reduced.heading))
        by_then = [reduced.run.time - motion.start <= seconds for seconds in until]
        cells = [f"{apart[rows].max():.2f} m, {turned[rows].max():.1f}°" for rows in by_then]
        lines.append(f"| {mode} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def ski_against_ski() -> str:
    """Show where another ski would have brought the intermediate skier, on the fitted snow."""
    result = fitted("carving")
    motion = motion_from_recording(read_recording(INTERMEDIATE))
    own, snow, joint = result.model, result.summary.carving, BootJoint()
    assert snow is not None
    numbers = {"carving.hardness": snow.hardness_N_m3, "carving.strength": snow.strength_Pa, "carving.mu": snow.mu}
    changes: list[tuple[dict[str, float], BootJoint]] = [({}, joint)]
    for name, number in numbers.items():
        low, high = own.bounds(name)
        changes += [({name: min(max(number.value + side * number.se, low), high)}, joint) for side in (-1.0, 1.0)]
    changes += [({}, replace(joint, yaw_stiffness=joint.yaw_stiffness * factor)) for factor in (0.5, 2.0)]
    names = ("slalom_165", "fischer_rc4_sc_165", "volkl_kendo_184")
    stop = motion.start + SECONDS
    ends: dict[tuple[str, str], Array] = {}
    residuals: dict[tuple[str, str], str] = {}
    for name in names:
        model = replace(own, ski=read_ski(name, "."))
        free = model.with_heading("free")
        usual = balance(free, motion, stop=stop)
        figures = [float(np.sqrt(np.mean(moment**2))) for moment in (usual.before, usual.after)]
        residuals |= {(name, "free"): f"{figures[0]:.0f} N m", (name, "free, balanced"): f"{figures[1]:.0f} N m"}
        end_places: dict[str, list[Array]] = {"replay": [], "free": [], "free, balanced": []}
        for values, springs in changes:
            leaning = balance(free.with_values(values), motion, stop=stop, joint=springs, begin=usual)
            cases = (model.with_values(values), free.with_values(values), leaning.model)
            for places, tried in zip(end_places.values(), cases, strict=True):
                prepared = prepare(tried, motion, stop=stop)
                places.append(simulate_carved(tried, prepared, springs).run.com[-1])
        ends |= {(name, kind): np.array(places) for kind, places in end_places.items()}
    lines = [
        f"Where the centre of mass is after {SECONDS:g} s of that fit, against slalom_165. The bar is what one standard "
        "deviation of H, of S_f and of μ and twice or half the yaw stiffness change in the difference; where the skier is "
        "balanced, each such run has a lean of its own:\n",
        "| ski | heading | farther down the slope | farther to the left | residual moment about the direction of travel, "
        "rms of means over 0.5 s |",
        "|---|---|---|---|---|",
    ]
    for name in names:
        for kind in ("replay", "free", "free, balanced"):
            apart = ends[name, kind] - ends[names[0], kind]
            moved = np.abs(apart[1:] - apart[0]).reshape(-1, 2, 3).max(axis=1)
            bar = np.linalg.norm(moved, axis=0)
            cells = [f"{apart[0, axis]:+.2f} ± {bar[axis]:.2f} m".replace("-", "−") for axis in (0, 1)]
            cells = ["–", "–"] if name == names[0] else cells
            lines.append(f"| {name} | {kind} | " + " | ".join(cells) + f" | {residuals.get((name, kind), '–')} |")
    return "\n".join(lines) + "\n"


def _reduced(model: Model, motion: Motion, stop: float) -> ReducedRun:
    return simulate_reduced(model, prepare(model, motion, stop=stop))


def stiffnesses() -> str:
    """Show how much the load difference of the intermediate's first seconds misses the insoles', by leg stiffness."""
    recording = read_recording(INTERMEDIATE)
    motion = motion_from_recording(recording)
    motion = replace(motion, stop=motion.start + LOADED)
    plain = model_of(recording, motion)
    seen = measurements_of(recording, plain, motion.start, motion.stop)
    rows = seen.blocks["difference"]

    def on_surface(model: Model) -> Model:
        return problem_of(recording, motion, on_snow_surface(model, recording, motion), "joint").model

    def row(name: str, run: ReducedRun, model: Model) -> str:
        missed = seen.measured[rows] - seen.predict(model, run)[rows]
        return f"| {name} | {np.sqrt(np.mean(missed**2)):.0f} N |"

    lines = ["| spring in heave, pitch | load difference less that of the insoles, rms |", "|---|---|"]
    cut, papers = on_surface(add_terms(plain, (Carving(),))).with_values({"carving.mu": 0.075}), on_surface(plain)
    usual, prepared = boot_joint(cut.equipment), prepare(cut, motion, step=COARSE_CARVED_STEP)
    for heave, pitch in STIFFNESSES:
        held = replace(usual, heave_stiffness=heave, pitch_stiffness=pitch or usual.pitch_stiffness)
        of_heave = f"{heave / 1e3:.0f} kN/m" if heave < 1e6 else "held fast"
        of_pitch = "held fast" if pitch else f"{usual.pitch_stiffness:.0f} N m/rad"
        lines.append(row(f"{of_heave}, {of_pitch}", simulate_carved(cut, prepared, held).run, cut))
    lines.append(row("the paper's law", simulate_reduced(papers, prepare(papers, motion)), papers))
    return "\n".join(lines) + "\n"


def tiers() -> str:
    """Show the costs of both tiers, and how far apart they are."""
    motion = motion_from_recording(read_recording(INTERMEDIATE))
    stop = motion.start + SECONDS
    rows, ends = [], {}
    for law, snow in (("the paper's law", "paper"), ("edges that cut", "carving")):
        model = fitted("carving" if snow == "carving" else "paper").model
        costs: list[float] = []
        for simulated in (partial(_reduced, model, motion, stop), partial(simulate, model, motion, stop=stop)):
            simulated()
            begin = time.process_time()
            ends[law, len(costs)] = simulated()
            costs.append(SECONDS / (time.process_time() - begin))
        rows.append(f"| {law} | {costs[0]:.2g} | {costs[1]:.2g} |")
    apart = []
    for law in ("the paper's law", "edges that cut"):
        reduced, full = ends[law, 0], ends[law, 1]
        nearest = np.argmin(np.abs(full.time[:, None] - reduced.time[:: len(reduced.time) // 8]), axis=0)
        apart.append(
            float(np.linalg.norm(full.antenna[nearest] - reduced.antenna[:: len(reduced.time) // 8], axis=1).max())
        )
    return "\n".join(
        [
            "Seconds of a run in a second of one core, posture tables and, for the full model, joint moments included:\n",
            "| | reduced model | full model |",
            "|---|---|---|",
            *rows,
            f"\nOver these {SECONDS:g} s the two models are {apart[0]:.2f} m apart at most by the paper's law, "
            f"{apart[1]:.2f} m where edges cut. The full model's energy balance closes to "
            f"{ends['edges that cut', 1].closure_percent:.4f} % there.\n",
        ]
    )


def captured(mu: float) -> tuple[Model, Motion]:
    """Return the intermediate skier as captured, on the default snow."""
    recording = read_recording(INTERMEDIATE)
    motion = motion_from_recording(recording)
    paper = model_of(recording, motion)
    assert recording.gps is not None
    start = first_guess(recording.gps, motion, paper.inclination, paper.fall_line_azimuth)
    return replace(paper, start=start, terms=combine_terms(paper.terms, (Carving(mu=mu),))), motion


def long_derivatives() -> str:
    """Compare tangents at the end of a whole run with differences, by the friction of the snow."""
    lines = ["| μ | by μ | by S_f | by H |", "|---|---|---|---|"]
    for mu in (0.09, 0.10, 0.11, 0.12, 0.13, 0.14, 0.15):
        model, motion = captured(mu)
        prepared = prepare(model, motion, step=COARSE_CARVED_STEP)
        slopes = run_tangents(model, prepared, list(DIFFERENCES))[1].com[-1]
        cells = []
        for k, (name, step) in enumerate(DIFFERENCES.items()):
            moved = [model.with_values({name: model.value(name) + change}) for change in (step, -step)]
            ends = [simulate_reduced(changed, prepared).com[-1] for changed in moved]
            difference = (ends[0] - ends[1]) / (2.0 * step)
            off = np.linalg.norm(slopes[:, k] - difference) / np.linalg.norm(difference)
            cells.append(f"{100.0 * off:.2g} %" if off < 1.0 else "nothing in common")
        lines.append(f"| {mu:.2f} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def models_apart() -> str:
    """Show how far the antenna's paths differ between the models, and between each model and a slightly changed one."""
    model, motion = captured(0.1)
    stop = motion.start + SECONDS

    def small(tried: Model = model, step: float = CARVED_STEP, springs: BootJoint | None = None) -> tuple[Array, Array]:
        run = simulate_carved(tried, prepare(tried, motion, stop=stop, step=step), springs).run
        return run.time, run.antenna

    def whole(step: float | None = None) -> tuple[Array, Array]:
        solver = model.solver if step is None else replace(model.solver, step=step)
        run = simulate(replace(model, solver=solver), motion, stop=stop)
        assert run.antenna is not None
        return run.time, run.antenna

    def apart(one: tuple[Array, Array], other: tuple[Array, Array], after: float) -> float:
        ends = [places[np.argmin(np.abs(times - motion.start - after))] for times, places in (one, other)]
        return float(np.linalg.norm(ends[0] - ends[1]))

    usual, full = small(), whole()
    joint = boot_joint(model.equipment)
    percent = {name: model.with_values({name: 1.01 * model.value(name)}) for name in ("carving.mu", "carving.strength")}
    faster = model.with_values({"start.velocity_l": model.value("start.velocity_l") + 1e-3})
    rows = {
        "the full model and the reduced one": (usual, full),
        "the reduced one, with half the step": (usual, small(step=0.5 * CARVED_STEP)),
        "the same, with a quarter of it": (usual, small(step=0.25 * CARVED_STEP)),
        "the same, with 1 % more μ": (usual, small(percent["carving.mu"])),
        "the same, with 1 % more S_f": (usual, small(percent["carving.strength"])),
        "the same, with 1 % more stiffness in yaw": (
            usual, small(springs=replace(joint, yaw_stiffness=1.01 * joint.yaw_stiffness)),
        ),
        "the same, 1 mm/s faster to the left at the start": (usual, small(faster)),
        "the full one, with half the step": (full, whole(0.5 * CARVED_STEP)),
    }  # fmt: skip
    lines = ["| | after 1 s | after 4 s |", "|---|---|---|"]
    for name, (one, other) in rows.items():
        lines.append(f"| {name} | {apart(one, other, 1.0):.3f} m | {apart(one, other, SECONDS):.3f} m |")
    return "\n".join(lines) + "\n"
