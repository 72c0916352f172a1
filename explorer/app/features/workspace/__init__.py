"""The workspace: solid, cut, map and numbers."""
