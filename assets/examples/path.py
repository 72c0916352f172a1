"""Plan a path between two poses that meets no singularity, and save it over time as CSV."""

from pathlib import Path

import explorer
from explorer.export.tables import trajectory_csv
from explorer.paths.trajectory import trajectory

design = explorer.PRESETS["paper-optimal"].with_limits(leg_radii=(0.2, 0.2, 0.2, 0.2))
goal = explorer.Pose.of_yaw_pitch_roll((12.0, 4.0, 8.0), (-60.0, 5.0, 0.0))

path = explorer.plan_path(design, design.home_pose, goal)
print(f"{len(path.poses) - 1} moves keep |δ| {path.margin:.3f} and clearance {path.clearance:.3f}")

timed = trajectory(design, path.poses, speed=2.0, samples=101)  # 20 mm/s for the fastest actuator
print(f"the path takes {timed.duration:.2f} s")
Path("path.csv").write_text(trajectory_csv(timed), encoding="utf-8")
