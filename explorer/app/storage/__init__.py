"""Storage in the user's data folder: the saved session, the library of designs, the preferences."""
