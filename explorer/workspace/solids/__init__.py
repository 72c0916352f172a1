"""Workspaces as closed meshes, made by booleans of manifold3d."""
