"""Fit a recorded run and print its friction."""

from pathlib import Path

import sssi_exudyn

summary = sssi_exudyn.run(Path(__file__).parent / "beginner", Path("results/one_run"))
friction = summary.friction
print(f"mu_t = {friction.mu_t.value:.3f} ± {friction.mu_t.se:.3f}")
print(f"mu_n = {friction.mu_n.value:.3f} ± {friction.mu_n.se:.3f}")
print(f"mean error against the GPS: {summary.trajectory.mean_error_m:.3f} m")
