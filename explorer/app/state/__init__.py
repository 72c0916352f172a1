"""The state of the page: one value that is saved, undone and compared as a whole."""
