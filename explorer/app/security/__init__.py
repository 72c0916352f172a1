"""Rules for who may connect to the server, and for the messages of browsers."""
