"""Figures of the model in Exudyn, as JSON on stdout; in a process of its own, since Exudyn may end its process."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import exudyn as exu
import numpy as np
from bundled import bundled
from exudyn.basicUtilities import LoadSolutionFile, SetSolutionState
from exudyn.itemInterface import LoadForceVector

import sssi_exudyn
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.result import SimulationResult

STOP = 0.5
"""s of the run that is simulated."""
LOAD = 100.0
"""N on the torso along the snow's normal."""


def main(folder: Path) -> None:
    """Build, run in two parts, look at what is drawn, and build again with a load on the back."""
    recording, motion = bundled("beginner")
    model = sssi_exudyn.build(recording, seconds=(0.0, STOP))
    mbs, solution = model.mbs, folder / "solution" / "run.txt"
    named = {kind: len(getattr(model, kind)) for kind in ("nodes", "objects", "markers", "loads", "sensors")}
    count = mbs.systemData
    numbers = [count.NumberOfNodes(), count.NumberOfObjects(), count.NumberOfMarkers(), 0, count.NumberOfSensors()]
    model.run(until=0.2)
    between = model.time
    head = model.state_of("head", (0.0, 0.0, 0.0))[0]
    marker = mbs.GetMarkerOutput(model.markers["head"], exu.OutputVariableType.Position)
    result = model.run(solution)
    whole = simulate(model_of(recording, motion), motion, stop=STOP, tree=True)
    stored = LoadSolutionFile(str(solution), verbose=False)
    SetSolutionState(mbs, stored, stored["nRows"] - 1, exu.ConfigurationType.Visualization)
    function = mbs.GetObjectParameter(model.objects["skier_and_skis"], "VgraphicsDataUserFunction")["function"]
    shapes = [np.reshape(shape["points"], (-1, 3)) for shape in function(mbs, 0)]
    feet = whole.foot_position[-1]
    snow = mbs.GetObject(model.objects["snow"], True)["VgraphicsData"]
    model.release()

    loaded = sssi_exudyn.build(recording, seconds=(0.0, STOP))
    back = loaded.add_marker("torso", (0.0, 0.0, 0.2), "back")
    loaded.mbs.AddLoad(LoadForceVector(name="hand", markerNumber=back, loadVector=[0.0, 0.0, -LOAD]))
    pressed = loaded.run()
    loads = [run.series[["left_load_N", "right_load_N"]].sum(axis=1) for run in (pressed, result)]
    sys.stdout.write(
        json.dumps(
            {
                "named": list(named.values()),
                "numbers": numbers,
                "between": between,
                "head": float(np.abs(head - marker).max()),
                "end": model.time,
                "track": largest(model.recorded("pelvis"), whole.pelvis, whole),
                "loads": largest(model.recorded("loads"), whole.foot_load, whole),
                "edges": largest(model.recorded("edge_angles"), whole.edge_angle, whole),
                "shape": list(model.recorded("left_ski_shape").shape),
                "samples": len(whole.time),
                "rows": stored["nRows"],
                "under": [float(np.abs(shapes[2 + side] - feet[side]).sum(axis=1).min()) for side in range(2)],
                "height": float(np.ptp(shapes[0][:, 2])),
                "snow": len(snow[0]["triangles"]) // 3,
                "pressed": float((loads[0] - loads[1]).mean()),
                "gravity": float(np.linalg.norm(loaded.gravity) / GRAVITY),
            }
        )
    )


def largest(table: object, expected: np.ndarray, run: SimulationResult) -> float:
    """Return the largest difference between what a sensor recorded and a simulation's series."""
    assert hasattr(table, "to_numpy")
    rows = table.to_numpy()
    np.testing.assert_allclose(rows[:, 0], run.time, atol=1e-9)
    return float(np.abs(rows[:, 1:] - expected).max())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
