"""Facts on the control that asked for an action."""
