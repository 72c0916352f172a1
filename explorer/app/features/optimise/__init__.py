"""The search for a better design."""
