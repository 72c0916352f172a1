"""Clocks, queues and the process that computes for the page."""
