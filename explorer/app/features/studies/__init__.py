"""Design studies: set up, run, explored."""
