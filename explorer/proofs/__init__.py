"""Demands on a design over a whole box of positions: proven, or missed in a pose that is told."""
