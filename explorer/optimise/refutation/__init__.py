"""Demands that limits make impossible, known before a search."""
