"""The legs as capsules: their clearance at a pose and along a move."""
