"""The panels beside the scene: move, design and view on the right, singularity on the left."""
