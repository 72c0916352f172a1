"""The toolbar, the list of keys, the manual and the tour."""
