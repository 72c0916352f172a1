"""Columns of the rows in which kernels take limit surfaces.

A circle is a row (x, y, z, radius, is_ball, side): a sphere about (x, y, z), or a cylinder along
the x-axis through that point. Their slices at constant x are circles. The region lies inside the
surface (side +1) or outside it (side -1).

A plane is a row (x, y, z, offset): the half-space n·p <= offset with the normal n = (x, y, z).

A cone is a row of its apex, its unit axis, the cosine of its half-angle, and whether it is flat.
Only the yz-part of a position counts for a flat one.
"""

from __future__ import annotations

X, Y, Z = 0, 1, 2
RADIUS, IS_BALL, SIDE = 3, 4, 5
OFFSET, PLANE_COLUMNS = 3, 4
AXIS_X, AXIS_Y, AXIS_Z, COSINE, IS_FLAT, CONE_COLUMNS = 3, 4, 5, 6, 7, 8
