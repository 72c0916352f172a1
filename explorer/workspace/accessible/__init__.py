"""The accessible workspace: positions that a collision-free move from home leads to."""
