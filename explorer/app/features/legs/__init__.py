"""Clearances of the legs, and swept tetrahedra."""
