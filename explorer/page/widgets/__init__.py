"""How controls get their values, and the palette of commands."""
