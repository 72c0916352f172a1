"""Nearest singular poses, uncoupled motions, strata and ellipsoids."""
