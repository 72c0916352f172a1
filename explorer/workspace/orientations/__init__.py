"""Orientations: sets of them, the share of all at a position, greatest tilts and torsions."""
