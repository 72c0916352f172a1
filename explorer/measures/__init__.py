"""What can be measured of a design or a pose."""
