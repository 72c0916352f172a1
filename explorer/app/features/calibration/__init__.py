"""The feature *Calibration*: the machine that was built, from a table that is dropped."""
