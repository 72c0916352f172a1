"""Slices of a workspace: exact areas and volumes, outlines, node counts and fields."""
