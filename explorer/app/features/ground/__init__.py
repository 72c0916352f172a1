"""The lights of the scene, the ground with its grid, and the shadow on it."""
