"""The search for the best design by sequential quadratic programming."""
