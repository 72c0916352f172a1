"""Sections of a workspace at constant x: exact areas and volumes, outlines and grids."""
