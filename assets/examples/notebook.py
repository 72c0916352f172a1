# %% [markdown]
# # The explorer in a notebook
# Open this file as a notebook (VS Code and Spyder do, `jupytext --to ipynb` converts it), and run
# the cells one after the other.

# %%
import numpy as np

import explorer

view = explorer.show("paper-optimal", height=600)
view

# %% [markdown]
# The page follows what the notebook sets.

# %%
home = view.design.home_pose
view.pose = explorer.Pose((9.0, 5.0, 8.0), home.quaternion)

# %% [markdown]
# And the notebook reads what was done on the page.

# %%
heights = view.pose.position + np.linspace(-4.0, 4.0, 9)[:, None] * [0.0, 0.0, 1.0]
np.abs(explorer.margins(heights, view.pose.rotation)).min(axis=-1)

# %%
view.stop()
