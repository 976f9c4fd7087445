"""Draw the README picture from a result:  python docs/images/fitted_run.py examples/beginner results/beginner"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.results.folder import read_series, read_summary
from sssi_exudyn.validation.agreement import filtered_ratio
from sssi_exudyn.validation.metrics import pressure_ratio

recording = read_recording(Path(sys.argv[1]))
series, summary = read_series(Path(sys.argv[2])), read_summary(Path(sys.argv[2]))
assert recording.gps is not None
assert recording.insoles is not None
blue, orange = "#0b62a4", "#d1660a"
figure, (path, ratio) = plt.subplots(1, 2, figsize=(10.0, 3.6), layout="constrained", width_ratios=[1.0, 1.25])
path.plot(*recording.gps.enu[:, :2].T, "o", color=orange, markersize=3.0, label="GPS")
path.plot(series["antenna_east_m"], series["antenna_north_m"], color=blue, label="simulated")
path.set(xlabel="east (m)", ylabel="north (m)", aspect="equal")
track, friction = summary.trajectory, summary.friction
path.set_title(
    f"mean error {track.mean_error_m:.3f} m of {track.length_m:.0f} m,  "
    f"$\\mu_t$ = {friction.mu_t.value:.3f},  $\\mu_n$ = {friction.mu_n.value:.2f}",
    fontsize=9,
)
path.legend(frameon=False)
insoles = recording.insoles
ratio.plot(insoles.time, filtered_ratio(insoles.time, insoles.left, insoles.right), color=orange, label="insoles")
ratio.plot(
    series["time_s"],
    pressure_ratio(*series[["left_sole_N", "right_sole_N"]].to_numpy().T),
    color=blue,
    label="simulated",
)
ratio.set(
    xlabel="time (s)",
    ylabel="left foot's share of the load",
    ylim=(-0.02, 1.02),
    xlim=(0.0, float(np.max(series["time_s"]))),
)
ratio.set_title(f"correlation {summary.pressure_ratio.correlation:.3f}", fontsize=9)
for axes in (path, ratio):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(Path(__file__).with_suffix(".png"), dpi=110)
