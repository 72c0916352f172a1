"""Tolerances: what each costs in precision, and which ones keep a wanted precision."""
