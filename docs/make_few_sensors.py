"""Draws docs/images/few_sensors.png: edge angle and heading of a bundled run, as captured and as few sensors give them.

Run it from the top folder: ``PYTHONPATH=tests python docs/make_few_sensors.py``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from strapped import truth, write_few

from sssi_exudyn.recording.read import read_recording

TOP = Path(__file__).parents[1]
CASES = (("both skis and chest", ("left_ski", "right_ski", "chest")), ("telephone in a pocket", ("pocket",)))


def main() -> None:
    """Draw and save."""
    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex="col", sharey="row")
    for column, name in enumerate(("beginner", "intermediate")):
        recording = read_recording(TOP / "examples" / name)
        for row in range(2):
            known = truth(recording, "LeftFoot", recording.bvh.time)[1 - row]
            panels[row, column].plot(
                recording.bvh.time, np.degrees(known), color="0.6", linewidth=3.0, label="captured"
            )
        for label, places in CASES:
            with tempfile.TemporaryDirectory() as folder:
                few = read_recording(write_few(recording, places, Path(folder) / name))
            for row in range(2):
                estimated = truth(few, "LeftFoot", few.bvh.time)[1 - row]
                panels[row, column].plot(few.bvh.time, np.degrees(estimated), linewidth=1.2, label=label)
        panels[0, column].set_title(name)
        panels[1, column].set_xlabel("time (s)")
    panels[0, 0].set_ylabel("left ski's edge angle (°)")
    panels[1, 0].set_ylabel("left ski's heading (°)")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    figure.savefig(TOP / "docs" / "images" / "few_sensors.png", dpi=110)


if __name__ == "__main__":
    main()
