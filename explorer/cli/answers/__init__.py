"""The answers of commands, as plain values for JSON and as lines of text."""
