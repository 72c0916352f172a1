"""The tab Orientation: what orientations a position can have, and positions over orientations."""
