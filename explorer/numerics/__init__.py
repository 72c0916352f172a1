"""Arrays, checks, compiled kernels and other numerical tools that do not know the mechanism."""
