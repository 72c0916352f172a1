"""The views of the camera, the overlays of the scene, and the ground."""
