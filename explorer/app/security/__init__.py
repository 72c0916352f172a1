"""Rules for who may connect to the server."""
