"""The virtual prototype and its parts."""
