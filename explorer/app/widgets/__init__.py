"""What panels are made of: markup, buttons, charts and the theme."""
