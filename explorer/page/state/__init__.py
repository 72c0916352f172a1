"""What an action may know of the control that asked for it."""
