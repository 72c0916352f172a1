"""The library of saved designs."""
