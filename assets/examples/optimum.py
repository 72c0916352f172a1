"""Search the design whose workspace has a wanted volume, and save it."""

from pathlib import Path

import explorer

start = explorer.PRESETS["paper-initial"]
problem = explorer.make_problem(start, "match-volume", volume=900.0)
outcome = explorer.optimise_design(problem)

design = outcome.design
names = ("a3x", "a3y", "b1x", "b1y", "b2", "b3")
for name, before, after in zip(names, start.variables, design.variables, strict=True):
    print(f"{name}: {before:8.4f} becomes {after:8.4f}")
print(f"volume {explorer.workspace_volume(design).volume:.6f}, converged: {outcome.converged}")
Path("optimum.json").write_bytes(explorer.encode_design(design))
