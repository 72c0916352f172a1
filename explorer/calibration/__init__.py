"""Calibration: which machine was built, from what is measured of it, and in which poses."""
