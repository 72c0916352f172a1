"""Let MuJoCo move the machine: ramp one leg, and compare the platform with the kinematics.

Needs MuJoCo (`pip install mujoco`).
"""

import mujoco
import numpy as np

import explorer
from explorer.export.simulation import simulation_mjcf

design = explorer.PRESETS["paper-optimal"]
home = design.home_pose
metres = 1e-3 * design.unit_mm
model = mujoco.MjModel.from_xml_string(simulation_mjcf(design))
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)

start = explorer.inverse(design, home.position, home.rotation)
goal = start + [0.0, 0.0, 0.0, 0.0, 0.0, 0.5]  # leg 4 becomes 5 mm longer
for step in range(2000):
    share = min(1.0, step / 1000)
    data.ctrl[:] = metres * (start + share * (goal - start))
    mujoco.mj_step(model, data)

modes = explorer.forward(design, goal)
mode = int((explorer.margins(home.position, home.rotation) > 0.0) @ [4, 2, 1])
there = modes.position[mode] + modes.rotation[mode] @ design.tool.position
moved = data.site("tool").xpos / metres
print(f"tool in the simulation {np.round(moved, 3)}, by the kinematics {np.round(there, 3)}")
# Away from home each servo gives way by the change of its force: together 0.1 mm here.
assert np.abs(moved - there).max() < 0.02
