"""Fit a recorded run and print what came out."""

from pathlib import Path

import sssi_exudyn

summary = sssi_exudyn.run(Path(__file__).parent / "beginner", Path("results/one_run"))
for name, figure in summary["friction"].items():
    print(f"{name} = {figure['value']:.3f} ± {figure['se']:.3f}")
print(f"mean error against the GPS: {summary['trajectory']['mean_error_m']:.3f} m")
