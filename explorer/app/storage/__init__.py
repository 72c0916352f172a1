"""Storage in the user's data folder: the saved session and the library of designs."""
