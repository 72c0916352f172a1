"""Inputs bound to the state: sliders, fields and lists, with their ranges."""
