"""The page of a ski's bench tests: what was measured, what was fitted, and the ski that follows."""

from __future__ import annotations

from html import escape
from typing import Final, Literal

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.bodies.ski.bench_tests import Measurements
from sssi_exudyn.bodies.ski.identification import Estimate, IdentifiedSki, Line
from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports.html import document
from sssi_exudyn.reports.plots import COLOURS, MEASURED, SIMULATED
from sssi_exudyn.reports.section import Grid, Key, Panel, Panels, Section, Text
from sssi_exudyn.reports.ski_curves import ski_curves

_WORDS: Final = {
    "density": ("density", 1.0, "kg/m³"),
    "young_modulus": ("Young's modulus", 1e-9, "GPa"),
    "shear_modulus": ("shear modulus", 1e-9, "GPa"),
    "damping_ratio": ("damping ratio of the tip", 1.0, ""),
    "frequency": ("frequency of the tip", 1.0, "Hz"),
}
NUMBER_COLUMNS: Final = ("value", "standard error", "95 % interval")
INTERVALS: Final = "A 95 % interval holds the true value 19 times in 20."
_NO_TORSION: Final = (
    "There is no torsion test. The shear modulus is that of an isotropic material, E/(2(1 + ν)) with ν = 0.3; its "
    "standard error is taken as 30 %."
)
_STIFFNESS: Final = (
    "The ski's file passes its standard errors to steady turns. That of EI comes from the line of the bending test, "
    "that of GJ from the torsion test. The caliper's error changes modulus and thickness together "
    "and cancels in EI and GJ."
)


def bench_page(measured: Measurements, identified: IdentifiedSki) -> str:
    """Return the page of the tests on one ski."""
    ski, errors = identified.ski, identified.ski.uncertainty
    assert errors is not None
    lead = (
        f'<p class="result">{escape(ski.name)} has E = {_text(identified.young_modulus, 1e-9)} GPa and a '
        f"sidecut radius of {ski.sidecut_radius():.1f} m. EI is known to {100.0 * errors.bending:.1f} %, GJ to "
        f"{100.0 * errors.torsion:.1f} %.</p>\n"
    )
    missed = 100.0 * (identified.predicted_frequency / identified.frequency.value - 1.0)
    side = "below" if missed < 0.0 else "above"
    check = (
        f"The ski as identified vibrates at {identified.predicted_frequency:.2f} Hz, {abs(missed):.1f} % {side} the "
        f"measured {identified.frequency.value:.2f} Hz, to which its stiffness was not fitted."
    )
    damping = (
        f"The ski's file has the damping ratio {ski.damping_ratio:.4f}. It belongs to the mean frequency of the two "
        "slowest vibrations of the ski held at the boot centre; there tip and tail vibrate apart."
    )
    torsion: Text | Panels = Text(_NO_TORSION)
    if identified.torsion is not None:
        degrees = np.degrees(measured.twist)
        line = Line(*(float(np.degrees(value)) for value in vars(identified.torsion).values()))
        torsion = _line_drawing(measured.moment, degrees, line, ("moment (N m)", "twist (degrees)"))
    millimetres = Line(*(1e3 * value for value in vars(identified.bending).values()))
    bending = _line_drawing(measured.force, 1e3 * measured.deflection, millimetres, ("force (N)", "deflection (mm)"))
    sections = [
        Section(
            "Numbers",
            (
                Grid([["", *NUMBER_COLUMNS], *number_rows(identified)]),
                Text(INTERVALS),
                Text(check),
                Text(damping),
                Text(_STIFFNESS),
            ),
        ),
        Section("Three-point bending", (bending,)),
        Section("Torsion", (torsion,)),
        Section("Free vibration", (_vibration(measured, identified),)),
        Section("The ski's curves", (ski_curves([ski]),)),
    ]
    return document(f"Bench tests of {ski.name}", lead, sections)


def number_rows(identified: IdentifiedSki) -> list[list[str]]:
    """Return a row a number of the ski: its name with the unit, and ``NUMBER_COLUMNS``."""
    rows = []
    for name, estimate, _ in identified.estimates:
        words, scale, unit = _WORDS[name]
        value, low, high = (f"{scale * number:.4g}" for number in (estimate.value, estimate.low, estimate.high))
        rows.append([f"{words} ({unit})" if unit else words, value, f"{scale * estimate.se:.2g}", f"{low} to {high}"])
    return rows


def _text(estimate: Estimate, scale: float) -> str:
    return f"{scale * estimate.value:.3g} ({scale * estimate.low:.3g} to {scale * estimate.high:.3g})"


def _line_drawing(x: Array, y: Array, line: Line, labels: tuple[str, str]) -> Panels:
    def draw(axes: Axes) -> None:
        axes.plot(x, y, "o", color=MEASURED, markersize=3.5)
        ends = np.array([x.min(), x.max()])
        axes.plot(ends, line.intercept + line.slope * ends, color=SIMULATED)
        axes.set(xlabel=labels[0])

    share = 100.0 * line.slope_se / line.slope
    caption = f"{len(x)} points and their line, whose slope is known to {share:.2f} %"
    return _figure(caption, Panel(labels[1], f"over {labels[0]}", draw), ".", "-")


def _vibration(measured: Measurements, identified: IdentifiedSki) -> Panels:
    def draw(axes: Axes) -> None:
        axes.plot(measured.time, measured.signal, color=MEASURED, linewidth=1.0)
        late = measured.time[measured.time > identified.vibration.start]
        axes.plot(late, identified.vibration.at(late), "--", color=SIMULATED, linewidth=1.0)
        axes.set(xlabel="time (s)")

    panel = Panel("signal of the tip", "over time", draw)
    return _figure("The fit begins when the faster vibrations have died out", panel, "-", "--")


def _figure(caption: str, panel: Panel, measured: Literal["-", "."], fitted: Literal["-", "--"]) -> Panels:
    keys = (Key(COLOURS.index(MEASURED), measured, "measured"), Key(COLOURS.index(SIMULATED), fitted, "fitted"))
    return Panels(caption, (panel,), keys, 4.6, 2.5)
