"""The faces of workspaces as fine triangles whose corners lie on the exact surfaces."""
