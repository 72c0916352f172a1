"""Arrays, checks, compiled kernels and other numerical tools; nothing of the mechanism."""
