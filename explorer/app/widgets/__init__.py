"""What panels are made of: bound controls, markup and charts."""
