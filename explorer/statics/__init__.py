"""Loads, stiffness and precision: what a pose carries, and how exactly it places the tool."""
