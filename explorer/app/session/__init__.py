"""The session, through which the state changes, and the processes that compute for it."""
