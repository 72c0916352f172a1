"""The load on the platform, and the reactions to it."""
