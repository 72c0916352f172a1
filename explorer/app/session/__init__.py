"""The one door through which the state changes, and the processes that work for it."""
