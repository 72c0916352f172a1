"""Atomic writing of files, strict reading of JSON, and the versions on which results depend."""
