"""Hang a rucksack on the skier's back and a damper on each ski in Exudyn, and ski on."""

import sys
from pathlib import Path

import numpy as np
from exudyn.itemInterface import (
    CartesianSpringDamper,
    LoadForceVector,
    MarkerBodyPosition,
    NodePoint,
    ObjectMassPoint,
    RigidBodySpringDamper,
)

import sssi_exudyn

MASS, BACK = 8.0, (-0.15, 0.0, 0.25)  # kg; place in the torso's frame, m

model = sssi_exudyn.build(Path(__file__).parent / "beginner", seconds=":3")
mbs = model.mbs

# a mass on springs behind the shoulders; it starts where the back is, as fast as the back
place, velocity = model.state_of("torso", BACK)
strap = model.add_marker("torso", BACK, "straps")
node = mbs.AddNode(NodePoint(name="rucksack", referenceCoordinates=list(place), initialVelocities=list(velocity)))
body = mbs.AddObject(ObjectMassPoint(name="rucksack", mass=MASS, nodeNumber=node))
marker = mbs.AddMarker(MarkerBodyPosition(name="rucksack", bodyNumber=body))
mbs.AddObject(
    CartesianSpringDamper(
        name="straps",
        markerNumbers=[strap, marker],
        stiffness=[20e3] * 3,
        damping=[200.0] * 3,  # N/m, N s/m
    )
)
mbs.AddLoad(LoadForceVector(name="weight", markerNumber=marker, loadVector=list(MASS * model.gravity)))

# a damper that resists bending between the boot and the shovel of each ski
for side in ("left", "right"):
    ends = [model.markers[f"{side}_ski_node_{number}"] for number in (25, 40)]
    bending = np.diag([0.0, 0.0, 0.0, 0.0, 20.0, 0.0])  # N m s/rad about the ski's y axis
    mbs.AddObject(
        RigidBodySpringDamper(
            name=f"{side}_piston", markerNumbers=ends, stiffness=np.zeros((6, 6)), damping=bending,
            useIntrinsicFormulation=True,
        )
    )  # fmt: skip

run = model.run("results/rucksack/solution.txt", until=2.0)
mbs.SetLoadParameter(model.loads["weight"], "loadVector", [0.0, 0.0, 0.0])  # somebody lifts it
run = model.run("results/rucksack/on.txt")
loads = model.recorded("loads")
snow = loads["left_load_N"] + loads["right_load_N"]
print(
    f"with the rucksack {snow[loads['time_s'] < 2.0].mean():.0f} N, lifted {snow[loads['time_s'] > 2.0].mean():.0f} N"
)
print(f"{len(run.series)} samples to {model.time:.2f} s")
if "--show" in sys.argv:
    mbs.SolutionViewer()
