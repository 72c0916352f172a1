"""Measurements, each beside what a user would take instead; none asserts a time.

`python tests/benchmarks [NAME ...]` prints them as one table.
"""
