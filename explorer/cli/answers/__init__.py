"""What commands answer, as plain values for JSON and as lines of text."""
