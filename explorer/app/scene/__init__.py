"""What the drawings of all features share: shapes, places and the camera."""
