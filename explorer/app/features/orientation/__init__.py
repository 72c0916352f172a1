"""The tab Tilt: what orientations a position can have, and positions over orientations."""
