"""The report of a design: one HTML page that needs nothing else, to read, print and keep."""
