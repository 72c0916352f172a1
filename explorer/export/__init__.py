"""Files for other programs: meshes, parts, models, trajectories and reports."""
