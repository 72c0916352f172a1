"""Files for other programs, written from what the package computes."""
