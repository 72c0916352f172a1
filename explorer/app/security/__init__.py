"""Who may connect to the server, and what a browser may send."""
