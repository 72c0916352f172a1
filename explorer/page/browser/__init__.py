"""Additions to viser's page, and the browser that takes pictures of it."""
