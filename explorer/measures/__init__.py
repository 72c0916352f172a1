"""Measures of a design or a pose."""
