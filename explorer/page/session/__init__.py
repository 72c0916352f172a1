"""The clock of the page, and the queue of its changes."""
