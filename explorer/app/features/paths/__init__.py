"""Paths between two poses: planned, shown and played."""
