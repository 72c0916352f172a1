"""The demands of a problem as functions of its variables, with their derivatives."""
