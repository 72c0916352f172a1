"""The form and the visible parts of the mechanism, and the views of the camera."""
