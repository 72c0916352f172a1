"""The steps of the session: undo, redo, a list to go to any of them, and the last change."""
