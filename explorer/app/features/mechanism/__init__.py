"""The pose and the design of the mechanism, and the mechanism in the scene."""
