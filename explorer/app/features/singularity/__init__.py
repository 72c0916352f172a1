"""Nearest singular poses, free motions, strata, ellipsoids and the singularity-free ball."""
