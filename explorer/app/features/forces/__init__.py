"""The load on the platform, and what holds it."""
