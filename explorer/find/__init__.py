"""Requirements, and machines that keep them."""
