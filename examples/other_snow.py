"""How far would the beginner have come in 3 s on slower snow?"""

from dataclasses import replace
from pathlib import Path

import sssi_exudyn

recording = sssi_exudyn.read_recording(Path(__file__).parent / "beginner")
short = replace(recording, stop=recording.start + 3.0)
model = sssi_exudyn.model_of(short)
for mu_t in (0.04, 0.08, 0.12):
    run = sssi_exudyn.simulate(short, model=model.with_values({"friction.mu_t": mu_t}))
    com = run.stored.com
    print(f"mu_t {mu_t:.2f}: {com[-1, 0] - com[0, 0]:.1f} m down the slope")
