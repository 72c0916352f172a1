"""Clearances of the legs, swept tetrahedra and radii."""
