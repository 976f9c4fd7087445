"""How far would the beginner have come in 5 s on slower snow?"""

from pathlib import Path

from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full import simulate

recording = read_recording(Path(__file__).parent / "beginner")
motion = motion_from_recording(recording)
model = model_of(recording, motion)
for mu_t in (0.04, 0.08, 0.12):
    run = simulate(model.with_values({"friction.mu_t": mu_t}), motion, stop=5.0)
    print(f"mu_t {mu_t:.2f}: {run.com[-1, 0] - run.com[0, 0]:.1f} m down the slope")
