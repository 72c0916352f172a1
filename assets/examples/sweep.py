"""Sweep one design variable: the exact workspace volume and the conditioning at home."""

import csv

import numpy as np

import explorer

start = explorer.PRESETS["paper-optimal"]
rows: list[tuple[float, float, float]] = []
for b1y in np.linspace(-6.0, -3.0, 7).tolist():
    design = start.with_variable("b1y", b1y)
    volume = explorer.workspace_volume(design).volume
    home = explorer.Configuration.at(design, design.home_pose)
    conditioning = float(home.inverse_condition)
    rows.append((b1y, volume, conditioning))
    print(f"b1y = {b1y:.2f}: volume {volume:.1f}, inverse condition number {conditioning:.4f}")

with open("sweep.csv", "w", encoding="utf-8", newline="") as file:
    csv.writer(file).writerows([("b1y", "volume", "inverse_condition"), *rows])
