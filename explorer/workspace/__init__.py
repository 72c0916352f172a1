"""Which poses a design can take: positions at one orientation, and orientations at one position."""
