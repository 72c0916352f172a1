"""Undo, redo and the steps of a session."""
