"""Workspaces as closed meshes; the only room that imports manifold3d."""
