"""The folder of the user's data."""
