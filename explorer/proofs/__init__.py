"""Demands on a design over a whole box of positions: proven, or refuted by a pose."""
