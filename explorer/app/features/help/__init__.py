"""The tour and the list of keys."""
