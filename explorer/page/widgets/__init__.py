"""How controls get their values, the commands and the search."""
