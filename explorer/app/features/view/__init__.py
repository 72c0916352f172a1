"""The visible parts of the mechanism."""
