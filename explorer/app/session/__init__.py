"""The session, through which the state changes."""
