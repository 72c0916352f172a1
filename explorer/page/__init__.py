"""What a page in viser is made of, whatever mechanism it shows."""
