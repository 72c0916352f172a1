"""The limits of a design, as surfaces in the space of positions and as tests of poses."""
