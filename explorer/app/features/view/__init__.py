"""The form and the visible parts of the mechanism, the ground, and the views of the camera."""
