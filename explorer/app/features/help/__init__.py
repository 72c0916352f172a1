"""The buttons of help in the bar, the list of keys, the manual and the tour."""
