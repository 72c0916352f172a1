"""Sweep one design variable: the exact workspace volume and the smallest margin at home."""

import csv

import numpy as np

import explorer

start = explorer.PRESETS["paper-optimal"]
rows: list[tuple[float, float, float]] = []
for b3 in np.linspace(3.5, 6.5, 7).tolist():
    design = start.with_variable("b3", b3)
    volume = explorer.workspace_volume(design).volume
    home = design.home_pose
    margin = abs(explorer.margins(home.position, home.rotation)).min()
    rows.append((b3, volume, float(margin)))
    print(f"b3 = {b3:.2f}: volume {volume:.1f}, smallest margin {margin:.3f}")

with open("sweep.csv", "w", encoding="utf-8", newline="") as file:
    csv.writer(file).writerows([("b3", "volume", "margin"), *rows])
