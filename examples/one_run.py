"""Fit a recorded run, print its friction and write its report."""

from pathlib import Path

import sssi_exudyn

result = sssi_exudyn.run(Path(__file__).parent / "beginner", "results/one_run", progress=True)
friction = result.friction
print(f"mu_t = {friction.mu_t.value:.3f} ± {friction.mu_t.se:.3f}")
print(f"mu_n = {friction.mu_n.value:.3f} ± {friction.mu_n.se:.3f}")
print(f"mean error against the GPS: {result.trajectory.mean_error_m:.3f} m")
print(f"report: {result.report('results/one_run.html')}")
