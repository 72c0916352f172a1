"""What of a workspace a collision-free move leads to from home."""
