"""What limits cannot give, told before a search."""
