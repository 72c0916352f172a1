"""Moves between poses: paths that keep all limits, and trajectories along them."""
