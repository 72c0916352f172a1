"""What is kept in the user's data folder: the session as it was left, and named designs."""
