"""The scene of all features: its parts, shapes, scale and cameras."""
