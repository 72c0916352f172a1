"""The last change of the design: what was before as a ghost, and the differences."""
