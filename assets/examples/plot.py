"""Plot the smallest margin over a level of positions, and where the limits are kept.

Needs matplotlib.
"""

import matplotlib as mpl
import numpy as np

import explorer

mpl.use("agg")  # without a display
from matplotlib import pyplot as plt

design = explorer.PRESETS["paper-optimal"]
x, y = np.meshgrid(np.linspace(-2.0, 22.0, 121), np.linspace(-14.0, 24.0, 191))
positions = np.stack([x, y, np.full_like(x, 9.0)], axis=-1)  # (191, 121, 3)
rotation = design.home_pose.rotation

smallest = np.abs(explorer.margins(positions, rotation)).min(axis=-1)
valid = explorer.poses_are_valid(design, positions, rotation)

figure, axes = plt.subplots(figsize=(3.35, 4.2), layout="constrained")
filled = axes.contourf(x, y, np.where(valid, smallest, np.nan), levels=10)
axes.contour(x, y, valid, levels=[0.5], colors="black", linewidths=0.8)
axes.set(xlabel="x", ylabel="y", title="z = 9", aspect="equal")
figure.colorbar(filled, label="smallest margin, in units of 10 mm")
figure.savefig("margins.png", dpi=200)
